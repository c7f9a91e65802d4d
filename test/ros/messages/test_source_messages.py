"""Tests of PoseArray, PointCloud2 and PointStamped -> sources."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, PointStamped, Pose, PoseArray, Quaternion
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.source_messages import (
    MOST_SOURCES,
    doubt_of_poses,
    poses_of_sources,
    sources_of_cloud,
    sources_of_point,
    sources_of_poses,
)

MAP = MapFrame()
ROUNDING = 1e-12
"""Largest error of a direction that is converted to a quaternion and back: a dozen operations on numbers up to 1."""

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
    assert np.allclose(sources.velocities, expected, atol=ROUNDING, rtol=0.0)


TURNED, AT_REST = pose(turn=(0.0, 0.0, 1.0, 0.0)), pose(turn=(0.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(("each", "speed", "is_doubtful"), [
    ((pose(), pose()), 2.0, True), ((pose(), pose()), 0.0, False), ((pose(), TURNED), 2.0, False),
    ((pose(), AT_REST), 2.0, False), ((AT_REST,), 2.0, False), ((), 2.0, False),
], ids=["identity", "identity without speed", "one turned", "one at rest", "at rest", "none"])  # fmt: skip
def test_poses_of_which_none_is_rotated_are_warned_of_where_they_are_thrown(each, speed, is_doubtful):
    doubt = doubt_of_poses(poses(*each), speed)
    assert ("along the x axis of map at 2 m/s: is this intended?" in doubt) is is_doubtful
    assert bool(doubt) is is_doubtful


def test_a_rotation_of_nothing_is_a_throw_along_x_and_four_zeros_are_a_release_from_rest():
    sources = sources_of_poses(poses(pose(), AT_REST), MAP, speed=2.0)
    assert sources.velocities.tolist() == [[2.0, 0.0, 0.0], [0.0, 0.0, 0.0]]


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
    assert sources_of_poses(poses(pose(turn=(0.0, 0.0, 0.0, 0.0))), MAP).velocities.tolist() == [[0.0, 0.0, 0.0]]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_pose_that_is_not_finite_is_refused_by_number(value):
    with pytest.raises(MessageRefused, match="pose 1 is not finite"):
        sources_of_poses(poses(pose(), pose((0.0, value, 0.0))), MAP)
    with pytest.raises(MessageRefused, match="pose 0 is not finite"):
        sources_of_poses(poses(pose(turn=(0.0, 0.0, value, 1.0)), pose()), MAP)


def test_an_orientation_that_is_no_rotation_is_refused():
    with pytest.raises(MessageRefused, match="orientation of pose 0 has length 2"):
        sources_of_poses(poses(pose(turn=(0.0, 0.0, 0.0, 2.0))), MAP)


def test_no_poses_say_that_nothing_is_seen():
    sources = sources_of_poses(poses(), MAP)
    assert sources.positions.shape == sources.velocities.shape == (0, 3)
    assert sources.stamp_ns == 12_000_000_034


def test_a_pose_is_thrown_along_its_x_axis_with_the_speed_that_is_asked_for():
    quarter = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
    sources = sources_of_poses(poses(pose(turn=quarter), pose(turn=(0.0, 0.0, 0.0, 0.0))), MAP, speed=4.0)
    assert np.allclose(sources.velocities, [[0.0, 4.0, 0.0], [0.0, 0.0, 0.0]], atol=ROUNDING, rtol=0.0)
    assert sources.diameters is None


def test_too_many_poses_are_refused_with_the_limit():
    many = poses(*[pose()] * (MOST_SOURCES + 1))
    with pytest.raises(MessageRefused, match="10,001 sources; at most 10,000"):
        sources_of_poses(many, MAP)


def test_poses_in_a_foreign_frame_are_refused():
    with pytest.raises(MessageRefused, match="'radar'"):
        sources_of_poses(poses(pose(), frame="radar"), MAP)


def cloud(frame="map", **columns):
    header = Header(frame_id=frame, stamp=Time(sec=12, nanosec=34))
    return cloud_of_columns(header, {name: np.array(values, dtype=float) for name, values in columns.items()})


XYZ = {"x": [1.0, 2.0], "y": [3.0, 4.0], "z": [5.0, 6.0]}


def test_a_clicked_point_is_one_source_that_falls_from_rest():
    point = PointStamped(header=Header(frame_id="utm"), point=Point(x=1.0e6 + 2.5, y=0.0, z=7.0))
    sources = sources_of_point(point, MapFrame(survey="utm", origin=(1.0e6, 0.0, 0.0)))
    assert sources.positions.tolist() == [[2.5, 0.0, 7.0]]
    assert sources.velocities.tolist() == [[0.0, 0.0, 0.0]]
    assert sources.header.frame_id == "map"


@pytest.mark.parametrize("point", [Point(x=math.nan), Point(z=math.inf), Point(y=1e9)])
def test_a_clicked_point_that_is_nowhere_is_refused(point):
    with pytest.raises(MessageRefused):
        sources_of_point(PointStamped(header=Header(frame_id="map"), point=point), MAP)
    with pytest.raises(MessageRefused, match="'odom'"):
        sources_of_point(PointStamped(header=Header(frame_id="odom")), MAP)


def test_a_cloud_of_places_alone_is_of_rocks_at_rest_of_unknown_size():
    sources = sources_of_cloud(cloud(**XYZ), MAP)
    assert sources.positions.tolist() == [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]]
    assert not sources.velocities.any()
    assert sources.diameters is None


def test_a_cloud_tells_size_and_velocity_where_it_has_them():
    sources = sources_of_cloud(cloud(**XYZ, diameter=[0.5, np.nan], vx=[1.0, 0.0], vy=[0.0, -2.0], vz=[0.0, 0.5]), MAP)
    assert np.array_equal(sources.diameters, [0.5, np.nan], equal_nan=True)
    assert sources.velocities.tolist() == [[1.0, 0.0, 0.0], [0.0, -2.0, 0.5]]


def test_a_cloud_without_points_says_that_nothing_is_seen():
    assert len(sources_of_cloud(cloud(x=[], y=[], z=[]), MAP).positions) == 0


@pytest.mark.parametrize(
    ("columns", "saying"),
    [
        ({"diameter": [0.0, 1.0]}, "source 0 has a diameter of 0 m"),
        ({"diameter": [1.0, np.inf]}, "source 1 has a diameter of inf m"),
        ({"diameter": [1.0, 1e-30]}, "source 1 has a diameter of 1e-30 m; it must be from 0.001 to 100 m"),
        ({"diameter": [9e-4, 1.0]}, "source 0 has a diameter of 0.0009 m"),
        ({"diameter": [1.0, 101.0]}, "source 1 has a diameter of 101 m"),
        ({"vx": [1.0, 1.0]}, "one field 'vy'"),
        ({"vx": [1.0, 2e4], "vy": [0.0, 0.0], "vz": [0.0, 0.0]}, "source 1 has a speed of 20000 m/s"),
        ({"vx": [np.nan, 1.0], "vy": [0.0, 0.0], "vz": [0.0, 0.0]}, "source 0 has a speed of nan m/s"),
    ],
)
def test_sizes_and_velocities_that_no_rock_has_are_refused(columns, saying):
    with pytest.raises(MessageRefused, match=saying):
        sources_of_cloud(cloud(**XYZ, **columns), MAP)


def named(names):
    return cloud(**XYZ, **{name: [6.0, 4.0] for name in names})


@pytest.mark.parametrize(
    "names",
    [
        ("VX", "VY", "VZ"), ("v_x", "v_y", "v_z"), ("velocity_x", "velocity_y", "velocity_z"), ("velocity",),
        ("speedX", "speedY", "speedZ"), ("vx_mps", "vy_mps", "vz_mps"), ("x_velocity", "y_velocity", "z_velocity"),
        ("vel.x", "vel.y", "vel.z"), ("linear_velocity_x",), ("v_east", "v_north", "v_up"), ("speed [km/h]",),
        ("doppler_velocity",), ("v_radial",), ("v_r",), ("range_rate",), ("vel_e", "vel_n", "vel_u"), ("v_down",),
        ("velocity_m_per_s",), ("speed_abs",), ("linear.x", "linear.y", "linear.z"),
        ("v",), ("vitesse",), ("dx", "dy", "dz"), ("v", "u", "w"),
    ],
)  # fmt: skip
def test_a_velocity_in_a_field_that_is_not_read_is_refused_because_the_rock_would_start_at_rest(names):
    with pytest.raises(MessageRefused, match=f"field '{re.escape(names[0])}' looks like a velocity.*'vx', 'vy' and"):
        sources_of_cloud(named(names), MAP)
    assert sources_of_cloud(named((*names, "vx", "vy", "vz")), MAP).velocities[0].tolist() == [6.0, 6.0, 6.0]


@pytest.mark.parametrize(
    "name",
    ["size", "Diameter", "diameter_m", "diameter_mm", "DIAMETER", "radius", "d50", "mass", "Mass_kg", "rock_size",
     "block_volume_m3", "weight", "diam", "size_x", "length", "diameter_max", "est_diameter", "d_eq", "d100", "volume",
     "d_m", "d_mm", "m3", "tonnes", "kg"],
)  # fmt: skip
def test_a_size_in_a_field_that_is_not_read_is_refused_because_the_rock_would_have_another_size(name):
    with pytest.raises(MessageRefused, match=f"field '{name}' looks like the size of a rock.*the field 'diameter'"):
        sources_of_cloud(named([name]), MAP)
    assert sources_of_cloud(named([name, "diameter"]), MAP).diameters.tolist() == [6.0, 4.0]


def test_other_fields_of_a_cloud_are_ignored():
    names = (
        "intensity", "rgb", "rgba", "ring", "t", "time", "timestamp", "id", "confidence", "range", "azimuth",
        "elevation", "normal_x", "nx", "curvature", "label", "reflectivity", "u", "v", "vx_std", "speed_std",
        "size_accuracy", "level", "temperature", "track_id", "cluster",
    )  # fmt: skip
    sources = sources_of_cloud(named(names), MAP)
    assert sources.diameters is None
    assert not sources.velocities.any()


def test_an_empty_cloud_with_a_misnamed_field_is_refused_so_that_the_name_is_noticed_before_the_first_rock():
    with pytest.raises(MessageRefused, match="'V_X' looks like a velocity"):
        sources_of_cloud(cloud(x=[], y=[], z=[], V_X=[]), MAP)


def test_a_cloud_of_too_many_sources_is_refused_before_it_is_looked_at():
    fields = [PointField(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate("xyz")]
    huge = PointCloud2(header=Header(frame_id="map"), height=1, width=2**31, fields=fields, point_step=12)
    with pytest.raises(MessageRefused, match="at most 10,000"):
        sources_of_cloud(huge, MAP)


def test_a_cloud_in_a_foreign_frame_is_refused():
    with pytest.raises(MessageRefused, match="'radar'"):
        sources_of_cloud(cloud("radar", **XYZ), MAP)


def test_a_cloud_whose_points_are_all_nan_is_not_nothing_seen():
    points = {name: np.full(20, np.nan) for name in "xyz"}
    with pytest.raises(MessageRefused, match="all its 20 points are NaN"):
        sources_of_cloud(cloud_of_columns(Header(frame_id="map"), points), MAP)


def test_a_cloud_that_announces_no_points_but_has_data_is_not_nothing_seen():
    cloud = cloud_of_columns(Header(frame_id="map"), {name: np.ones(5) for name in "xyz"})
    cloud.width = 0
    with pytest.raises(MessageRefused, match="announces 1 x 0 points but has"):
        sources_of_cloud(cloud, MAP)
    nothing = PointCloud2(header=Header(frame_id="map"))
    assert len(sources_of_cloud(nothing, MAP).positions) == 0


@pytest.mark.parametrize("axes", ["x", "y", "z", "xy", "yz", "xyz"])
def test_a_point_with_a_nan_is_a_source_at_an_unknown_place_and_its_cloud_is_refused(axes):
    """If the point were dropped silently, a dangerous source next to a harmless one would be lost."""
    points = {name: [1.0, np.nan if name in axes else 2.0] for name in "xyz"}
    with pytest.raises(MessageRefused, match=r"point 1 has a NaN in x, y or z.*leave such points out"):
        sources_of_cloud(cloud(**points), MAP)


@pytest.mark.parametrize("row_step", [12, 24])
def test_a_cloud_with_data_of_more_points_than_it_announces_is_refused(row_step):
    """The points beyond the announced ones may be the dangerous sources."""
    announced = cloud(x=[60.0, -30.0], y=[0.0, 0.0], z=[1.0, 31.0])
    announced.width, announced.row_step = 1, announced.row_step * row_step // 24
    with pytest.raises(MessageRefused, match="room for more points"):
        sources_of_cloud(announced, MAP)


def test_a_cloud_whose_rows_have_room_for_a_further_point_is_refused():
    announced = cloud(x=[1.0, 2.0, 3.0, 4.0], y=[0.0] * 4, z=[0.0] * 4)
    announced.height, announced.width, announced.row_step = 2, 1, 2 * announced.point_step
    with pytest.raises(MessageRefused, match="room for more points"):
        sources_of_cloud(announced, MAP)


def test_bytes_that_fill_up_a_row_are_no_points():
    padded = cloud(x=[1.0, 2.0], y=[0.0] * 2, z=[0.0] * 2)
    fill = bytes(padded.point_step - 1)
    data = bytes(padded.data)
    padded.height, padded.width, padded.row_step = 2, 1, padded.point_step + len(fill)
    padded.data = data[: padded.point_step] + fill + data[padded.point_step :] + fill
    assert sources_of_cloud(padded, MAP).positions[:, 0].tolist() == [1.0, 2.0]


@pytest.mark.parametrize("lost", [{"width": 0, "data": b""}, {"height": 0, "data": b""}, {"data": b""}])
def test_a_cloud_that_lost_its_data_is_not_nothing_seen(lost):
    cloud = cloud_of_columns(Header(frame_id="map"), {name: np.ones(5) for name in "xyz"})
    for name, value in lost.items():
        setattr(cloud, name, value)
    with pytest.raises(MessageRefused, match=r"the cloud has no data, but announces|data holds 0 bytes"):
        sources_of_cloud(cloud, MAP)


@pytest.mark.parametrize(
    "change", [{"data": bytes(59)}, {"width": 6}, {"height": 2}, {"point_step": 13}, {"row_step": 120, "height": 2}]
)
def test_a_cloud_whose_sizes_do_not_fit_its_data_is_refused(change):
    cloud = cloud_of_columns(Header(frame_id="map"), {name: np.ones(5) for name in "xyz"})
    assert (cloud.width, cloud.height, cloud.point_step, len(cloud.data)) == (5, 1, 12, 60)
    for name, value in change.items():
        setattr(cloud, name, value)
    with pytest.raises(MessageRefused, match=r"data holds|row_step is"):
        sources_of_cloud(cloud, MAP)
