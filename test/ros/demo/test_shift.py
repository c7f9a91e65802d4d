"""Tests of the demo's shift: it sends the messages of its script, and its clock runs at the chosen rate."""

import time
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rclpy.context import Context
from rclpy.node import Node

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence, areas_of
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.site import read_site
from rpf3d_core.errors import InputError
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_ros.demo import run as demo
from rpf3d_ros.demo.shift import EVENTS, LENGTH, LONGEST_STEP, Shift
from rpf3d_ros.demo.shift_content import EDGE, with_muck
from rpf3d_ros.interface.simulated_clock import SimulatedClock
from rpf3d_ros.messages.refusals import TAKEN_UP

SLACK_NS = 50_000_000
"""Longest time (ns) between two readings of a clock on a busy machine."""


@pytest.fixture
def clock():
    context = Context()
    context.init()
    node = Node("clock_test", context=context)
    with SimulatedClock(node, 1_000) as made:
        yield made
    node.destroy_node()
    context.try_shutdown()


def test_a_clock_stands_still_jumps_both_ways_and_skips_only_forward(clock):
    clock.run_at(0.0)
    stood = clock.now_ns()
    time.sleep(0.02)
    assert clock.now_ns() == stood
    clock.jump(-3.0)
    assert clock.now_ns() == stood - 3_000_000_000
    clock.skip_to(stood - 4_000_000_000)
    assert clock.now_ns() == stood - 3_000_000_000
    clock.skip_to(stood)
    assert clock.now_ns() == stood


def test_a_clock_at_twenty_times_the_rate_goes_on_from_where_it_was(clock):
    clock.run_at(0.0)
    stood, began = clock.now_ns(), time.monotonic_ns()
    clock.run_at(20.0)
    time.sleep(0.05)
    passed = clock.now_ns() - stood
    assert 20 * 50_000_000 <= passed <= 20 * (time.monotonic_ns() - began) + SLACK_NS


class BusyMachine:
    """A stand-in that answers at once, and whose turns take some time (s)."""

    def __init__(self, turn):
        self._turn, self.published = turn, 0

    def subscribe(self, *_):
        pass

    def publish(self, *_):
        self.published += 1

    def wait(self, *_):
        return True

    def spin_once(self):
        time.sleep(self._turn)


@pytest.mark.parametrize("turn", [0.001, 0.3])
def test_the_clock_of_a_demo_that_stops_for_a_while_does_not_run_ahead_of_the_radar(clock, turn):
    """A turn of 0.3 s would be 30 s of the shift at 100 times the speed: the radar's last message would be stale."""
    machine, jumps = BusyMachine(turn), []
    shift = Shift(None, machine, clock, speed=100.0)
    jump = clock.jump
    clock.jump = lambda seconds: (jumps.append(seconds), jump(seconds))
    shift._pass_until(20.0)
    assert sum(jumps) > 10.0 and max(jumps) <= 99 * LONGEST_STEP
    assert machine.published >= 2


def test_the_shift_has_two_updates_three_bursts_and_one_acknowledgement_in_five_minutes():
    done = [event.action for event in EVENTS]
    assert done.count("falls") == 3 and done.count("acknowledge") == 1
    assert done.count("fails") + done.count("cleaned") == 2
    assert [event.at for event in EVENTS] == sorted(event.at for event in EVENTS) and EVENTS[-1].at < LENGTH == 300.0
    assert all(callable(getattr(Shift, what)) for what in done)


@pytest.mark.parametrize(("answer", "is_refused"), [(TAKEN_UP, False), ("the evidence has become worse", True)])
def test_an_acknowledgement_that_is_only_taken_up_is_not_refused(answer, is_refused):
    """The node must answer even if the decision is not made yet (busy machine) or not on disk yet (slow disk)."""
    stand_in = SimpleNamespace(acknowledge=lambda by, seconds: (False, answer))
    shift = SimpleNamespace(_stand_in=stand_in)
    with pytest.raises(InputError, match=answer) if is_refused else nullcontext():
        Shift.acknowledge(shift)


def test_muck_only_fills_and_lies_at_its_slope_where_it_lies():
    x, y = np.meshgrid(EDGE + np.arange(-3.0, 30.0), np.arange(-80.0, 80.0))
    bench = np.stack([x, y, np.where(x < EDGE + 1.0, 1664.0, 1652.0)], axis=-1)
    muck = with_muck(bench)
    raised = muck[..., 2] - bench[..., 2]
    assert (raised >= 0.0).all() and raised.max() > 8.0 and (raised[x <= EDGE] == 0.0).all()
    assert (muck[..., :2] == bench[..., :2]).all() and (raised[np.abs(y) > 75.0] == 0.0).all()


def test_the_bench_as_it_was_in_the_morning_demands_nothing_of_the_site(tmp_path):
    scene = read_scene(demo.shipped("config/scenes/shift.yaml"))
    areas = areas_of(run_scene(scene, tmp_path / "out", engine="reference").maps)
    site = read_site(demo.shipped("config/site_shift.yaml"))
    alert = decide(None, Evidence(1, 0, 0, 0, 0, "", "", 1, 1, "", areas), site, 0)
    assert alert.evident == Level.NORMAL and [area.name for area in areas] == ["haul_ramp"]


def test_levels_must_have_been_told_in_their_order():
    assert demo._in_order(("evacuate", "normal"), ["fault", "normal", "evacuate", "fault", "normal"])
    assert not demo._in_order(("evacuate", "normal"), ["normal", "evacuate"])
