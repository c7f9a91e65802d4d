"""Tests that inputs in other frames are transformed in double precision, and refused without a valid transform."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import Point, PointStamped, Pose, PoseArray, Quaternion
from messages.live_peer import cloud, header, polygon, poses

from rpf3d_ros.interface.transforms import NEWEST, FoundTransform, InputFrames
from rpf3d_ros.messages.area_messages import rings_of_equipment, rings_of_polygon
from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.map_frame import MapFrame, rigid_transform
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.source_messages import sources_of_cloud, sources_of_point, sources_of_poses
from rpf3d_ros.messages.terrain_messages import MeshSurvey, cdr_of_mesh, mesh_of_cdr, survey_of_cloud

S = 1_000_000_000
NOW = 1_000 * S
LONGEST = 0.5
MAP = MapFrame(survey="utm", origin=(5e5, 5e6, 100.0))
HALF = float(np.sqrt(0.5))
TO_NORTH = FoundTransform((0.0, 0.0, HALF, HALF), (100.0, 200.0, 50.0), None)
"""Transform of a radar whose x axis points north and whose y axis points west; its origin is at (100, 200, 50) m."""

ROUNDING = 4e-14
"""Largest error (m) of a rotated point at 100 m: about a dozen operations, each with an error up to 1.4e-14 m."""


class Given:
    """A provider of transforms that always gives the same answer and keeps the arguments of each lookup."""

    def __init__(self, answer):
        self.answer, self.asked = answer, []

    def lookup(self, target, source, stamp_ns):
        self.asked.append((target, source, stamp_ns))
        return self.answer


def frame_of(found, frame_id="radar", stamp_ns=NOW):
    return InputFrames(MAP, Given(found), LONGEST).of(frame_id, stamp_ns)


RADAR = frame_of(TO_NORTH)


def test_the_frames_of_the_parameters_come_first_and_need_no_transform():
    given = Given(TO_NORTH)
    frames = InputFrames(MAP, given, LONGEST)
    assert frames.of("map", NOW) is MAP and frames.of("utm", 0) is MAP and frames.of("", NOW) is MAP
    assert given.asked == []
    assert frames.of("radar", NOW).points(np.zeros(3), "radar").tolist() == [100.0, 200.0, 50.0]
    assert given.asked == [("map", "radar", NOW)]


def test_a_message_gets_the_transform_of_its_own_frame_only():
    with pytest.raises(MessageRefused, match="frame_id is 'lidar'; it must be 'map' or 'utm'"):
        RADAR.points(np.zeros(3), "lidar")
    with pytest.raises(MessageRefused, match="frame_id is ''"):
        RADAR.directions(np.zeros(3), "")
    assert RADAR.points(np.array([5e5, 5e6, 101.0]), "utm").tolist() == [0.0, 0.0, 1.0]
    assert RADAR.directions(np.array([1.0, 0.0, 0.0]), "utm").tolist() == [1.0, 0.0, 0.0]


def test_without_a_provider_another_frame_is_refused_as_ever():
    with pytest.raises(MessageRefused, match="no other frame is transformed"):
        InputFrames(MAP).of("radar", NOW).check("radar")


def test_a_message_without_a_frame_is_not_answered_with_a_sentence_on_transforms():
    with pytest.raises(MessageRefused, match=r"frame_id is ''; it must be 'map' or 'utm'$"):
        InputFrames(MAP, Given(TO_NORTH), LONGEST).of("", NOW).check("")


def test_the_reason_of_a_missing_transform_is_told():
    with pytest.raises(
        MessageRefused, match="frame_id is 'radar', and there is no transform to 'map': it does not exist"
    ):
        frame_of("it does not exist")


def test_a_dynamic_transform_may_be_as_old_as_the_parameter_says_and_no_older():
    oldest = NOW - round(LONGEST * S)
    assert frame_of(TO_NORTH._replace(stamp_ns=NOW)).other.source == "radar"
    assert frame_of(TO_NORTH._replace(stamp_ns=oldest)).other.source == "radar"
    with pytest.raises(MessageRefused, match=r"is more than 0\.5 s older than the message \(transforms_max_age_s\)"):
        frame_of(TO_NORTH._replace(stamp_ns=oldest - 1))
    with pytest.raises(MessageRefused, match="is later than the message"):
        frame_of(TO_NORTH._replace(stamp_ns=NOW + 1))


def test_a_static_transform_has_no_age_but_a_message_without_a_stamp_gets_none():
    assert frame_of(TO_NORTH, stamp_ns=10**9 * S).other.source == "radar"
    with pytest.raises(MessageRefused, match="its stamp is 0"):
        frame_of(TO_NORTH, stamp_ns=0)


def test_a_frame_that_must_be_static_is_looked_up_without_a_time_and_refused_if_it_moves():
    given = Given(TO_NORTH)
    frames = InputFrames(MAP, given, LONGEST)
    assert frames.static("radar", "a mesh has no stamp").other.source == "radar"
    assert frames.static("map", "a mesh has no stamp") is MAP
    assert given.asked == [("map", "radar", NEWEST)]
    given.answer = TO_NORTH._replace(stamp_ns=NOW)
    with pytest.raises(
        MessageRefused, match=r"frame 'radar' moves: a mesh has no stamp, so its frame must be static \(/tf_static\)"
    ):
        frames.static("radar", "a mesh has no stamp")
    given.answer = "it does not exist"
    with pytest.raises(MessageRefused, match="there is no transform to 'map': it does not exist"):
        frames.static("radar", "a mesh has no stamp")


@pytest.mark.parametrize(("turn", "shift", "why"), [
    ((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "not a rotation: its quaternion has length 0, not 1"),
    ((0.0, 0.0, 0.0, 1.002), (0.0, 0.0, 0.0), "length 1.002"),
    ((np.nan, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), "not finite"),
    ((0.0, 0.0, 0.0, 1.0), (0.0, np.inf, 0.0), "not finite"),
])  # fmt: skip
def test_a_transform_that_is_no_rotation_is_refused(turn, shift, why):
    with pytest.raises(MessageRefused, match=why):
        frame_of(FoundTransform(turn, shift, None))


def test_a_rotation_keeps_lengths_and_hands_in_double_precision():
    """Rounding errors of the quaternion's length and of the matrix are at most 8 times 2.2e-16."""
    rng = np.random.default_rng(1)
    for turn in rng.normal(size=(200, 4)):
        turn *= rng.uniform(0.9991, 1.0009) / np.linalg.norm(turn)
        rotation = rigid_transform("radar", turn, (0.0, 0.0, 0.0)).rotation
        assert np.allclose(rotation @ rotation.T, np.eye(3), atol=2e-15, rtol=0.0)
        assert np.linalg.det(rotation) == pytest.approx(1.0, abs=2e-15)


