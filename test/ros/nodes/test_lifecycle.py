"""Tests of the process rpf3d_simulator in each lifecycle state, over its services."""

import time

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from programs.ending import ended_in_time
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_msgs.msg import Header

from rpf3d_core.live.survey import GridSurvey
from rpf3d_ros.interface.answer_publishers import TOPICS
from rpf3d_ros.messages.cloud_messages import cloud_of_grid
from rpf3d_ros.messages.result_messages import facts_of

NODE = "rpf3d_simulator"
QUIET = {
    "autostart": "false", "engine": "reference", "rebound": "constant", "ground": "sliding", "first_rocks": 1,
    "target.most_rocks": 1, "position_spread": 0.0, "velocity_spread": 0.0,
}  # fmt: skip
COMPUTING, WALL = 4.0, 8.0
"""Longest CPU time (s) and wall time (s) until a node ends that may finish the rocks that are flying."""


def cloud():
    y, x = np.mgrid[0:21, 0:21].astype(float)
    return cloud_of_grid(Header(frame_id="map"), GridSurvey(np.stack([x, y, np.zeros_like(x)], axis=-1)))


def poses(stamp, count=1):
    each = [Pose(position=Point(x=5.3, y=5.4, z=5.0), orientation=Quaternion(w=1.0))] * count
    return PoseArray(header=Header(frame_id="map", stamp=Time(sec=stamp)), poses=each)


def change(peer, transition):
    request = ChangeState.Request(transition=Transition(id=transition))
    return peer.call(ChangeState, f"{NODE}/change_state", request).success


def state(peer):
    return peer.call(GetState, f"{NODE}/get_state", GetState.Request()).current_state.label


def set_parameter(peer, name, value):
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    return peer.call(SetParameters, f"{NODE}/set_parameters", request).results[0]


def answered(peer, sent):
    def found():
        received = [message for message in peer.received["results"] if message.header.stamp == sent.header.stamp]
        return received and facts_of(received[-1])

    return peer.wait(found, "an answer")


def spin(peer, seconds):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        peer.executor.spin_once(timeout_sec=0.05)


def test_a_node_goes_through_its_states_and_answers_in_one_of_them_only(stage, tmp_path):
    stage.node("simulator_node", **QUIET, store=tmp_path / "store")
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=tuple(TOPICS))
    assert state(peer) == "unconfigured"
    assert change(peer, Transition.TRANSITION_CONFIGURE) and state(peer) == "inactive"
    peer.send("terrain/points", cloud())
    peer.send("sources", poses(1))
    spin(peer, 0.5)
    assert change(peer, Transition.TRANSITION_ACTIVATE) and state(peer) == "active"
    peer.wait_for_subscribers()
    peer.send("terrain/points", cloud())
    first = poses(2)
    peer.send("sources", first)
    assert answered(peer, first).rocks == 1
    peer.wait(lambda: all(peer.received.values()), "the answer on every topic, in whatever order they arrive")
    assert not any(message.header.stamp.sec == 1 for message in peer.received["results"])
    assert change(peer, Transition.TRANSITION_DEACTIVATE) and state(peer) == "inactive"
    received = {topic: len(messages) for topic, messages in peer.received.items()}
    peer.send("sources", poses(3))
    spin(peer, 1.0)
    assert {topic: len(messages) for topic, messages in peer.received.items()} == received
    assert change(peer, Transition.TRANSITION_ACTIVATE)
    peer.wait_for_subscribers()
    again = poses(4)
    peer.send("sources", again)
    answered(peer, again)  # with the terrain that it still has
    assert not any(message.header.stamp.sec == 3 for message in peer.received["results"])
    assert change(peer, Transition.TRANSITION_DEACTIVATE)
    assert change(peer, Transition.TRANSITION_CLEANUP) and state(peer) == "unconfigured"
    assert change(peer, Transition.TRANSITION_CONFIGURE) and change(peer, Transition.TRANSITION_ACTIVATE)
    assert peer.wait_for_health(f"{NODE}: terrain", "restored")
    assert peer.wait_for_health(f"{NODE}: run", "waiting for sources")
    assert stage.clear() == [0], stage.output("simulator_node")


