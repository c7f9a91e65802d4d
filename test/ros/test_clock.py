"""A machine's clock that is set back, of which ROS tells nobody."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.simulator import SimulatorNode


def test_a_clock_that_is_set_back_is_noticed_once():
    times, back = iter([10_000_000_000, 11_000_000_000, 5_000_000_000, 6_000_000_000]), []
    node = SimpleNamespace(
        _now=lambda: next(times), _ticked=0, _clock_went_back=back.append, station=None, inputs=None
    )
    for _ in range(4):
        SimulatorNode._tick(node)
    assert back == pytest.approx([6.0])
