"""What configuring makes ready."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_core.live.store import Store
from rpf3d_ros.engine import configuration
from rpf3d_ros.engine.configuration import configuration_of
from rpf3d_ros.interface.parameters import SimulatorParameters


def test_configuring_that_fails_leaves_the_store_free_for_the_next_time(tmp_path, monkeypatch):
    def broken(scene, parameters):
        raise RuntimeError("broken")

    monkeypatch.setattr(configuration, "warm", broken)
    with pytest.raises(RuntimeError, match="broken"):
        configuration_of(SimulatorParameters(store=str(tmp_path)), {}, 0)
    Store(tmp_path).close(20.0)
