"""Tests of simulator processes whose inputs are in other frames, with a stand-in for tf2_ros: no wheel contains it."""

import importlib.util
import os
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from messages.live_peer import ON_THE_SLOPE, SECOND, TOE, cloud, header, long_ramp, polygon, poses, ramp, with_alerts
from rclpy.qos import DurabilityPolicy, QoSProfile

from rpf3d_ros.messages.health import ERROR
from rpf3d_ros.nodes.node_process import BAD_INPUT

STAND_IN = Path(__file__).parents[2] / "support" / "stand_in_tf2"
OLDEST = 2.0
"""Largest age (s) of a transform."""

SHIFT = np.array([30.0, -20.0, 5.0])
"""Origin (m) of the radar in the map frame; its x axis points north."""

HARMLESS = (57.0, 55.0, 1.0)
"""A place (m) on the floor, from which no rock reaches an area."""

BESIDE = ((50.0, 2.0), (58.0, 2.0), (58.0, 8.0), (50.0, 8.0))
"""Corners (m) of an area that no rock from the slope reaches."""

HALF = float(np.sqrt(0.5))
TURNED, STILL = (0.0, 0.0, HALF, HALF), (0.0, 0.0, 0.0, 1.0)
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def transform(child, turn, shift, stamp_ns=0):
    """Return a TransformStamped from the frame `child` into the map frame.

    turn : quaternion x, y, z, w; shift : origin (m) of `child` in the map frame
    """
    (x, y, z, w), (e, n, h) = turn, np.asarray(shift).tolist()
    parts = Transform(rotation=Quaternion(x=x, y=y, z=z, w=w), translation=Vector3(x=e, y=n, z=h))
    return TransformStamped(header=header(stamp_ns), child_frame_id=child, transform=parts)


def seen_by_radar(place, shift=SHIFT):
    """Return the coordinates (m) in the radar's frame of a place (m) in the map frame; shift : the radar's origin."""
    east, north, up = np.subtract(place, shift).tolist()
    return north, -east, up


class Surveyor:
    """Publishes transforms for a peer."""

    def __init__(self, peer):
        self.peer = peer
        self.static = peer.node.create_publisher(TransformStamped, "/tf_static", LATCHED)
        self.dynamic = peer.node.create_publisher(TransformStamped, "/tf", 100)

    def survey(self, child, turn, shift):
        self.static.publish(transform(child, turn, shift))

    def drive(self, child, turn, shift, stamp_ns):
        self.dynamic.publish(transform(child, turn, shift, stamp_ns))

    def wait_until_received(self):
        for publisher in (self.static, self.dynamic):
            self.peer.wait(publisher.get_subscription_count, f"a subscriber of {publisher.topic_name}")


@pytest.fixture(scope="module")
def with_stand_in():
    """Let the nodes of this file import the stand-in of tf2_ros."""
    if importlib.util.find_spec("tf2_ros"):
        pytest.skip("tf2_ros is installed: its topics carry tf2_msgs, which these tests do not publish")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(STAND_IN), prepend=os.pathsep)
        yield


@pytest.fixture(scope="module")
def mine(shared_stage, with_stand_in):
    """A peer and a surveyor of one simulator; the survey is in the frame of a drone."""
    process = shared_stage.node(
        "simulator_node", use_tf=True, transforms_max_age_s=OLDEST, **with_alerts(shared_stage.folder)
    )
    peer = shared_stage.live_peer()
    surveyor = Surveyor(peer)
    surveyor.survey("drone", STILL, (0.0, 0.0, -100.0))
    surveyor.survey("radar", TURNED, SHIFT)
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    surveyor.wait_until_received()
    peer.send("terrain/points", cloud(long_ramp() + np.array([0.0, 0.0, 100.0]), peer.now(), "drone"))
    peer.send("areas/polygon", polygon(BESIDE, peer.now()))
    yield peer, surveyor
    assert process.poll() is None, "the simulator has died"


def see(peer, frame, *places, stamp_ns=None):
    """Publish sources in a frame; return their stamp (ns)."""
    stamp_ns = stamp_ns or peer.now()
    peer.send("sources", poses(places, stamp_ns, frame))
    return stamp_ns


