"""Tests of trajectories and hazard zones <-> MarkerArray."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import Point, Pose, Quaternion
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from rpf3d_core.ensemble.colours import speed_colours
from rpf3d_core.ensemble.paths import evenly
from rpf3d_core.live.zones import ShownZone
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_messages import area_markers, trajectory_markers, zone_markers
from rpf3d_ros.messages.marker_reading import facets_of_markers, outlines_of_markers, strips_of_markers
from rpf3d_ros.messages.refusals import MessageRefused

HEADER = Header(frame_id="map")
MAP = MapFrame()
SURVEY = MapFrame(survey="utm", origin=(5e5, 4.5e6, 100.0))


def columns(rocks=3, points=5):
    """Return trajectory columns, name -> (rocks * points,), for rocks with the same number of points each."""
    rock = np.repeat(np.arange(rocks), points)
    along = np.tile(np.arange(points, dtype=float), rocks)
    return {"x": along, "y": rock.astype(float), "z": -along, "rock": rock, "speed": along}


def sent(data):
    """Return the MarkerArray that a subscriber receives if `data`, bytes or a message, is published."""
    whole = data if isinstance(data, bytes) else serialize_message(data)
    return deserialize_message(whole, MarkerArray)


def zone(name="0.1", facets=2, edges=0):
    """Return a zone with n facets and n edges whose coordinates all differ."""
    corners = np.arange(9.0 * facets).reshape(facets, 3, 3)
    return ShownZone(name, corners, 100.0 + np.arange(6.0 * edges).reshape(edges, 2, 3))


def test_every_rock_is_one_line_in_order():
    strips = strips_of_markers(sent(trajectory_markers(HEADER, columns(), 200, 50)), MAP)
    assert [strip.points[0, 1] for strip in strips] == [0.0, 1.0, 2.0]
    assert np.array_equal(strips[1].points, np.stack([np.arange(5), np.ones(5), -np.arange(5)], axis=-1))


def test_many_rocks_and_points_are_thinned_and_keep_their_ends():
    strips = strips_of_markers(sent(trajectory_markers(HEADER, columns(rocks=30, points=100), 7, 10)), MAP)
    assert len(strips) == 7
    assert all(len(points) == 10 and points[0, 0] == 0.0 and points[-1, 0] == 99.0 for points, _ in strips)
    assert (strips[0].points[0, 1], strips[-1].points[0, 1]) == (0.0, 29.0)


def test_the_rings_of_an_area_are_lines_in_its_namespace():
    rings = {"haul_ramp": [np.arange(12.0).reshape(4, 3), np.arange(9.0).reshape(3, 3)], "off the ground": []}
    array = sent(area_markers(HEADER, rings, 7))
    assert array.markers[0].action == Marker.DELETEALL
    assert [(marker.ns, marker.id, marker.text) for marker in array.markers[1:]] == [
        ("areas/haul_ramp", 0, "result 7"), ("areas/haul_ramp", 1, "result 7"),
    ]  # fmt: skip
    lines, _ = outlines_of_markers(array, MAP)["areas/haul_ramp"]
    assert all(np.array_equal(line, ring) for line, ring in zip(lines, rings["haul_ramp"], strict=True))


def test_a_trajectory_is_coloured_by_its_speed():
    (strip, *_) = strips_of_markers(sent(trajectory_markers(HEADER, columns(), 200, 50)), MAP)
    assert np.array_equal(strip.colours[:, :3], speed_colours(np.arange(5), 4.0))
    assert (strip.colours[:, 3] == 255).all()


def test_no_rocks_make_an_array_that_clears_the_screen():
    array = sent(trajectory_markers(HEADER, columns(rocks=0), 200, 50))
    assert [marker.action for marker in array.markers] == [Marker.DELETEALL]


@pytest.mark.parametrize(("count", "most"), [(1, 2), (2, 2), (3, 2), (10, 4), (50, 50), (1000, 7)])
def test_evenly_spread_indices_keep_first_and_last_and_no_more_than_asked(count, most):
    indices = evenly(count, most)
    assert (indices[0], indices[-1], len(indices)) == (0, count - 1, min(count, most))


def test_markers_are_what_rviz_accepts():
    arrays = [
        sent(trajectory_markers(HEADER, columns(), 200, 50)),
        sent(zone_markers(HEADER, [zone("0.01", 2, 3), zone("0.5", 1, 2)])),
    ]
    for array in arrays:
        assert array.markers[0].action == Marker.DELETEALL
        identities = [(marker.ns, marker.id) for marker in array.markers[1:]]
        assert len(set(identities)) == len(identities) > 0
        for marker in array.markers[1:]:
            assert marker.pose.orientation.w == 1.0
            assert marker.scale.x > 0.0
            assert marker.color.a > 0.0
            assert marker.header.frame_id == "map"
            assert len(marker.colors) in (0, len(marker.points))


def test_hazard_facets_come_back_under_the_name_of_their_level():
    zones = [zone("0.01", 2), zone("0.5", 1)]
    found = facets_of_markers(sent(zone_markers(HEADER, zones)), MAP)
    assert list(found) == ["hazard/0.01", "hazard/0.5"]
    assert all(np.array_equal(found[f"hazard/{each.name}"][0], each.corners) for each in zones)


def test_an_outline_is_a_line_list_beside_its_facets():
    _, facets, outline = sent(zone_markers(HEADER, [zone("0.1", 1, 2)], result=7)).markers
    assert (facets.ns, facets.id, facets.type) == ("hazard/0.1", 0, Marker.TRIANGLE_LIST)
    assert (outline.ns, outline.id, outline.type) == ("hazard/0.1", 1, Marker.LINE_LIST)
    assert [[p.x, p.y, p.z] for p in outline.points] == (100.0 + np.arange(12.0).reshape(4, 3)).tolist()


def test_every_marker_says_which_result_it_belongs_to():
    for data in (trajectory_markers(HEADER, columns(), 9, 9, 7), zone_markers(HEADER, [zone(edges=1)], 7)):
        assert {marker.text for marker in sent(data).markers[1:]} == {"result 7"}


def test_a_level_without_facets_has_no_marker():
    assert len(sent(zone_markers(HEADER, [zone(facets=0)])).markers) == 1


def test_a_triangle_list_that_is_not_of_triangles_is_refused():
    marker = Marker(header=HEADER, ns="hazard/passed", type=Marker.TRIANGLE_LIST, points=[Point()] * 4)
    with pytest.raises(MessageRefused, match="4 points; a triangle needs three"):
        facets_of_markers(MarkerArray(markers=[marker]), MAP)


def test_marker_points_that_are_not_finite_are_refused():
    marker = Marker(header=HEADER, ns="trajectories", id=3, type=Marker.LINE_STRIP, points=[Point(x=np.nan), Point()])
    with pytest.raises(MessageRefused, match="'trajectories' 3 has points that are not finite"):
        strips_of_markers(MarkerArray(markers=[marker]), MAP)


def test_each_marker_is_shifted_from_its_own_frame():
    array = sent(trajectory_markers(HEADER, columns(rocks=2), 200, 50))
    far = array.markers[2]
    far.header = Header(frame_id="utm")
    for point in far.points:
        point.x, point.y, point.z = point.x + 5e5, point.y + 4.5e6, point.z + 100.0
    first, second = strips_of_markers(sent(array), SURVEY)
    assert np.array_equal(second.points, first.points + np.array([0.0, 1.0, 0.0]))


def test_hazard_facets_in_the_survey_frame_are_shifted():
    ours = zone("0.1", 2)
    moved = ShownZone(ours.name, ours.corners + np.array(SURVEY.origin), ours.outline)
    found = facets_of_markers(sent(zone_markers(Header(frame_id="utm"), [moved])), SURVEY)
    assert np.array_equal(found["hazard/0.1"][0], ours.corners)


def test_one_marker_in_a_foreign_frame_is_refused():
    array = sent(trajectory_markers(HEADER, columns(), 200, 50))
    array.markers[2].header = Header(frame_id="lidar")
    with pytest.raises(MessageRefused, match="'lidar'"):
        strips_of_markers(array, MAP)


@pytest.mark.parametrize(
    "pose",
    [Pose(position=Point(z=1.0)), Pose(orientation=Quaternion(z=1.0, w=0.0)), Pose(orientation=Quaternion(w=0.5))],
)
def test_a_marker_whose_pose_moves_its_points_is_refused(pose):
    array = sent(trajectory_markers(HEADER, columns(), 200, 50))
    array.markers[1].pose = pose
    with pytest.raises(MessageRefused, match="'trajectories' 0 has a pose"):
        strips_of_markers(array, MAP)


def test_a_marker_without_an_orientation_has_no_pose():
    array = sent(trajectory_markers(HEADER, columns(), 200, 50))
    array.markers[1].pose = Pose(orientation=Quaternion(w=0.0))
    assert len(strips_of_markers(array, MAP)) == 3
