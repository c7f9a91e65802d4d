"""Tests that a message that is overwritten before the simulator reads it is a fault."""

import signal
import time

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import PoseArray
from messages.live_peer import ON_THE_SLOPE, cloud, poses, ramp, with_alerts
from rclpy.qos import QoSProfile
from sensor_msgs.msg import PointCloud2

from rpf3d_ros.messages.stamps import stamp_of

DEEP = QoSProfile(depth=1000)
"""Quality of service of a publisher with a queue deep enough that it overwrites no message in most tests."""

HARMLESS = (57.0, 55.0, 1.0)
"""Place (m) of a source on the floor, in another region than the slope."""

OLDEST = 6
"""Age (s) from which on sources are stale."""

EVERY = 0.3
"""Time (s) between two messages of a sensor that publishes regularly."""


@pytest.fixture
def mine(stage):
    """Return a peer of a simulator whose level is `normal`; the simulator's process is `mine.process`."""
    peer = stage.live_peer()
    for topic, kind in (("sources", PoseArray), ("terrain/update", PointCloud2)):
        peer.node.destroy_publisher(peer.publishers[topic])
        peer.publishers[topic] = peer.node.create_publisher(kind, topic, DEEP)
    peer.node.destroy_publisher(peer.publishers.pop("source_cloud"))  # otherwise it is a sensor that says nothing
    peer.process = stage.node("simulator_node", **with_alerts(stage.folder, oldest=OLDEST))
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    peer.stand_on_ramp()
    peer.watch_toe()
    see_until(peer, lambda: newest(peer).startswith("normal: "), "the level normal")
    return peer


def see_until(peer, found, what):
    """Publish the harmless source repeatedly until `found()` is true; return this value. what : for a failure."""
    sent = [0.0]

    def look():
        if time.monotonic() - sent[0] > EVERY:
            peer.send("sources", poses([HARMLESS], peer.now()))
            sent[0] = time.monotonic()
        return found()

    return peer.wait(look, what)


def newest(peer):
    """Return the sentence of the newest alert, "" before the first alert."""
    return peer.alerts[-1].status[0].message if peer.alerts else ""


def test_of_many_messages_without_a_pause_the_first_is_decided_on(mine):
    stamp = mine.now()
    mine.send("sources", poses([ON_THE_SLOPE], stamp))
    for _ in range(200):
        mine.send("sources", poses([HARMLESS], stamp))
    mine.wait_for_alert("evacuate")


def test_sources_that_were_overwritten_are_a_fault_until_they_would_be_too_old(mine):
    before = len(mine.alerts)
    mine.process.send_signal(signal.SIGSTOP)
    for _ in range(3 * DEEP.depth):
        mine.send("sources", poses([HARMLESS], mine.now()))
    mine.process.send_signal(signal.SIGCONT)
    mine.wait_for_alert("fault", before, "messages on sources were lost")
    mine.wait_for_sentence("messages on sources were lost before they could be read")
    see_until(mine, lambda: newest(mine).startswith("normal: "), "the fault to end")


def test_a_driver_that_is_started_while_the_former_one_publishes_is_no_loss(mine):
    former, before = mine.publishers["sources"], len(mine.alerts)
    later = mine.node.create_publisher(PoseArray, "sources", DEEP)
    mine.wait(later.get_subscription_count, "the simulator to receive the second publisher")
    for _ in range(10):
        for publisher in (former, later):
            stamp = mine.now()
            publisher.publish(poses([HARMLESS], stamp))
            mine.spin(0.05)
    mine.wait(lambda: mine.alerts[-1].header.stamp == stamp_of(stamp), "the alert on the last message")
    sentences = [array.status[0].message for array in mine.alerts[before:]]
    assert not any("were lost" in sentence for sentence in sentences), sentences


def test_patches_that_were_overwritten_are_missing_until_the_next_whole_survey(mine):
    mine.process.send_signal(signal.SIGSTOP)
    for _ in range(300):
        mine.send("terrain/update", cloud(ramp()[:5, :5], mine.now()))
    mine.process.send_signal(signal.SIGCONT)
    see_until(mine, lambda: "patches are not in the terrain" in newest(mine), "the fault of the patches")
    mine.stand_on_ramp()
    see_until(mine, lambda: newest(mine).startswith("normal: "), "the fault to end")
