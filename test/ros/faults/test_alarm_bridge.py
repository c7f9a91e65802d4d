"""Tests that the contact of the alarm bridge opens, whichever program is stopped or killed."""

import signal
import socket
import time
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from diagnostic_msgs.msg import DiagnosticArray
from messages.live_peer import PATIENCE, LivePeer, cloud, poses, with_alerts
from programs.ports import free_port

from rpf3d_ros.interface.qos import ALERTS, DEADLINE, HEARTBEAT, LEASE
from rpf3d_ros.nodes.alarm_contacts import is_closed, line_says_closed

OPENS_WITHIN = LEASE + 2.0
"""Longest time (s) from the end of a program until the contact is open."""


class Mine(LivePeer):
    """A mine that publishes what the simulator needs for the level `normal`."""

    def keep_calm(self, condition, what, seconds=PATIENCE):
        """Publish empty sources repeatedly until `condition()` is true; fail after `seconds`, naming `what`."""
        until, spoken = time.monotonic() + seconds, 0.0
        while not condition():
            assert time.monotonic() < until, what
            if time.monotonic() - spoken > 0.5:
                self.watch_toe()
                self.send("sources", poses([], self.now()))
                spoken = time.monotonic()
            self._turn(0.02)


@pytest.fixture
def scene(stage):
    """Return mine, contact file, simulator process, bridge process and contact port, when the contact is closed."""
    contact = stage.folder / "contact"
    port = free_port()
    bridge = stage.node("alarm_bridge_node", contact_file=contact, contact_port=port)
    simulator = stage.node("simulator_node", **with_alerts(stage.folder))
    stage.peers.append(mine := Mine())
    mine.wait_for_simulator()
    mine.wait_for_sentence("active")
    assert not is_closed(contact), "nothing is known yet"
    mine.stand_on_ramp()
    mine.keep_calm(lambda: is_closed(contact), "the contact to close")
    return mine, contact, simulator, bridge, port


def test_the_contact_opens_for_an_alarm_and_when_the_simulator_is_stopped_or_killed_and_closes_again(scene, stage):
    mine, contact, simulator, _, port = scene
    with socket.create_connection(("127.0.0.1", port), timeout=OPENS_WITHIN) as client:
        lines = client.makefile("rb")
        mine.keep_calm(lambda: line_says_closed(lines.readline()), "the TCP contact to close")
        simulator.send_signal(signal.SIGSTOP)
        mine.keep_calm(lambda: not is_closed(contact), "the contact to open after SIGSTOP", OPENS_WITHIN)
        mine.keep_calm(lambda: not line_says_closed(lines.readline()), "the TCP contact to open", OPENS_WITHIN)
    simulator.send_signal(signal.SIGCONT)
    mine.keep_calm(lambda: is_closed(contact), "the contact to close again")
    simulator.kill()
    mine.keep_calm(lambda: not is_closed(contact), "the contact to open after kill -9", OPENS_WITHIN)
    stage.named_node("again", "simulator_node", **with_alerts(stage.folder))
    mine.keep_calm(lambda: is_closed(contact), "the contact to close after a restart")

    def opens_for_a_fault():
        """Publish damaged sources on each turn: the new simulator may not have discovered every publisher yet."""
        mine.send("source_cloud", cloud(np.full((3, 3), np.nan), mine.now()))
        return not is_closed(contact)

    mine.keep_calm(opens_for_a_fault, "the contact to open for a fault", OPENS_WITHIN)


def test_the_contact_opens_when_the_bridge_itself_is_killed(scene):
    _, contact, _, bridge, port = scene
    with socket.create_connection(("127.0.0.1", port), timeout=OPENS_WITHIN) as client:
        assert client.recv(64), "the bridge has accepted the connection, so its death ends it and resets none"
        bridge.kill()
        bridge.wait()
        assert not is_closed(contact)
        while client.recv(64):
            pass


def test_a_recording_that_is_played_opens_the_contact_until_it_ends(scene):
    mine, contact, *_ = scene
    recorded, looks = mine.alerts[-2:], []
    player = mine.node.create_publisher(DiagnosticArray, "alerts", ALERTS)
    mine.keep_calm(lambda: not is_closed(contact), "the contact to open for a second publisher")

    def played():
        player.publish(recorded[len(looks) % len(recorded)])
        looks.append(is_closed(contact))
        return len(looks) >= 200

    mine.keep_calm(played, "the recording to end")
    assert not any(looks)
    mine.node.destroy_publisher(player)
    mine.keep_calm(lambda: is_closed(contact), "the contact to close when one program publishes again")


def test_alerts_are_repeated_at_the_stated_rate_with_rising_numbers(scene):
    mine = scene[0]
    before = len(mine.alerts)
    mine.spin(5.0 * HEARTBEAT)
    mine.wait(lambda: len(mine.alerts) >= before + 4, "four alerts, which a busy machine receives later")
    values = [{pair.key: pair.value for pair in array.status[0].values} for array in mine.alerts[before:]]
    numbers = [int(each["sequence"]) for each in values]
    assert numbers == sorted(set(numbers))
    stamps = [float(each["stamp"]) for each in values]
    late = {pair.key: float(pair.value) for pair in mine.health["rpf3d_simulator: executor"].values}["longest_gap_ms"]
    assert max(b - a for a, b in pairwise(stamps)) < DEADLINE + 1e-3 * late, "later than the node's own timers were"
    assert all(float(each["valid_until"]) > float(each["stamp"]) for each in values)
