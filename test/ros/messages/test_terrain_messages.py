"""Tests of terrain messages <-> surveys: round trips compared with rclpy's serialisation, and malformed bytes."""

import struct
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import Point
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from shape_msgs.msg import Mesh, MeshTriangle
from std_msgs.msg import Header

from rpf3d_core.live.survey import MOST_POINTS, CloudSurvey
from rpf3d_ros.messages.cloud_messages import cloud_of_columns, cloud_of_grid
from rpf3d_ros.messages.map_frame import FARTHEST, MapFrame
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.terrain_messages import (
    LITTLE_ENDIAN_CDR,
    GridSurvey,
    MeshSurvey,
    cdr_of_mesh,
    check_cloud,
    check_mesh,
    grid_of_cloud,
    mesh_of_cdr,
    survey_of_cloud,
)

A_FEW_OBJECTS = 100_000
"""Most memory (bytes) that a refusal may take: its sentence, and modules imported for it."""

MAP, HEADER = MapFrame(), Header(frame_id="map")
SURVEY = MapFrame(survey="utm", origin=(500_000.0, 4_500_000.0, 0.0))
SQUARE = MeshSurvey(
    np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.5], [1.0, 1.0, 2.0], [0.0, 1.0, 0.5]]),
    np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
)


def mesh_message(survey):
    triangles = [MeshTriangle(vertex_indices=t) for t in survey.triangles.astype(np.uint32)]
    return Mesh(triangles=triangles, vertices=[Point(x=x, y=y, z=z) for x, y, z in survey.vertices.tolist()])


def strip(count):
    """Return a strip of `count` triangles; odd and even counts give the two paddings between the message's arrays."""
    vertices = np.array([[i, i % 2, 0.125 * i] for i in range(count + 2)], dtype=float)
    return MeshSurvey(vertices, np.array([[i, i + 1, i + 2] for i in range(count)], dtype=np.int32))


@pytest.mark.parametrize("count", [1, 2, 3, 4, 17])
def test_hand_laid_bytes_are_what_rclpy_reads(count):
    message = deserialize_message(cdr_of_mesh(strip(count)), Mesh)
    assert [list(t.vertex_indices) for t in message.triangles] == strip(count).triangles.tolist()
    assert [[v.x, v.y, v.z] for v in message.vertices] == strip(count).vertices.tolist()


@pytest.mark.parametrize("count", [1, 2, 3, 4, 17])
def test_what_rclpy_writes_is_read(count):
    back = mesh_of_cdr(serialize_message(mesh_message(strip(count))), MAP, "map")
    assert np.array_equal(back.vertices, strip(count).vertices)
    assert np.array_equal(back.triangles, strip(count).triangles)


def test_a_mesh_in_survey_coordinates_is_shifted_in_float64():
    far = MeshSurvey(SQUARE.vertices + np.array(SURVEY.origin), SQUARE.triangles)
    assert np.array_equal(mesh_of_cdr(cdr_of_mesh(far), SURVEY, "utm").vertices, SQUARE.vertices)


def test_a_mesh_far_from_the_origin_is_refused_with_what_to_set():
    far = MeshSurvey(SQUARE.vertices + 2 * FARTHEST, SQUARE.triangles)
    with pytest.raises(MessageRefused, match="map_origin"):
        mesh_of_cdr(cdr_of_mesh(far), MAP, "map")


def test_a_mesh_in_a_foreign_frame_is_refused():
    with pytest.raises(MessageRefused, match="frame_id is 'base_link'; it must be 'map'"):
        mesh_of_cdr(cdr_of_mesh(SQUARE), MAP, "base_link")


def test_every_truncation_of_a_mesh_is_refused():
    whole = cdr_of_mesh(SQUARE)
    for length in range(len(whole)):
        with pytest.raises(MessageRefused):
            mesh_of_cdr(whole[:length], MAP, "map")