def test_large_coordinates_of_another_frame_keep_their_millimetres():
    """The frame has survey coordinates and is turned by 90 degrees; coordinates below 1e8 m are exact to 1e-9 m."""
    grid = frame_of(FoundTransform((0.0, 0.0, HALF, HALF), (5_400_000.0, -450_000.0, -100.0), None), "mine_grid")
    moved = grid.points(np.array([450_012.345, 5_399_000.001, 142.0]), "mine_grid")
    assert np.abs(moved - (1_000.0 - 0.001, 12.345, 42.0)).max() < 2e-9


def test_poses_are_moved_and_their_directions_turned():
    pose = Pose(position=Point(x=10.0, y=1.0, z=-2.0), orientation=Quaternion(w=1.0))
    found = sources_of_poses(PoseArray(header=header(NOW, "radar"), poses=[pose]), RADAR, speed=2.0)
    assert np.abs(found.positions - [[99.0, 210.0, 48.0]]).max() < ROUNDING
    assert np.abs(found.velocities - [[0.0, 2.0, 0.0]]).max() < ROUNDING
    assert (found.header.frame_id, found.stamp_ns) == ("map", NOW)


def test_clouds_of_sources_are_moved_and_their_velocities_turned():
    columns = {"x": 10.0, "y": 0.0, "z": 0.0, "vx": 0.0, "vy": 3.0, "vz": -1.0}
    message = cloud_of_columns(header(NOW, "radar"), {name: np.array([value]) for name, value in columns.items()})
    found = sources_of_cloud(message, RADAR)
    assert np.abs(found.positions - [[100.0, 210.0, 50.0]]).max() < ROUNDING
    assert np.abs(found.velocities - [[-3.0, 0.0, -1.0]]).max() < ROUNDING
    nothing = sources_of_cloud(cloud(np.empty((0, 3)), NOW, "radar"), RADAR)
    assert nothing.positions.shape == nothing.velocities.shape == (0, 3)


