"""Tests that the busy time of the executor is measured for each round and reported once per second."""

import time

import pytest
from rclpy.clock import Clock
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.messages.health import OK, WARN
from rpf3d_ros.nodes.executor_delay import ExecutorDelay
from rpf3d_ros.nodes.timed_executor import TimedExecutor

ROUNDING = 0.1
"""Rounding (ms) of the report, which has one decimal."""


def sleeps_once(node: Node, executor: SingleThreadedExecutor, *seconds: float) -> float:
    """Let callbacks keep the node's executor busy, one for each time (s) of `seconds`, all in one round.

    Return the time (s) until this round was finished, which is longer on a busy machine.
    """
    done: list[float] = []
    began = time.monotonic()

    def busy(one: float) -> None:
        time.sleep(one)
        done.append(one)

    for one in seconds:
        timer = node.create_timer(0.0, lambda: None, clock=Clock())
        timer.callback = lambda timer=timer, one=one: (timer.cancel(), busy(one))
    while len(done) < len(seconds):
        executor.spin_once(timeout_sec=0.1)
    executor.spin_once(timeout_sec=0.0)
    return time.monotonic() - began


def test_a_round_lasts_as_long_as_its_callbacks_together(node):
    executor = TimedExecutor(context=node.context)
    executor.add_node(node)
    took = sleeps_once(node, executor, 0.06, 0.07)
    assert 0.13 <= executor.longest_round() <= took
    assert executor.longest_round() == 0.0, "taken once"


def test_waiting_for_messages_is_no_round(node):
    executor = TimedExecutor(context=node.context)
    executor.add_node(node)
    executor.spin_once(timeout_sec=2.0)
    executor.spin_once(timeout_sec=0.0)
    assert executor.longest_round() < 1.0


class Told:
    """Stands in for the node's health report and keeps the last state of the executor."""

    def set(self, part: str, level: int, message: str, values: dict[str, str]) -> None:
        assert part == "executor"
        self.level, self.gap_ms, self.longest_ms = level, float(values["gap_ms"]), float(values["longest_gap_ms"])


@pytest.fixture
def told() -> Told:
    return Told()


def test_a_busy_executor_is_a_warning_until_the_next_report(node, told):
    executor, delay = TimedExecutor(context=node.context), ExecutorDelay(node, told)
    executor.add_node(node)
    took = sleeps_once(node, executor, 0.08)
    delay.report()
    assert told.level == WARN
    assert 80.0 <= told.gap_ms <= 1e3 * took + ROUNDING
    delay.report()
    assert told.level == OK
    assert told.gap_ms < told.longest_ms
    delay.reset()
    assert delay.longest == 0.0


def test_a_timer_that_comes_late_is_a_gap_on_any_executor(node, told):
    executor, delay = SingleThreadedExecutor(context=node.context), ExecutorDelay(node, told)
    executor.add_node(node)
    time.sleep(1.1)
    delay.report()
    assert (told.level, told.gap_ms >= 90.0) == (WARN, True)


def test_the_node_reports_it_in_diagnostics(node):
    health = HealthReport(node)
    ExecutorDelay(node, health).report()
    assert health._parts["executor"].level == OK


def test_a_node_at_rest_is_woken_a_few_times_a_second(node):
    """A timer of 10 ms that measures the delay would take a sixth of a core."""
    executor = TimedExecutor(context=node.context)
    executor.add_node(node)
    ExecutorDelay(node, HealthReport(node))
    executor.spin_once(timeout_sec=0.0)
    rounds, until = 0, time.monotonic() + 1.0
    while (left := until - time.monotonic()) > 0.0:
        executor.spin_once(timeout_sec=left)
        rounds += 1
    assert rounds <= 8
