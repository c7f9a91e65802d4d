"""Tests that a killed simulator starts again with the last complete terrain and the held level, and reports both."""

import re
import signal

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import cloud, ramp_of, with_alerts

from rpf3d_core.alerts.audit import audit_log

LARGE = 1200
"""Points along a side of a terrain that takes about 1 s to build, and as long to write."""


def killed(process):
    process.send_signal(signal.SIGKILL)
    process.wait()


def back(stage, peer):
    """Start the simulator again; return its process, its state of the terrain, and the first site status."""
    said, alerts = len(peer.said), len(peer.alerts)
    process = stage.node("simulator_node", **with_alerts(stage.folder))
    terrain = peer.wait_for_sentence(" old", said)
    peer.wait(lambda: len(peer.alerts) > alerts, "an alert")
    return process, terrain, peer.alerts[alerts].status[0]


def test_a_simulator_killed_in_the_middle_of_an_update_comes_back_with_the_last_good_terrain_and_its_alert(stage):
    process = stage.node("simulator_node", **with_alerts(stage.folder))
    peer = stage.live_peer()
    peer.wait_for_simulator()
    ramp_digest = peer.see_rocks_reach_the_toe()["terrain_digest"]
    peer.wait_for_sentence("is stored", len(peer.said))
    peer.send("terrain/points", cloud(ramp_of(LARGE), peer.now()))
    peer.spin(0.4)  # the terrain is being built
    killed(process)
    peer.spin(0.5)
    assert peer.answer_values()["terrain_digest"] == ramp_digest, "the update was over: make it larger"

    process, terrain, alert = back(stage, peer)
    assert re.search(r"\d (seconds|minutes) old", terrain.message)
    assert alert.message.startswith("evacuate"), "a level that is held is lost by no kill"
    assert peer.answered_again()["terrain_digest"] == ramp_digest
    peer.send("terrain/points", cloud(ramp_of(LARGE), peer.now()))
    large_digest = peer.wait(lambda: (d := peer.answered()["terrain_digest"]) != ramp_digest and d, "the new terrain")
    killed(process)  # the terrain is being written, or was just written

    process, _, alert = back(stage, peer)
    assert alert.message.startswith("evacuate")
    assert peer.answered_again()["terrain_digest"] in (ramp_digest, large_digest)
    assert stage.clear()[-1] == 0
    assert audit_log(stage.folder / "decisions").sound
