"""One of two radars falls silent while the other goes on publishing: what it saw last must not go unseen."""

import time

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_peer import ON_THE_SLOPE, cloud, polygon, poses, with_alerts

BESIDE = ((50.0, 2.0), (58.0, 2.0), (58.0, 8.0), (50.0, 8.0))
"""Corners (m) of an area that no rock comes to."""

OLDEST = 4
"""Seconds after which sources are stale."""

EVERY = 0.3
"""Seconds between two messages of the radar that publishes."""


def speak_until(peer, found, what):
    """Send sources again and again until something has happened."""
    spoken = [0.0]

    def look():
        if time.monotonic() - spoken[0] > EVERY:
            peer.send("sources", poses([ON_THE_SLOPE], peer.now()))
            spoken[0] = time.monotonic()
        return found()

    return peer.wait(look, what)


def said_since(peer, after, words):
    return any(words in status.message for array in peer.alerts[after:] for status in array.status)


def test_a_radar_that_falls_silent_is_named_in_a_fault_until_it_speaks_while_another_speaks_on(stage):
    stage.node("simulator_node", **with_alerts(stage.folder, oldest=OLDEST))
    peer = stage.live_peer()
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    peer.stand_on_ramp()
    peer.send("areas/polygon", polygon(BESIDE, peer.now()))
    speak_until(peer, lambda: said_since(peer, 0, "normal"), "normal, for no rock comes there")
    peer.send("source_cloud", cloud(np.array([[10.0, 40.0, 32.0]]), peer.now()))
    silent = "nothing has been heard of sources on source_cloud for"
    speak_until(peer, lambda: said_since(peer, 0, f"fault: {silent}"), "the silence to be told")
    before = len(peer.alerts)
    peer.send("source_cloud", cloud(np.empty((0, 3)), peer.now()))
    speak_until(peer, lambda: said_since(peer, before, "normal"), "normal, for it has spoken")
