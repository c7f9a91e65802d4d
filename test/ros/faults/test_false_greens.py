"""Tests that inputs that are not fresh, complete and unambiguous give the level `fault`, never `normal`."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import PoseArray
from messages.live_peer import ON_THE_SLOPE, SECOND, cloud, long_ramp, polygon, poses, ramp, with_alerts
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Bool

from rpf3d_ros.interface.qos import EVENTS
from rpf3d_ros.messages.health import ERROR, WARN
from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import MeshSurvey, cdr_of_mesh

OVERLAP = 1.0
"""Time (s) for which two publishers of one topic are only a warning."""

HOUR = 3600 * SECOND
"""A duration (ns): a stamp this far in the past is older than all messages of this file."""

RADAR_B = "radar_b/sources"
LATE = 100_000 * SECOND


def calm(peer):
    """Bring the simulator to the level `normal`: publish terrain, an area and empty sources.

    Return the number of alerts until then.
    """
    before = len(peer.alerts)
    peer.stand_on_ramp()
    peer.watch_toe()
    peer.send("sources", poses([], peer.now()))
    peer.acknowledge_refusals(before)
    peer.wait_for_alert("normal", before)
    return len(peer.alerts)


@pytest.fixture(scope="module")
def mine(shared_stage):
    """Yield a peer of one simulator for all tests of this file."""
    process = shared_stage.node(
        "simulator_node", publisher_overlap=OVERLAP, source_topics=f"[sources, {RADAR_B}]",
        optional_topics=f"[{RADAR_B}]",
        **with_alerts(shared_stage.folder),
    )  # fmt: skip
    peer = shared_stage.live_peer()
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    yield peer
    assert process.poll() is None, "the simulator has died"


def stand_on(peer, points):
    """Publish a terrain; wait until the simulator uses it for its answers to empty sources."""
    digest = peer.answered([])["terrain_digest"]
    peer.send("terrain/points", cloud(points, peer.now()))
    peer.wait(lambda: peer.answered([])["terrain_digest"] != digest, "the new terrain")


def strip_of_holes():
    points = ramp()
    points[:, 40:42] = np.nan
    return points


def upside_down():
    mesh = grid_mesh(ramp())
    return cdr_of_mesh(MeshSurvey(mesh.vertices, mesh.triangles[:, ::-1]))


WALLS = [(10.0, 5.0 + 7.0 * number, 32.0) for number in range(6)]
"""Places (m) of sources on six walls of the slope; the first wall lies above the first metres of the toe."""

MESSAGES = {
    "sources in a foreign frame": (
        lambda peer: peer.send("sources", poses([ON_THE_SLOPE], peer.now(), "radar")), "frame_id is 'radar'"),
    "a pose that is not finite": (
        lambda peer: peer.send("sources", poses([ON_THE_SLOPE, (np.nan, 1.0, 1.0)], peer.now())), "not finite"),
    "sources with an older stamp": (
        lambda peer: peer.send("sources", poses([ON_THE_SLOPE], peer.now() - HOUR)), "older than the last message"),
    "a patch in a foreign frame": (
        lambda peer: peer.send("terrain/update", cloud(ramp()[:5, :5], peer.now(), "drone")), "patches are not in the"),
    "a survey in a foreign frame": (
        lambda peer: peer.send("terrain/points", cloud(ramp(), peer.now(), "drone")), "a survey was refused"),
    "a mesh that faces down": (lambda peer: peer.send("terrain/mesh", upside_down()), "facets face down"),
}  # fmt: skip


@pytest.mark.parametrize("name", MESSAGES)
def test_what_was_not_understood_is_a_fault_until_it_is(mine, name):
    send, sentence = MESSAGES[name]
    before = calm(mine)
    send(mine)
    mine.wait_for_alert("fault", before, sentence)
    calm(mine)


def test_an_area_in_large_single_precision_coordinates_is_a_fault(mine):
    before = calm(mine)
    mine.send("areas/polygon", polygon([(450_000.0, 5.4e6), (450_010.0, 5.4e6), (450_010.0, 5.5e6)], mine.now()))
    mine.wait_for_alert("fault", before, "lost centimetres")
    calm(mine)


def test_a_cloud_of_nothing_but_nan_is_not_nothing_seen(mine):
    before = calm(mine)
    message = cloud(np.full((20, 3), np.nan), mine.now())
    message.is_dense = False
    mine.send("source_cloud", message)
    mine.wait_for_alert("fault", before, "publish a cloud without points")
    mine.send("source_cloud", cloud(np.empty((0, 3)), mine.now()))
    calm(mine)


def test_a_survey_with_a_strip_of_holes_before_the_area_is_a_fault(mine):
    before = calm(mine)
    stand_on(mine, strip_of_holes())
    mine.answered()
    mine.wait_for_alert("fault", before, "rocks left the terrain, over its edge or into a hole, and may reach the area")
    calm(mine)


def test_a_survey_that_ends_before_the_area_is_a_fault_though_nothing_is_seen(mine):
    before = calm(mine)
    mine.send("terrain/points", cloud(ramp()[:, :38], mine.now()))
    mine.wait_for_alert("fault", before, "has no terrain")
    calm(mine)


def test_terrain_with_z_down_is_a_fault_as_soon_as_a_source_is_seen(mine):
    before = calm(mine)
    points = ramp()
    points[..., 2] *= -1.0
    stand_on(mine, points)
    mine.answered()
    mine.wait_for_alert("fault", before, "z points up")
    calm(mine)


def test_a_best_effort_publisher_is_a_fault_that_names_it(mine):
    before = calm(mine)
    publisher = mine.node.create_publisher(PointCloud2, "source_cloud", qos_profile_sensor_data)
    told = mine.wait_for_alert("fault", before, "source_cloud: messages from /mine cannot be received").message
    assert "Best effort publisher" in told
    mine.wait(
        lambda: (said := mine.health.get("rpf3d_simulator: inputs")) and said.level[0] == ERROR,
        "the fault in the diagnostics, which may come after the alert",
    )
    mine.node.destroy_publisher(publisher)
    mine.wait_for_alert("normal", len(mine.alerts))


@pytest.mark.parametrize(("topic", "kind", "sentence"), [
    ("sources", PoseArray, "sources has 2 publishers (/mine, /mine)"),
    ("terrain/points", PointCloud2, "terrain/points has 2 publishers (/mine, /mine)"),
    ("alarm", Bool, "2 programs publish alarm (/mine, /rpf3d_simulator)"),
])  # fmt: skip
def test_two_publishers_of_one_topic_are_a_fault(mine, topic, kind, sentence):
    before = calm(mine)
    publisher = mine.node.create_publisher(kind, topic, EVENTS)
    mine.wait_for_alert("fault", before, sentence)
    mine.node.destroy_publisher(publisher)
    mine.wait_for_alert("normal", len(mine.alerts))


def test_a_radar_that_is_not_listed_is_a_warning(mine):
    calm(mine)
    publisher = mine.node.create_publisher(PoseArray, "radar_c/sources", EVENTS)
    sentence = "/radar_c/sources of /mine is not received: if it is a sensor, add it to source_topics"
    inputs = "rpf3d_simulator: inputs"
    mine.wait(lambda: (said := mine.health.get(inputs)) and sentence in said.message, "the warning")
    assert mine.health[inputs].level[0] == WARN
    mine.node.destroy_publisher(publisher)
    mine.wait(lambda: sentence not in mine.health[inputs].message, "the end of the warning")


def test_nothing_seen_by_one_sensor_clears_nothing_that_another_saw_and_harmless_sources_dilute_none(mine):
    before = calm(mine)
    mine.publishers[RADAR_B] = mine.node.create_publisher(PoseArray, RADAR_B, EVENTS)
    mine.wait(lambda: mine.publishers[RADAR_B].get_subscription_count(), f"a subscriber of {RADAR_B}")
    harmless = [(57.0, 2.0 + 1.4 * i, 1.0) for i in range(40)]
    stamp = mine.now()
    mine.send(RADAR_B, poses([*harmless, ON_THE_SLOPE], stamp))
    assert "clusters of sources" in mine.wait_for_alert("evacuate", before, "the worst of").message
    mine.wait(lambda: value(mine, "cause") == "sources", "the cause")
    place = [float(number) for number in value(mine, "cause_place").split()]
    assert value(mine, "cause_topic") == RADAR_B and np.hypot(*np.subtract(place, ON_THE_SLOPE)[:2]) <= 15.0
    since = value(mine, "not_normal_since_ns")
    mine.wait_for_answer(stamp)
    mine.answered([])
    assert evident(mine) == "evacuate"
    mine.send(RADAR_B, poses([], mine.now()))
    mine.wait(lambda: evident(mine) == "normal", "radar B to see nothing")
    assert (value(mine, "cause_topic"), value(mine, "not_normal_since_ns")) == (RADAR_B, since), "the level is held"


def evident(peer):
    """Return the alert level of the area by the newest evidence alone."""
    return value(peer, "evident")


def value(peer, key):
    """Return the value of a key of the area in the newest alert."""
    return next(pair.value for pair in peer.alerts[-1].status[1].values if pair.key == key)


def test_an_area_that_was_moved_is_a_fault_until_every_wall_is_answered_for_its_new_place(stage):
    """The node keeps the sources of four walls: after the move it answers for the last of the six, not the first."""
    stage.node("simulator_node", waiting_sources=1, region_size=5.0, **with_alerts(stage.folder))
    peer = stage.live_peer()
    peer.wait_for_simulator()
    peer.send("terrain/points", cloud(long_ramp(), peer.now()))
    peer.send("areas/polygon", polygon(((42.0, 50.0), (52.0, 50.0), (52.0, 58.0), (42.0, 58.0)), peer.now()))
    for wall in WALLS:
        peer.answered([wall])
    newest = lambda: peer.alerts[-1].status[0].message if peer.alerts else ""  # noqa: E731
    peer.wait(lambda: newest().startswith("normal: "), "the level normal")
    before = len(peer.alerts)
    peer.send("areas/polygon", polygon(((42.0, 2.0), (52.0, 2.0), (52.0, 8.0), (42.0, 8.0)), peer.now()))
    peer.wait_for_alert("fault", before, "live_area: the area moved")
    for wall in WALLS:
        peer.answered([wall])
    peer.wait(lambda: newest().startswith("evacuate: ") and "moved" not in newest(), "evacuate without a fault")


def test_a_clock_that_stands_still_is_a_fault_until_it_runs_again(stage):
    stage.node("simulator_node", use_sim_time=True, clock_patience=1.0, **with_alerts(stage.folder))
    peer = stage.live_peer(clock=True)
    peer.run_clock(LATE)
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    before = calm(peer)
    stands = peer.now()
    peer._clock = lambda: stands
    peer.wait_for_alert("fault", before, "the clock stands still")
    peer.wait(lambda: peer.alarms[-1], "the alarm")
    before = len(peer.alerts)
    peer.run_clock(stands)
    peer.wait_for_alert("normal", before)