def newest(peer):
    """Return the sentence of the newest alert."""
    return peer.alerts[-1].status[0].message if peer.alerts else ""


def wait_for_level(peer, level):
    peer.wait(lambda: newest(peer).startswith(f"{level}: "), f"{level} in the newest alert, not {newest(peer)!r}")


def wait_for_fault(peer, reason):
    peer.wait(lambda: newest(peer).startswith("fault: ") and reason in newest(peer), f"a fault with {reason!r}")


def see_until_fault(peer, frame, reason):
    """Publish sources in a frame until a fault names `reason`: repeatedly, because a transform may arrive later."""

    def is_told():
        see(peer, frame, (0.0, 0.0, 0.0))
        peer.spin(0.3)
        return newest(peer).startswith("fault: ") and reason in newest(peer)

    peer.wait(is_told, f"a fault with {reason!r}")


def seen_until_received(peer, frame, *places, before_each=lambda: None):
    """Publish sources in a frame repeatedly until they are answered; return the values of the answer."""
    before = len(peer.results)

    def are_answered():
        before_each()
        see(peer, frame, *places)
        peer.spin(0.3)
        return len(peer.results) > before

    peer.wait(are_answered, f"an answer to sources in {frame}")
    return peer.answer_values()


def test_sources_in_the_frame_of_a_radar_are_answered_over_a_survey_in_the_frame_of_a_drone(mine):
    peer, _ = mine
    before = len(peer.alerts)
    assert seen_until_received(peer, "radar", seen_by_radar(HARMLESS))["sources"] == "1"
    peer.acknowledge_refusals(before)  # the first message may have arrived before its transform
    wait_for_level(peer, "normal")


def test_a_frame_that_tf_does_not_know_is_a_fault_until_it_does(mine):
    peer, surveyor = mine
    see(peer, "lidar", (0.0, 0.0, 0.0))
    wait_for_fault(peer, "frame_id is 'lidar', and there is no transform to 'map'")
    surveyor.survey("lidar", STILL, HARMLESS)
    before = len(peer.alerts)
    seen_until_received(peer, "lidar", (0.0, 0.0, 0.0))
    peer.acknowledge_refusals(before)
    wait_for_level(peer, "normal")


def test_a_transform_that_is_too_old_at_the_stamp_is_a_fault_until_a_younger_one_is_received(mine):
    peer, surveyor = mine
    surveyor.drive("truck", STILL, HARMLESS, peer.now() - round(2 * OLDEST * SECOND))
    see_until_fault(peer, "truck", "is more than 2 s older than the message (transforms_max_age_s)")
    drive = lambda: surveyor.drive("truck", STILL, HARMLESS, peer.now())  # noqa: E731
    before = len(peer.alerts)
    seen_until_received(peer, "truck", (0.0, 0.0, 0.0), before_each=drive)
    peer.acknowledge_refusals(before)
    wait_for_level(peer, "normal")


def test_a_transform_that_is_no_rotation_is_a_fault(mine):
    peer, surveyor = mine
    surveyor.survey("bent", (0.0, 0.0, 0.0, 0.5), HARMLESS)
    see_until_fault(peer, "bent", "is not a rotation: its quaternion has length 0.5, not 1")
    before = len(peer.alerts)
    see(peer, "radar", seen_by_radar(HARMLESS))
    peer.acknowledge_refusals(before)
    wait_for_level(peer, "normal")


def test_areas_patches_and_machines_in_other_frames_are_used(mine):
    peer, _ = mine
    sources = lambda: peer.health.get("rpf3d_simulator: sources")  # noqa: E731
    peer.wait(lambda: not sources() or "refused" not in sources().message, "the refusals of the tests before to end")
    before = len(peer.said)
    peer.send("areas/equipment", poses([seen_by_radar((55.0, 55.0, 0.0))], peer.now(), "radar"))
    peer.wait(lambda: area_topic(peer) == "areas/equipment", "the machines")
    peer.send("areas/polygon", polygon([seen_by_radar((*corner, 0.0))[:2] for corner in TOE], peer.now(), "radar"))
    peer.wait(lambda: area_topic(peer) == "areas/polygon", "the area")
    peer.send("terrain/update", cloud(ramp(-100.0)[:5, :5], peer.now(), "drone"))
    peer.wait_for_sentence("patch received", before)
    assert not any("refused" in said.message for said in peer.said[before:])