@pytest.mark.parametrize("header", [b"\x00\x00\x00\x00", b"\x00\x03\x00\x00", b"\x01\x00\x00\x00"])
def test_another_encapsulation_is_refused(header):
    with pytest.raises(MessageRefused, match="little-endian CDR"):
        mesh_of_cdr(header + cdr_of_mesh(SQUARE)[4:], MAP, "map")


@pytest.mark.parametrize("count", [0, 3, 2**31, 2**32 - 1])
def test_an_announced_number_of_triangles_that_does_not_fit_is_refused(count):
    lying = LITTLE_ENDIAN_CDR + struct.pack("<I", count) + cdr_of_mesh(SQUARE)[8:]
    with pytest.raises(MessageRefused):
        mesh_of_cdr(lying, MAP, "map")


@pytest.mark.parametrize("count", [0, 5, 2**31, 2**32 - 1])
def test_an_announced_number_of_vertices_that_does_not_fit_is_refused(count):
    whole = cdr_of_mesh(SQUARE)
    place = 8 + 12 * len(SQUARE.triangles)
    with pytest.raises(MessageRefused):
        mesh_of_cdr(whole[:place] + struct.pack("<I", count) + whole[place + 4 :], MAP, "map")


def test_an_index_beyond_the_vertices_is_refused_by_number():
    wrong = MeshSurvey(SQUARE.vertices, np.array([[0, 1, 2], [0, 2, 4]]))
    with pytest.raises(MessageRefused, match="triangle 1 of the mesh names a vertex beyond the last one, 3"):
        mesh_of_cdr(cdr_of_mesh(wrong), MAP, "map")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_vertex_that_is_not_finite_is_refused_by_number(value):
    vertices = SQUARE.vertices.copy()
    vertices[2, 1] = value
    with pytest.raises(MessageRefused, match="vertex 2 of the mesh is not finite"):
        mesh_of_cdr(cdr_of_mesh(MeshSurvey(vertices, SQUARE.triangles)), MAP, "map")


@given(tail=st.binary(max_size=300))
def test_no_bytes_do_more_than_be_refused(tail):
    try:
        survey = mesh_of_cdr(LITTLE_ENDIAN_CDR + tail, MAP, "map")
    except MessageRefused:
        return
    assert survey.triangles.max() < len(survey.vertices)


def grid():
    y, x = np.mgrid[0:4, 0:5].astype(float)
    points = np.stack([x, y, 0.5 * x], axis=-1)
    points[1, 2] = np.nan
    return GridSurvey(points)


def test_a_grid_comes_back_with_its_holes():
    back = grid_of_cloud(cloud_of_grid(Header(frame_id="map"), grid()), MAP)
    assert np.array_equal(back.points, grid().points, equal_nan=True)


def test_a_point_with_one_nan_is_a_hole_as_a_whole():
    points = grid().points
    points[3, 3, 2] = np.nan
    message = cloud_of_grid(Header(frame_id="map"), GridSurvey(points))
    assert np.isnan(grid_of_cloud(message, MAP).points[3, 3]).all()


def test_a_cloud_in_a_foreign_frame_is_refused():
    with pytest.raises(MessageRefused, match="'velodyne'; it must be 'map' or 'utm'"):
        grid_of_cloud(cloud_of_grid(Header(frame_id="velodyne"), grid()), SURVEY)


def test_a_cloud_without_a_frame_is_refused():
    with pytest.raises(MessageRefused, match="frame_id is ''"):
        grid_of_cloud(cloud_of_grid(Header(), grid()), MAP)


def test_an_unorganised_cloud_is_refused_with_what_to_publish_instead():
    flat = GridSurvey(grid().points.reshape(1, -1, 3))
    with pytest.raises(MessageRefused, match=r"unorganised .* terrain/mesh"):
        grid_of_cloud(cloud_of_grid(Header(frame_id="map"), flat), MAP)


def test_a_cloud_of_holes_only_is_refused():
    with pytest.raises(MessageRefused, match="every point of the cloud is NaN"):
        grid_of_cloud(cloud_of_grid(Header(frame_id="map"), GridSurvey(np.full((3, 3, 3), np.nan))), MAP)