@pytest.mark.long
def test_a_transition_that_the_state_does_not_allow_is_refused_and_the_node_lives_on(stage):
    stage.node("simulator_node", **QUIET)
    peer = stage.peer()
    assert not change(peer, Transition.TRANSITION_ACTIVATE)
    assert not change(peer, Transition.TRANSITION_CLEANUP)
    assert state(peer) == "unconfigured"


@pytest.mark.long
def test_a_node_that_cannot_be_configured_says_why_and_can_be_once_that_is_mended(stage, tmp_path):
    stage.node("simulator_node", **QUIET, site_file=str(tmp_path / "missing.yaml"))
    peer = stage.peer()
    assert not change(peer, Transition.TRANSITION_CONFIGURE)
    assert "missing.yaml" in peer.wait_for_health(f"{NODE}: lifecycle", "not configured").message
    assert state(peer) == "unconfigured"
    assert set_parameter(peer, "site_file", "").successful
    assert change(peer, Transition.TRANSITION_CONFIGURE)
    refused = set_parameter(peer, "first_rocks", 7)
    assert not refused.successful and "cannot change while the node is configured" in refused.reason
    assert change(peer, Transition.TRANSITION_CLEANUP)
    assert set_parameter(peer, "first_rocks", 7).successful


def test_a_node_configures_and_activates_itself_where_it_is_told_to(stage):
    stage.node("simulator_node", **{**QUIET, "autostart": "true"})
    peer = stage.peer()
    peer.wait(
        lambda: (health := peer.health.get(f"{NODE}: lifecycle")) and health.message == "active",
        "the node to be active, which contains the word of an inactive one",
    )
    assert state(peer) == "active"


STATES = {
    "unconfigured": (),
    "inactive": (Transition.TRANSITION_CONFIGURE,),
    "active": (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE),
}


@pytest.mark.long
@pytest.mark.parametrize("where", STATES)
def test_a_signal_ends_the_node_at_once_whatever_state_it_is_in(stage, where):
    process = stage.node("simulator_node", **QUIET)
    peer = stage.peer()
    for transition in STATES[where]:
        assert change(peer, transition)
    assert state(peer) == where
    assert_ends(process, stage)


def test_a_signal_ends_a_node_that_is_being_configured(stage, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "nothing compiled"))  # so that configuring takes at least 10 s
    process = stage.node("simulator_node", **{**QUIET, "autostart": "true", "engine": "auto", "effects.drag": "true"})
    stage.peer().wait_for_health(f"{NODE}: lifecycle", "configuring")
    assert_ends(process, stage)


def test_a_signal_ends_a_node_that_is_flying(stage):
    bouncing = {"autostart": "true", "materials.default.normal_restitution": 0.99}
    process = stage.node("simulator_node", **{**QUIET, **bouncing})
    peer = stage.peer(publishes=("terrain/points", "sources"))
    peer.wait_for_subscribers()
    peer.send("terrain/points", cloud())
    peer.wait_for_health(f"{NODE}: run", "waiting for sources")
    peer.send("sources", poses(1, count=500))
    peer.wait_for_health(f"{NODE}: sources", "received")
    assert_ends(process, stage)


def assert_ends(process, stage):
    assert ended_in_time(process, computing=COMPUTING, wall=WALL) == 0, stage.output("simulator_node")
    assert "Traceback" not in stage.output("simulator_node")


def test_two_names_of_one_topic_of_sources_are_refused_when_the_node_is_configured(stage):
    stage.node("simulator_node", **QUIET, source_topics="[radar, /radar]")
    peer = stage.peer()
    assert not change(peer, Transition.TRANSITION_CONFIGURE) and state(peer) == "unconfigured"