def area_topic(peer):
    """Return the topic of the last area according to the diagnostics; None before the first area."""
    status = peer.health.get("rpf3d_simulator: areas")
    return {pair.key: pair.value for pair in status.values}.get("topic") if status else None


def test_danger_that_a_radar_reports_in_its_own_frame_raises_the_level_at_its_place(mine):
    """This test must be the last: it needs the area of the previous test, and the level stays held."""
    peer, _ = mine
    see(peer, "radar", seen_by_radar(ON_THE_SLOPE))
    wait_for_level(peer, "evacuate")
    values = {pair.key: pair.value for pair in peer.alerts[-1].status[1].values}
    place = [float(number) for number in values["cause_place"].split()]
    assert np.abs(np.subtract(place, ON_THE_SLOPE)[:2]).max() < 2.0, "the rocks start within position_spread"


def test_a_latched_survey_that_arrives_before_its_transform_is_used(stage, with_stand_in):
    latched = stage.peer(publishes=("terrain/points",))
    now = round(time.time() * SECOND)
    latched.send("terrain/points", cloud(ramp(), now, "drone"))
    surveyor = Surveyor(latched)  # found while the node compiles: later a survey waits only some seconds
    stage.node("simulator_node", use_tf=True, terrain_durability="transient_local", **with_alerts(stage.folder))
    surveyor.wait_until_received()
    lifecycle = lambda: latched.health.get("rpf3d_simulator: lifecycle")  # noqa: E731
    latched.wait(lambda: lifecycle() and lifecycle().message == "active", "the node to be active")
    surveyor.survey("drone", STILL, (0.0, 0.0, 0.0))
    assert latched.wait_for_health("rpf3d_simulator: terrain", "received").values["triangles"] == "7200"


def test_a_recorder_records_sources_in_the_frame_of_a_radar(stage, with_stand_in):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    stage.node("recorder_node", use_tf=True, file=stage.folder / "shift.rrd")
    peer = stage.live_peer()
    surveyor = Surveyor(peer)
    surveyor.wait_until_received()
    surveyor.survey("radar", TURNED, SHIFT)
    peer.wait(lambda: "rpf3d_recorder: recording" in peer.health, "the recorder")

    def is_recorded():
        see(peer, "radar", seen_by_radar(HARMLESS))
        peer.spin(0.3)
        counts = {pair.key: int(pair.value) for pair in peer.health["rpf3d_recorder: recording"].values}
        return counts.get("sources", 0) >= 1

    peer.wait(is_recorded, "sources in the recording")


def test_without_tf2_a_recorder_that_is_to_use_it_ends_with_the_reason(stage, monkeypatch):
    if importlib.util.find_spec("tf2_ros"):
        pytest.skip("tf2_ros is installed")
    monkeypatch.delenv("PYTHONPATH", raising=False)
    process = stage.node("recorder_node", use_tf=True, file=stage.folder / "shift.rrd")
    assert process.wait(timeout=120.0) == BAD_INPUT
    assert "use_tf is true, but tf2_ros cannot be imported" in stage.output("recorder_node")


def test_without_tf2_a_node_that_is_to_use_it_says_what_is_missing(stage, monkeypatch):
    if importlib.util.find_spec("tf2_ros"):
        pytest.skip("tf2_ros is installed")
    monkeypatch.delenv("PYTHONPATH", raising=False)
    peer = stage.peer()
    stage.node("simulator_node", use_tf=True)
    said = peer.wait_for_health("rpf3d_simulator: lifecycle", "not configured: use_tf is true, but tf2_ros cannot be")
    assert said.level == ERROR and "tf2_ros_py" in said.message
