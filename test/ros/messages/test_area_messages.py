"""Tests of areas of interest that are received as messages."""

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import Point, Point32, Polygon, PolygonStamped, Pose, PoseArray
from std_msgs.msg import Header

from rpf3d_core.live.areas import too_small
from rpf3d_ros.messages.area_messages import MOST_CORNERS, MOST_EQUIPMENT, rings_of_equipment, rings_of_polygon
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused

MAP = MapFrame()
SURVEY = MapFrame(survey="utm", origin=(1000.0, 2000.0, 0.0))
RADIUS = 15.0
ALMOST = 0.005
"""How far at most a corner of a circle's polygon lies outside the circle, as a share of the radius."""


def polygon(*corners, frame="map"):
    points = [Point32(x=float(x), y=float(y)) for x, y in corners]
    return PolygonStamped(header=Header(frame_id=frame), polygon=Polygon(points=points))


def equipment(*places, frame="map"):
    poses = [Pose(position=Point(x=float(x), y=float(y))) for x, y in places]
    return PoseArray(header=Header(frame_id=frame), poses=poses)


def area(ring):
    x, y = ring[:-1].T
    return abs(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def test_a_polygon_is_one_ring_in_the_map_frame():
    (ring,) = rings_of_polygon(polygon((1000, 2000), (1004, 2000), (1004, 2003), frame="utm"), SURVEY)
    assert {tuple(corner) for corner in ring.tolist()} == {(0.0, 0.0), (4.0, 0.0), (4.0, 3.0)}


def test_a_polygon_without_corners_takes_the_area_away():
    assert rings_of_polygon(polygon(), MAP) == []


@pytest.mark.parametrize(
    ("corners", "saying"),
    [
        ([(0, 0), (1, 1)], "has 2 corners"),
        ([(0, 0), (1, 1), (2, 2)], "encloses no area"),
        ([(0, 0), (2, 2), (2, 0), (0, 2)], "crosses itself"),
        ([(0, 0), (math.nan, 1), (2, 0)], "corner 1 is not finite"),
        ([(0, 0), (1, math.inf), (2, 0)], "corner 1 is not finite"),
        ([(0, 0), (3e5, 0), (0, 1)], "beyond 1e"),
        ([(0, 0)] * (MOST_CORNERS + 1), "10,001 corners; at most 10,000"),
    ],
)
def test_what_is_no_polygon_is_refused(corners, saying):
    with pytest.raises(MessageRefused, match=saying):
        rings_of_polygon(polygon(*corners), MAP)


def test_an_area_that_is_a_speck_is_refused_because_its_corners_may_be_kilometres():
    with pytest.raises(MessageRefused, match=r"the polygon encloses only 0\.005 m2, .* degrees or kilometres\?"):
        rings_of_polygon(polygon((0.0, 0.0), (0.1, 0.0), (0.1, 0.1)), MapFrame("map"))


def test_holes_are_no_part_of_the_size_of_an_area():
    outline = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0), (0.0, 0.0)])
    hole = 0.002 + 0.9996 * outline
    assert too_small([outline]) == "" and "encloses only 0.08 m2" in too_small([outline, hole])


def test_areas_in_a_foreign_frame_are_refused():
    with pytest.raises(MessageRefused, match="'odom'"):
        rings_of_polygon(polygon((0, 0), (1, 0), (0, 1), frame="odom"), MAP)
    with pytest.raises(MessageRefused, match="'odom'"):
        rings_of_equipment(equipment((0, 0), frame="odom"), MAP, RADIUS)


def test_equipment_is_a_circle_that_holds_all_of_its_radius():
    (ring,) = rings_of_equipment(equipment((100, 50)), MAP, RADIUS)
    corners, middles = ring, 0.5 * (ring[1:] + ring[:-1])
    distance = np.linalg.norm(corners - [100.0, 50.0], axis=1)
    assert np.linalg.norm(middles - [100.0, 50.0], axis=1).min() >= RADIUS * (1.0 - 1e-12)
    assert distance.max() <= RADIUS * (1.0 + ALMOST)


def test_circles_that_overlap_are_one_area_and_others_are_their_own():
    assert len(rings_of_equipment(equipment((0, 0), (10, 0)), MAP, RADIUS)) == 1
    apart = rings_of_equipment(equipment((0, 0), (100, 0)), MAP, RADIUS)
    assert len(apart) == 2
    joined = area(rings_of_equipment(equipment((0, 0), (0, 0)), MAP, RADIUS)[0])
    assert math.isclose(joined, area(apart[0]), rel_tol=1e-9)


def test_circles_around_a_yard_leave_it_out():
    around = [(40 * math.cos(a), 40 * math.sin(a)) for a in np.linspace(0, 2 * math.pi, 13)[:-1]]
    assert len(rings_of_equipment(equipment(*around), MAP, RADIUS)) == 2, "the rim and the hole"


def test_no_equipment_has_no_rings():
    assert rings_of_equipment(equipment(), MAP, RADIUS) == []


def test_equipment_that_is_nowhere_or_too_much_is_refused():
    with pytest.raises(MessageRefused, match="pose 1 is not finite"):
        rings_of_equipment(equipment((0, 0), (math.nan, 0)), MAP, RADIUS)
    with pytest.raises(MessageRefused, match="1,001 poses; at most 1,000"):
        rings_of_equipment(equipment(*[(0, 0)] * (MOST_EQUIPMENT + 1)), MAP, RADIUS)


@pytest.mark.parametrize("frame", ["map", "utm"])
def test_corners_that_have_lost_centimetres_in_single_precision_are_refused_as_clouds_are(frame):
    utm = MapFrame(survey="utm", origin=(450_000.0, 5_400_000.0, 0.0))
    corners = polygon((450_000, 5_400_000), (450_010, 5_400_000), (450_010, 5_400_010), frame=frame)
    with pytest.raises(MessageRefused, match=r"float32 coordinates beyond 1e\+05 m.*subtract map_origin"):
        rings_of_polygon(corners, utm)
