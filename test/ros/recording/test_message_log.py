"""Tests of the event under which a message is recorded, of repeated messages, and of refused messages."""

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import Point, PointStamped, Pose, PoseArray
from messages import recorded_messages as made
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Bool

from rpf3d_ros.interface.recorded_topics import TOPICS
from rpf3d_ros.interface.transforms import FoundTransform, InputFrames
from rpf3d_ros.messages.cloud_messages import cloud_of_columns, cloud_of_grid
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_messages import trajectory_markers
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.terrain_messages import GridSurvey
from rpf3d_ros.recording.entries import EVENTS_KEPT, EventNumbers
from rpf3d_ros.recording.message_log import MessageLog
from rpf3d_ros.recording.terrain_entries import UPDATES_SHOWN

SECOND = made.SECOND
header = made.header


class Rows:
    """Stands in for a recording; keeps the name and the arguments of each method call in `calls`."""

    def __init__(self):
        self.calls = []

    def __getattr__(self, kind):
        return lambda *about: self.calls.append((kind, *about))


def rows(entries):
    """Return [(method, second of the stamp, event)] of all rows that entries draw."""
    found = []
    for entry in entries:
        drawn = Rows()
        entry.draw(drawn)
        found += [(call[0], entry.stamp_ns // SECOND, entry.event) for call in drawn.calls]
    return found


def calls(entries):
    drawn = Rows()
    for entry in entries:
        entry.draw(drawn)
    return drawn.calls


@pytest.fixture
def log():
    return MessageLog(MapFrame(), "map", lambda: 99 * SECOND)


def sources(log, second):
    return rows(log.entries("sources", PoseArray(header=header(second), poses=[Pose()])))


def results(log, second):
    """Return the rows of an answer, except those of the areas' outlines, whose time is that of their receipt."""
    answers = {topic: message for topic, message in made.answers(second).items() if topic != "areas/outlines"}
    return [row for topic, message in answers.items() for row in rows(log.entries(topic, message))]


def test_where_an_area_lies_holds_from_now_on_whatever_sources_the_answer_is_to(log):
    sources(log, 20)
    assert {row[1] for row in rows(log.entries("areas/outlines", made.areas(10)))} == {99}


def test_every_topic_that_is_subscribed_to_has_rows(log):
    messages = {topic: message for _, topic, message in made.shift()}
    messages["terrain/points"] = cloud_of_grid(header(1), GridSurvey(made.slope()))
    assert set(messages) == set(TOPICS)
    assert all(rows(log.entries(topic, message)) for topic, message in messages.items())


def test_a_terrain_of_scattered_points_is_recorded_as_the_triangles_between_them(log):
    corners = np.array([[0.0, 0.0, 5.0], [4.0, 0.0, 5.0], [4.0, 4.0, 5.0], [0.0, 4.0, 5.0]])
    cloud = cloud_of_columns(header(1), dict(zip("xyz", corners.T, strict=True)))
    ((kind, vertices, triangles),) = calls(log.entries("terrain/points", cloud))
    assert kind == "terrain" and len(triangles) == 2
    assert sorted(vertices.tolist()) == sorted(corners.tolist())
    assert rows(log.entries("terrain/points", cloud)) == [], "it is the same terrain"


def test_results_that_come_after_the_next_sources_belong_to_the_event_of_their_own(log):
    found = sources(log, 10) + sources(log, 20) + results(log, 10) + sources(log, 30) + results(log, 30)
    assert {row[1:] for row in found} == {(10, 1), (20, 2), (30, 3)}
    assert [row[1:] for row in found if row[0] == "grid"] == [(10, 1), (30, 3)]


def test_results_of_unknown_sources_are_one_new_event(log):
    found = sources(log, 10) + results(log, 5) + sources(log, 5)
    assert {row[1:] for row in found} == {(10, 1), (5, 2)}


def test_only_so_many_stamps_are_remembered():
    numbers = EventNumbers()
    assert [numbers.of(stamp) for stamp in range(EVENTS_KEPT + 1)] == list(range(1, EVENTS_KEPT + 2))
    assert numbers.of(1) == 2
    assert numbers.of(0) == EVENTS_KEPT + 2
    assert len(numbers._known) == EVENTS_KEPT


def test_an_array_without_markers_is_recorded_now(log):
    sources(log, 10)
    log.entries("hazard/zones", made.hazard(header(10), {"passed": np.zeros((1, 3, 3))}))
    empty = made.hazard(header(10), {})
    empty.markers = []
    assert rows(log.entries("hazard/zones", empty)) == [("clear_hazard", 99, 1)]


def test_a_terrain_is_recorded_again_when_it_is_another_or_a_patch_lay_on_it(log):
    mesh = made.mesh()
    assert [call[0] for call in calls(log.entries("terrain/mesh", mesh))] == ["terrain"]
    assert log.entries("terrain/mesh", mesh) == []
    (patch,) = log.entries("terrain/update", made.inputs(3)["terrain/update"])
    assert (patch.keeps, calls([patch])[0][1]) == ("terrain/updates/0", 0)
    assert len(log.entries("terrain/mesh", mesh)) == 1


def test_patches_are_numbered_until_the_oldest_is_replaced(log):
    patch = made.inputs(3)["terrain/update"]
    numbers = [calls(log.entries("terrain/update", patch))[0][1] for _ in range(UPDATES_SHOWN + 2)]
    assert numbers == [*range(UPDATES_SHOWN), 0, 1]


def test_sources_without_poses_are_recorded_for_they_say_that_nothing_was_seen(log):
    ((kind, positions, _),) = calls(log.entries("sources", PoseArray(header=header(4))))
    assert kind == "sources"
    assert positions.shape == (0, 3)


def test_a_cloud_of_sources_without_points_says_that_nothing_was_seen_too(log):
    ((kind, positions, directions),) = calls(log.entries("source_cloud", PointCloud2(header=header(4))))
    assert (kind, positions.shape, directions.shape) == ("sources", (0, 3), (0, 3))


def test_thrown_sources_of_a_cloud_point_where_they_fly(log):
    ((_, _, directions),) = calls(log.entries("source_cloud", made.inputs(4)["source_cloud"]))
    assert directions == pytest.approx(np.array([[0.0, 1.0, 0.0]] * 2))


def test_an_alert_is_a_number_every_time_and_words_when_it_changes(log):
    kinds = [[call[0] for call in calls(log.entries("alerts", made.alerts(second, "watch")))] for second in (1, 2)]
    assert kinds == [["alert", *["alert_state", "text"] * 2], ["alert"]]
    changed = calls(log.entries("alerts", made.alerts(3, "evacuate")))
    assert ("alert", 3) in changed
    assert [call for call in changed if call[0] == "alert_state"] == [
        ("alert_state", "site", "evacuate"), ("alert_state", "area/haul_ramp", "evacuate"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("told", "at_s"), [("1800000001000000000", 1_800_000_001), ("soon", 7), ("9" * 19, 7), ("9" * 5000, 7), ("", 7)]
)
def test_an_alert_stands_at_the_time_of_its_decision_not_of_the_sources_that_it_found_stale(log, told, at_s):
    array = made.alerts(7, "fault")
    array.status[0].values.append(KeyValue(key="decided_at_ns", value=told))
    assert {entry.stamp_ns for entry in log.entries("alerts", array)} == {at_s * 10**9}


def test_an_area_is_told_of_in_words_when_its_level_changes(log):
    for second in (1, 2):
        array = made.alerts(second, "watch")
        for status in array.status:
            status.message = f"watch: {second} of 100 rocks reached the area"
        drawn = calls(log.entries("alerts", array))
    assert [health.name for kind, *_, health in drawn if kind == "text"] == ["site"]
    array = made.alerts(3, "watch")
    array.status[1].values.append(KeyValue(key="held", value="restrict"))
    assert [health.name for kind, *_, health in calls(log.entries("alerts", array)) if kind == "text"] == [
        "site", "haul_ramp",
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["site", "alarm", " ", "level", "ramp "])
def test_no_area_takes_the_place_of_the_site(log, name):
    array = made.alerts(1, "evacuate", name)
    array.status[1].values[0].value = "normal"
    drawn = calls(log.entries("alerts", array))
    assert ("alert", 3) in drawn and ("alert", 0) not in drawn
    assert [call[1:] for call in drawn if call[0] == "alert_state"] == [
        ("site", "evacuate"), (f"area/{name}", "normal"),
    ]  # fmt: skip


def test_the_lane_of_an_area_ends_where_it_is_no_longer_told_of_and_begins_again(log):
    calls(log.entries("alerts", made.alerts(1, "watch")))
    array = made.alerts(2, "watch")
    del array.status[1]
    assert ("alert_state", "area/haul_ramp", None) in calls(log.entries("alerts", array))
    array.header.stamp.sec = 3
    assert not [call for call in calls(log.entries("alerts", array)) if call[0] == "alert_state"]
    assert ("alert_state", "area/haul_ramp", "watch") in calls(log.entries("alerts", made.alerts(4, "watch")))


def test_the_outline_of_an_area_is_drawn_when_it_changes_and_gone_when_it_is_told_of_no_more(log):
    drawn = calls(log.entries("areas/outlines", made.areas(1, "haul_ramp", "truck")))
    assert [(kind, name) for kind, name, *_ in drawn] == [("area_outline", "haul_ramp"), ("area_outline", "truck")]
    assert calls(log.entries("areas/outlines", made.areas(2, "haul_ramp", "truck"))) == []
    changed = calls(log.entries("areas/outlines", made.areas(3, "haul_ramp", raised=1.0)))
    assert [call[:2] for call in changed] == [("clear_area", "truck"), ("area_outline", "haul_ramp")]
    assert [call[:2] for call in calls(log.entries("areas/outlines", made.areas(4, "truck")))] == [
        ("clear_area", "haul_ramp"), ("area_outline", "truck"),
    ]  # fmt: skip


def test_an_alarm_that_is_repeated_is_recorded_once(log):
    states = [calls(log.entries("alarm", Bool(data=data))) for data in (False, False, True)]
    assert states == [[("alert_state", "alarm", "off")], [], [("alert_state", "alarm", "on")]]


def of_level(level):
    array = made.alerts(1, "watch")
    array.status[0].values[0].value = level
    return array


def without_site():
    array = made.alerts(1, "watch")
    array.status = array.status[1:]
    return array


def grid(**changes):
    message = made.grid(1)
    for name, value in changes.items():
        setattr(message.info if hasattr(message.info, name) else message, name, value)
    return message


def named(ns):
    array = made.hazard(header(1), {"passed": np.zeros((1, 3, 3))})
    array.markers[1].ns = ns
    return array


def outlined(ns):
    array = made.areas(1)
    array.markers[1].ns = ns
    return array


def points(**changes):
    return cloud_of_columns(header(1), {**made.falls(rocks=2, points=3), **changes})


REFUSED = {
    "alert_of_no_level": ("alerts", lambda: of_level("red"), "level 'red'"),
    "alert_of_no_site": ("alerts", without_site, "no status 'rpf3d: alert'"),
    "grid_shorter_than_it_says": ("hazard/grid", lambda: grid(width=7), "7 x 40 cells"),
    "grid_without_resolution": ("hazard/grid", lambda: grid(resolution=math.nan), "resolution"),
    "grid_beyond_100": ("hazard/grid", lambda: grid(data=[101] * made.SIDE**2), "beyond"),
    "grid_in_a_foreign_frame": ("hazard/grid", lambda: grid(header=header(1, "lidar")), "'lidar'"),
    "outline_of_no_area": ("areas/outlines", lambda: outlined("areas/"), "areas/<name>"),
    "outline_over_other_rows": ("areas/outlines", lambda: outlined("terrain"), "areas/<name>"),
    "hazard_of_no_level": ("hazard/zones", lambda: named("hazard/"), "hazard/<level>"),
    "hazard_over_other_rows": ("hazard/zones", lambda: named("terrain"), "hazard/<level>"),
    "times_that_go_back": ("trajectories/points", lambda: points(t=np.array([0.0, 2.0, 1.0] * 2)), "goes back"),
    "times_before_release": ("trajectories/points", lambda: points(t=np.full(6, -1.0)), "negative"),
    "point_that_is_not_finite": (
        "clicked_point", lambda: PointStamped(header=header(1), point=Point(x=math.inf)), "not finite",
    ),
    "missing_positions": (
        "impacts", lambda: points(x=np.array([math.nan] * 6)), "not finite",
    ),
    "trajectories_without_t": (
        "trajectories/points", lambda: cloud_of_columns(header(1), {n: np.zeros(2) for n in ("x", "y", "z", "energy")}),
        "field 't'",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_shown_is_refused_with_a_sentence(case, log):
    topic, message, sentence = REFUSED[case]
    with pytest.raises(MessageRefused, match=sentence):
        log.entries(topic, message())


def test_trajectories_without_rocks_are_recorded(log):
    nothing = {name: column[:0] for name, column in made.falls().items()}
    lines = made.markers(trajectory_markers(header(10), nothing, 9, 9))
    assert calls(log.entries("trajectories", lines)) == [("trajectories", [])]
    assert calls(log.entries("trajectories/points", cloud_of_columns(header(10), nothing)))[0][0] == "clear"


class Drone:
    """A provider of transforms that knows only the frame of a drone, turned by 180 degrees about the vertical."""

    height, stamp_ns = 10.0, None

    def lookup(self, target, source, stamp_ns):
        known = FoundTransform((0.0, 0.0, 1.0, 0.0), (0.0, 0.0, self.height), self.stamp_ns)
        return known if source == "drone" else "it is unknown"


def test_inputs_in_other_frames_are_recorded_in_the_map_frame():
    drone = Drone()
    log = MessageLog(MapFrame(), "drone", lambda: 99 * SECOND, frames=InputFrames(MapFrame(), drone))
    inputs = {**made.inputs(4), "clicked_point": PointStamped(header=header(4), point=Point(x=1.0))}
    for message in inputs.values():
        message.header.frame_id = "drone"
    ((_, positions, directions),) = calls(log.entries("source_cloud", inputs["source_cloud"]))
    in_map = MessageLog(MapFrame(), "map", lambda: 0)
    ((_, there, _),) = calls(in_map.entries("source_cloud", made.inputs(4)["source_cloud"]))
    assert positions == pytest.approx(there * (-1.0, -1.0, 1.0) + (0.0, 0.0, 10.0))
    assert directions == pytest.approx(np.array([[0.0, -1.0, 0.0]] * 2))
    ((_, clicked, _),) = calls(log.entries("clicked_point", inputs["clicked_point"]))
    assert clicked == pytest.approx(np.array([[-1.0, 0.0, 10.0]]))
    for topic, message in inputs.items():
        assert rows(log.entries(topic, message)), topic
    inputs["sources"].header.frame_id = "radar"
    with pytest.raises(MessageRefused, match="no transform to 'map': it is unknown"):
        log.entries("sources", inputs["sources"])


def test_a_mesh_whose_frame_was_surveyed_again_is_recorded_again():
    drone, mesh = Drone(), made.mesh()
    log = MessageLog(MapFrame(), "drone", lambda: 99 * SECOND, frames=InputFrames(MapFrame(), drone))
    assert [len(log.entries("terrain/mesh", mesh)) for _ in range(2)] == [1, 0]
    drone.height = 11.0
    assert [len(log.entries("terrain/mesh", mesh)) for _ in range(2)] == [1, 0]


def test_equipment_is_recorded_whatever_its_orientation_because_the_simulator_uses_its_place_alone():
    poses = made.inputs(4)["areas/equipment"]
    log = MessageLog(MapFrame(), poses.header.frame_id, lambda: 4 * SECOND)
    for pose in poses.poses:
        pose.orientation.w = 7.0
    assert len(log.entries("areas/equipment", poses)) == 1
    poses.poses[0].position.z = float("nan")
    with pytest.raises(MessageRefused, match="not finite"):
        log.entries("areas/equipment", poses)


def test_a_mesh_and_areas_in_a_moving_frame_are_not_recorded():
    drone, inputs = Drone(), made.inputs(4)
    drone.stamp_ns = 4 * SECOND
    log = MessageLog(MapFrame(), "drone", lambda: 4 * SECOND, frames=InputFrames(MapFrame(), drone, 1.0))
    with pytest.raises(MessageRefused, match="frame 'drone' moves: a mesh has no stamp"):
        log.entries("terrain/mesh", made.mesh())
    for topic in ("areas/polygon", "areas/equipment"):
        inputs[topic].header.frame_id = "drone"
        with pytest.raises(MessageRefused, match="frame 'drone' moves: an area stays"):
            log.entries(topic, inputs[topic])
