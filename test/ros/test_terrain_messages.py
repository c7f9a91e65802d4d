"""Terrain messages <-> surveys: round trips against rclpy's own serialisation, and hostile bytes."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import Point
from rclpy.serialization import deserialize_message, serialize_message
from shape_msgs.msg import Mesh, MeshTriangle
from std_msgs.msg import Header

from rpf3d_ros.cloud_messages import cloud_of_grid
from rpf3d_ros.map_frame import FARTHEST, MapFrame
from rpf3d_ros.refusals import MessageRefused
from rpf3d_ros.terrain_messages import (
    LITTLE_ENDIAN_CDR,
    GridSurvey,
    MeshSurvey,
    cdr_of_mesh,
    grid_of_cloud,
    mesh_of_cdr,
)

MAP = MapFrame()
SURVEY = MapFrame(survey="utm", origin=(500_000.0, 4_500_000.0, 0.0))
SQUARE = MeshSurvey(
    np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.5], [1.0, 1.0, 2.0], [0.0, 1.0, 0.5]]),
    np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
)


def mesh_message(survey):
    triangles = [MeshTriangle(vertex_indices=t) for t in survey.triangles.astype(np.uint32)]
    return Mesh(triangles=triangles, vertices=[Point(x=x, y=y, z=z) for x, y, z in survey.vertices.tolist()])


def strip(count):
    """A strip of `count` triangles, so that the padding between the arrays takes both its values."""
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
