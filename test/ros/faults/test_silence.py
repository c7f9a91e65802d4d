"""Tests that the silence of one of two radars is a fault or a warning while the other publishes."""

import time

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import PoseArray
from messages.live_peer import ON_THE_SLOPE, cloud, long_ramp, polygon, poses, with_alerts

from rpf3d_ros.interface.qos import LATCHED
from rpf3d_ros.messages.health import ERROR, OK

BESIDE = ((50.0, 2.0), (58.0, 2.0), (58.0, 8.0), (50.0, 8.0))
"""Corners (m) of an area that no rock reaches."""

MACHINE = (54.0, 5.0, 0.0)
"""Place (m) of a machine in this area."""

OLDEST = 4
"""Age (s) from which on sources are stale."""

EVERY = 0.3
"""Time (s) between two messages of the radar that publishes."""


def speak_until(peer, found, what, cloud_too=False):
    """Publish sources repeatedly until `found()` is true; return this value.

    what : for the failure message; cloud_too : whether the other radar publishes empty sources meanwhile
    """
    spoken = [0.0]

    def look():
        if time.monotonic() - spoken[0] > EVERY:
            peer.send("sources", poses([ON_THE_SLOPE], peer.now()))
            if cloud_too:
                peer.send("source_cloud", cloud(np.empty((0, 3)), peer.now()))
            spoken[0] = time.monotonic()
        return found()

    return peer.wait(look, what)


def said_since(peer, after, words):
    return any(words in status.message for array in peer.alerts[after:] for status in array.status)


@pytest.fixture
def mine(stage):
    """Return a peer, with a publisher of each topic, of a simulator that watches an area that no rock reaches."""
    stage.node("simulator_node", **with_alerts(stage.folder, oldest=OLDEST))
    peer = stage.live_peer()
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    peer.send("terrain/points", cloud(long_ramp(), peer.now()))
    peer.send("areas/polygon", polygon(BESIDE, peer.now()))
    return peer


def test_a_radar_that_falls_silent_is_named_in_a_fault_until_it_speaks_while_another_speaks_on(mine):
    peer = mine
    speak_until(peer, lambda: said_since(peer, 0, "normal"), "normal, for no rock comes there", cloud_too=True)
    peer.send("source_cloud", cloud(np.array([[10.0, 40.0, 32.0]]), peer.now()))
    silent = "nothing has been received on source_cloud for"
    speak_until(peer, lambda: said_since(peer, 0, f"fault: {silent}"), "the silence to be told")
    before = len(peer.alerts)
    peer.send("source_cloud", cloud(np.empty((0, 3)), peer.now()))
    speak_until(peer, lambda: said_since(peer, before, "normal"), "normal, for it has spoken", cloud_too=True)


def test_a_radar_that_is_connected_and_was_never_heard_is_named_in_a_fault_until_it_speaks(mine):
    """The parameter `expected_topics` is empty."""
    mute = f"source_cloud has had a publisher (/mine) for more than {OLDEST} s, but no valid message"
    speak_until(mine, lambda: said_since(mine, 0, mute), "the mute radar to be told of")
    told = next(s for array in mine.alerts for s in array.status if mute in s.message)
    assert told.message.startswith("fault: ")
    inputs = lambda: mine.health["rpf3d_simulator: inputs"]  # noqa: E731
    what = "the fault in the diagnostics, which may come after the alert"
    speak_until(mine, lambda: inputs().level[0] == ERROR and mute in inputs().message, what)
    before = len(mine.alerts)
    speak_until(mine, lambda: said_since(mine, before, "normal"), "normal, for it has spoken", cloud_too=True)
    speak_until(mine, lambda: inputs().level[0] == OK, "the diagnostics to be OK", cloud_too=True)


def test_a_latched_area_from_before_the_start_is_a_fault_that_names_its_topic_until_it_is_published_again(stage):
    given = with_alerts(stage.folder, oldest=OLDEST)
    with given["site_file"].open("a") as site:
        site.write("  equipment*: {restrict: {reach_probability: 0.1}}\n")
    peer = stage.live_peer()
    peer.node.destroy_publisher(peer.publishers["areas/equipment"])
    peer.publishers["areas/equipment"] = peer.node.create_publisher(PoseArray, "areas/equipment", LATCHED)
    peer.send("areas/equipment", poses([MACHINE], peer.now()))
    stage.node("simulator_node", **given)
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    peer.send("terrain/points", cloud(long_ramp(), peer.now()))
    peer.send("areas/polygon", polygon(BESIDE, peer.now()))
    mute = f"areas/equipment has had a publisher (/mine) for more than {OLDEST} s, but no valid message"
    speak_until(peer, lambda: said_since(peer, 0, mute), "the fault of the mute topic", cloud_too=True)
    assert next(s for array in peer.alerts for s in array.status if mute in s.message).message.startswith("fault: ")
    speak_until(peer, lambda: peer.alarms[-1], "the alarm of the fault", cloud_too=True)
    before = len(peer.alerts)
    peer.send("areas/equipment", poses([], peer.now()))
    speak_until(peer, lambda: said_since(peer, before, "normal"), "normal after the new message", cloud_too=True)
