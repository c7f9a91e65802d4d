"""Tests that a node's objects are freed, although the garbage collector ignores the objects from its start."""

import gc
import weakref

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import rclpy
from rclpy.lifecycle import TransitionCallbackReturn

from rpf3d_core.live.standing import stand_on
from rpf3d_core.live.survey import GridSurvey
from rpf3d_ros.engine import configuration
from rpf3d_ros.nodes import simulator

DONE = TransitionCallbackReturn.SUCCESS


@pytest.fixture
def node(stage, monkeypatch):
    monkeypatch.setattr(configuration, "warm", lambda scene, parameters: 0.0)  # compiles nothing
    rclpy.init(args=["--ros-args", "-p", "autostart:=false"])
    made = simulator.SimulatorNode()
    yield made
    made.destroy_node()
    rclpy.try_shutdown()
    gc.unfreeze()


def test_cleanup_frees_the_ground_and_what_it_was_made_with(node):
    for _ in range(2):
        assert node.trigger_configure() == DONE
        assert gc.get_freeze_count() > 0
        station = node.station
        made = station._configuration
        y, x = np.mgrid[0:20, 0:20].astype(float)
        ground = made.workshop.whole(GridSurvey(np.stack([x, y, np.sin(x)], axis=-1)))
        station.flyer.hand_over(ready=stand_on(ground, made.scene))
        kept = [weakref.ref(each) for each in (station, made.workshop, ground)]
        del station, made, ground
        assert node.trigger_cleanup() == DONE
        assert [each() for each in kept] == [None, None, None]
