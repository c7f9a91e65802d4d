"""Tests of a machine's clock that is set back, which ROS does not report."""

import time
from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import rclpy
from messages.live_peer import PATIENCE
from rclpy.executors import SingleThreadedExecutor
from rclpy.time import Time

from rpf3d_ros.nodes import simulator
from rpf3d_ros.nodes.simulator import SimulatorNode


def test_a_clock_that_is_set_back_is_noticed_once():
    times, back = iter([10_000_000_000, 11_000_000_000, 5_000_000_000, 6_000_000_000]), []
    node = SimpleNamespace(_now=lambda: next(times), _ticked=0, _clock_went_back=back.append, station=None, inputs=None)
    node._notice_jump = lambda: SimulatorNode._notice_jump(node)
    for _ in range(4):
        SimulatorNode._tick(node)
    assert back == pytest.approx([6.0])


def test_it_looks_at_the_clock_also_while_that_lies_behind_what_it_was(stage, monkeypatch):
    """After a step back of the machine's clock, timers of ROS time wait until the clock has caught up."""
    monkeypatch.setattr(simulator, "TICK", 0.02)
    rclpy.init(args=["--ros-args", "-p", "autostart:=false"])
    try:
        node, executor = SimulatorNode(), SingleThreadedExecutor()
        executor.add_node(node)
        clock = node.get_clock()
        before, back = clock.now().nanoseconds, []
        clock._set_ros_time_is_active(True)
        monkeypatch.setattr(node, "_clock_went_back", back.append)
        clock.set_ros_time_override(Time(nanoseconds=before - 60_000_000_000, clock_type=clock.clock_type))
        node._ticked, until = before, time.monotonic() + PATIENCE
        while not back and time.monotonic() < until:
            executor.spin_once(timeout_sec=0.1)
        assert back[0] == pytest.approx(60.0)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
