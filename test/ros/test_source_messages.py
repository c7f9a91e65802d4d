"""PoseArray <-> sources."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from std_msgs.msg import Header

from rpf3d_ros.map_frame import MapFrame
from rpf3d_ros.refusals import MessageRefused
from rpf3d_ros.source_messages import poses_of_sources, sources_of_poses

MAP = MapFrame()
ROUNDING = 1e-12
"""Of a direction turned into a quaternion and back: a dozen operations on numbers up to 1."""

COMPONENT = st.integers(-50_000_000, 50_000_000).map(lambda micrometres: 1e-6 * micrometres)


def pose(position=(1.0, 2.0, 3.0), turn=(0.0, 0.0, 0.0, 1.0)):
    x, y, z, w = turn
    return Pose(position=Point(x=position[0], y=position[1], z=position[2]), orientation=Quaternion(x=x, y=y, z=z, w=w))


def poses(*each, frame="map"):
    return PoseArray(header=Header(frame_id=frame, stamp=Time(sec=12, nanosec=34)), poses=list(each))


@given(velocity=st.tuples(COMPONENT, COMPONENT, COMPONENT))
def test_a_direction_of_release_survives_the_pose(velocity):
    v = np.array([velocity])
    speed = np.linalg.norm(v)
    sources = sources_of_poses(poses_of_sources(Header(frame_id="map"), np.zeros((1, 3)), v), MAP)
    expected = v / speed if speed else np.array([[1.0, 0.0, 0.0]])
    assert np.allclose(sources.directions, expected, atol=ROUNDING, rtol=0.0)


def test_positions_and_the_stamp_come_through():
    sources = sources_of_poses(poses(pose(), pose((4.0, 5.0, 6.0))), MAP)
    assert sources.positions.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    assert (sources.header.stamp.sec, sources.header.stamp.nanosec, sources.header.frame_id) == (12, 34, "map")


def test_survey_coordinates_are_shifted_and_leave_in_the_map_frame():
    frame = MapFrame(survey="utm", origin=(1.0e6, 2.0e6, 100.0))
    sources = sources_of_poses(poses(pose((1.0e6 + 1.5, 2.0e6, 90.0)), frame="utm"), frame)
    assert sources.positions.tolist() == [[1.5, 0.0, -10.0]]
    assert sources.header.frame_id == "map"


def test_a_pose_without_orientation_has_no_direction():
    assert sources_of_poses(poses(pose(turn=(0.0, 0.0, 0.0, 0.0))), MAP).directions.tolist() == [[0.0, 0.0, 0.0]]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_pose_that_is_not_finite_is_refused_by_number(value):
    with pytest.raises(MessageRefused, match="pose 1 is not finite"):
        sources_of_poses(poses(pose(), pose((0.0, value, 0.0))), MAP)
    with pytest.raises(MessageRefused, match="pose 0 is not finite"):
        sources_of_poses(poses(pose(turn=(0.0, 0.0, value, 1.0)), pose()), MAP)


def test_an_orientation_that_is_no_rotation_is_refused():
    with pytest.raises(MessageRefused, match="orientation of pose 0 has length 2"):
        sources_of_poses(poses(pose(turn=(0.0, 0.0, 0.0, 2.0))), MAP)


def test_no_poses_are_refused():
    with pytest.raises(MessageRefused, match="holds no poses"):
        sources_of_poses(poses(), MAP)


def test_poses_in_a_foreign_frame_are_refused():
    with pytest.raises(MessageRefused, match="'radar'"):
        sources_of_poses(poses(pose(), frame="radar"), MAP)