def scattered(points, dense=True, kind="f4"):
    """Return an unorganised PointCloud2 of points (N, 3). kind : "f4" for float32, "f8" for float64."""
    cloud = cloud_of_columns(HEADER, {name: points[:, i] for i, name in enumerate("xyz")})
    if kind == "f8":
        cloud.fields = [PointField(name=n, offset=8 * i, datatype=8, count=1) for i, n in enumerate("xyz")]
        cloud.point_step, cloud.row_step = 24, 24 * len(points)
        cloud.data = points.astype("<f8").tobytes()
    cloud.is_dense = dense
    return cloud


CORNERS = np.array([[0.0, 0.0, 1.0], [4.0, 0.0, 2.0], [0.0, 4.0, 3.0], [4.0, 4.0, 4.0]])


@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_scattered_points_are_a_cloud(kind):
    survey = survey_of_cloud(scattered(CORNERS, kind=kind), MapFrame())
    assert isinstance(survey, CloudSurvey)
    assert survey.points.dtype == np.float64
    assert survey.points.tolist() == CORNERS.tolist()


def test_a_column_of_points_is_a_cloud_too():
    cloud = scattered(CORNERS)
    cloud.height, cloud.width, cloud.row_step = 4, 1, cloud.point_step
    assert survey_of_cloud(cloud, MapFrame()).points.tolist() == CORNERS.tolist()


def test_rows_of_points_are_a_grid():
    survey = survey_of_cloud(cloud_of_grid(HEADER, grid()), MapFrame())
    assert isinstance(survey, GridSurvey)
    assert np.array_equal(survey.points, grid().points, equal_nan=True)


def test_points_that_are_not_there_are_left_out_of_a_cloud():
    holed = np.concatenate([CORNERS, [[np.nan, 1.0, 1.0], [1.0, 1.0, np.nan]]])
    assert survey_of_cloud(scattered(holed, dense=False), MapFrame()).points.tolist() == CORNERS.tolist()


@pytest.mark.parametrize("points", [CORNERS[:1], CORNERS[:2], np.full((9, 3), np.nan)])
def test_a_cloud_of_less_than_a_triangle_is_refused(points):
    with pytest.raises(MessageRefused, match="points that are not NaN; terrain needs 3"):
        survey_of_cloud(scattered(points, dense=False), MapFrame())


def announced(height, width):
    """Return a cloud that announces height x width points but contains no data."""
    fields = [PointField(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate("xyz")]
    return PointCloud2(header=HEADER, height=height, width=width, fields=fields, point_step=12, row_step=12 * width)


@pytest.mark.parametrize("read", [check_cloud, survey_of_cloud])
@pytest.mark.parametrize(("height", "width"), [(1, 50_000_000), (10_000, 5_000)])
def test_fifty_million_points_are_refused_with_the_limit_and_nothing_is_made_of_them(read, height, width):
    tracemalloc.start()
    with pytest.raises(MessageRefused, match=f"50,000,000 points; at most {MOST_POINTS:,}"):
        read(announced(height, width), MapFrame())
    assert tracemalloc.get_traced_memory()[1] < A_FEW_OBJECTS
    tracemalloc.stop()


def test_a_mesh_of_too_many_vertices_or_triangles_is_refused_with_the_limit():
    whole = cdr_of_mesh(SQUARE)
    with pytest.raises(MessageRefused, match="at most 2 are allowed"):
        mesh_of_cdr(whole, MapFrame(), "map", most=2)
    huge = struct.pack("<I", 2 * 50_000_000) + whole[8:]
    with pytest.raises(MessageRefused, match="50,000,000 points; at most"):
        check_mesh(whole[:4] + huge)


def test_a_sound_cloud_and_mesh_pass_the_checks_of_a_callback():
    check_cloud(cloud_of_grid(HEADER, grid()), MapFrame())
    check_mesh(cdr_of_mesh(SQUARE))