def test_clicks_areas_and_machines_are_moved():
    point = PointStamped(header=header(NOW, "radar"), point=Point(x=1.0, y=0.0, z=0.0))
    assert np.abs(sources_of_point(point, RADAR).positions - [[100.0, 201.0, 50.0]]).max() < ROUNDING
    (ring,) = rings_of_polygon(polygon([(0.0, 0.0), (10.0, 0.0), (10.0, 5.0)], NOW, "radar"), RADAR)
    assert np.abs(np.sort(ring, axis=0)[[0, -1]] - [(95.0, 200.0), (100.0, 210.0)]).max() < ROUNDING
    (circle,) = rings_of_equipment(poses([(20.0, 0.0, 0.0)], NOW, "radar"), RADAR, 4.0)
    middle = 0.5 * (circle.min(axis=0) + circle.max(axis=0))
    assert np.abs(middle - (100.0, 220.0)).max() < 2.0 * ROUNDING


def test_an_outline_without_heights_is_refused_in_a_tilted_frame_and_used_in_one_that_points_down():
    corners = [(0.0, 0.0), (10.0, 0.0), (10.0, 5.0)]
    sine, cosine = np.sin(0.05), np.cos(0.05)
    tilted = frame_of(FoundTransform((sine, 0.0, 0.0, cosine), (0.0, 0.0, 0.0), None))
    with pytest.raises(MessageRefused, match="an outline without heights in a tilted frame has no place in plan"):
        rings_of_polygon(polygon(corners, NOW, "radar"), tilted)
    outline = polygon(corners, NOW, "radar")
    outline.polygon.points[0].z = 1.0
    assert rings_of_polygon(outline, tilted)
    assert rings_of_polygon(polygon(corners, NOW, "map"), tilted)
    down = frame_of(FoundTransform((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 30.0), None))
    assert rings_of_polygon(polygon(corners, NOW, "radar"), down)


def test_a_scanner_that_looks_down_gives_terrain_the_right_way_up_and_its_holes_stay():
    """The z axis of the scanner points down: the frame is turned by 180 degrees about its x axis."""
    scanner = frame_of(FoundTransform((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 30.0), None), "scanner")
    y, x = np.mgrid[0:3, 0:4].astype(float)
    points = np.stack([x, y, 20.0 + 0.0 * x], axis=-1)
    points[1, 1, 2] = np.nan
    message = cloud(points, NOW, "scanner")
    message.is_dense = False
    grid = survey_of_cloud(message, scanner).points
    assert np.isnan(grid[1, 1]).all() and np.isnan(grid).sum() == 3
    assert grid[0, 3].tolist() == [3.0, 0.0, 10.0] and grid[2, 0].tolist() == [0.0, -2.0, 10.0]
    scattered = survey_of_cloud(
        cloud(np.array([[0.0, 0.0, 20.0], [1.0, 0.0, 21.0], [0.0, 1.0, 22.0]]), NOW, "scanner"), scanner
    )
    assert scattered.points.tolist() == [[0.0, 0.0, 10.0], [1.0, 0.0, 9.0], [0.0, -1.0, 8.0]]


def test_a_mesh_is_moved_and_keeps_the_side_that_faces_up():
    corners = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 1.0], [0.0, 10.0, 2.0]])
    mesh = mesh_of_cdr(cdr_of_mesh(MeshSurvey(corners, np.array([[0, 1, 2]]))), RADAR, "radar")
    assert np.abs(mesh.vertices - [[100.0, 200.0, 50.0], [100.0, 210.0, 51.0], [90.0, 200.0, 52.0]]).max() < ROUNDING
    a, b, c = mesh.vertices[mesh.triangles[0]]
    assert np.cross(b - a, c - a)[2] > 0.0


def test_a_point_that_a_transform_moves_too_far_is_refused():
    far = frame_of(FoundTransform((0.0, 0.0, 0.0, 1.0), (2e5, 0.0, 0.0), None))
    with pytest.raises(MessageRefused, match=r"beyond 1e.*; check the transform of frame 'radar'$"):
        sources_of_poses(poses([(0.0, 0.0, 0.0)], NOW, "radar"), far)


def test_what_was_transformed_stays_where_it_was_when_the_radar_is_surveyed_again():
    given = Given(TO_NORTH)
    frames = InputFrames(MAP, given, LONGEST)
    before = frames.of("radar", NOW)
    given.answer = TO_NORTH._replace(translation=(101.0, 200.0, 50.0))
    after = frames.of("radar", NOW + S)
    assert before.points(np.zeros(3), "radar")[0] == 100.0 and after.points(np.zeros(3), "radar")[0] == 101.0
