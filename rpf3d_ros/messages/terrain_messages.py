"""Convert terrain messages to surveys and back: a PointCloud2 is a grid or scattered points, a Mesh is a mesh.

A shape_msgs/Mesh is sent and received as CDR bytes, which this module writes and reads directly: 2.3 million triangles
take 0.2 s; as Python objects they take 7 s.
Layout (OMG XCDR1, little endian): 00 01 00 00, then, with offsets counted from the next byte, u32 number of triangles,
u32[3] for each triangle, u32 number of vertices, padding to 8 bytes, f64[3] for each vertex.
"""

import struct
from typing import TYPE_CHECKING

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.live.survey import MOST_POINTS, CloudSurvey, GridSurvey, MeshSurvey, check_points
from rpf3d_ros.messages.cloud_reading import check_sizes, positions_of_cloud
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2

Buffer = bytes | memoryview
"""The bytes of a message in CDR, the byte format of ROS; a memoryview if Python does not own the memory."""

LITTLE_ENDIAN_CDR = bytes((0, 1, 0, 0))
HEADER, COUNT, TRIANGLE, VERTEX = 4, 4, 12, 24
"""Sizes in bytes of the encapsulation header, a length, three u32 indices, three f64 coordinates."""


FEWEST_POINTS = 3
"""Least number of points in a scattered cloud: a triangle."""


def check_cloud(cloud: "PointCloud2", frame: MapFrame, most: int = MOST_POINTS) -> None:
    """Check a cloud without reading its points: its frame, its sizes and its number of points.

    Raises MessageRefused for a foreign frame, wrong sizes (`check_sizes`) and more than `most` points. The check takes
    microseconds, so a callback can wait for it.
    """
    frame.check(cloud.header.frame_id)
    _check_count(cloud.height * cloud.width, most)
    check_sizes(cloud)


def survey_of_cloud(cloud: "PointCloud2", frame: MapFrame, most: int = MOST_POINTS) -> GridSurvey | CloudSurvey:
    """Return the survey in a cloud of terrain/points or terrain/update, converted to the map frame.

    A cloud with at least two rows and two columns is a grid, any other cloud scattered points. A point with a NaN is a
    hole of a grid, and is left out of scattered points.

    most : largest number of points

    Raises MessageRefused in the cases of `check_cloud`, `positions_of_cloud` and `MapFrame.points`, if a grid has only
    NaN points, and if fewer than `FEWEST_POINTS` scattered points remain.
    """
    check_cloud(cloud, frame, most)
    if cloud.height > 1 and cloud.width > 1:
        return grid_of_cloud(cloud, frame)
    points = frame.points(positions_of_cloud(cloud), cloud.header.frame_id).reshape(-1, 3)
    there = points if cloud.is_dense else points[~np.isnan(points).any(axis=-1)]
    if len(there) < FEWEST_POINTS:
        raise MessageRefused(f"the cloud has {len(there)} points that are not NaN; terrain needs {FEWEST_POINTS}")
    return CloudSurvey(there)


def grid_of_cloud(cloud: "PointCloud2", frame: MapFrame) -> GridSurvey:
    """Return the survey in an organised point cloud: points in rows, map frame; a point with any NaN is a hole.

    Raises MessageRefused in every case in which `positions_of_cloud` does, and also if the frame is foreign, if the
    cloud is unorganised, if a point is too far away (`MapFrame.points`), and if every point is NaN.
    """
    frame.check(cloud.header.frame_id)
    if cloud.height < 2 or cloud.width < 2:
        raise MessageRefused(
            f"the cloud is unorganised (height {cloud.height}, width {cloud.width}); publish terrain as an organised "
            f"grid of at least 2 x 2 points, or as shape_msgs/Mesh on terrain/mesh"
        )
    points = frame.points(positions_of_cloud(cloud), cloud.header.frame_id)
    hole = np.isnan(points).any(axis=-1)
    if bool(hole.all()):
        raise MessageRefused("every point of the cloud is NaN; the terrain needs at least one cell of four points")
    points[hole] = np.nan
    return GridSurvey(points)


def mesh_of_cdr(data: Buffer, frame: MapFrame, frame_id: str, most: int = MOST_POINTS) -> MeshSurvey:
    """Return the mesh in the CDR bytes of a shape_msgs/Mesh, converted to the map frame.

    frame_id : frame of the mesh in the message, from a parameter, because a Mesh has no header

    Raises MessageRefused for bytes that are not little-endian CDR, for lengths that do not fit the buffer, for a mesh
    without triangles or vertices, for more than `most` vertices or twice as many triangles, for indices beyond the
    vertices, for vertices that are not finite, and in the cases of `MapFrame.points`. No memory is allocated before its
    length has been checked.
    """
    triangles, vertices = _split_mesh(data, most)
    if not bool(np.isfinite(vertices).all()):
        bad = int(np.flatnonzero(~np.isfinite(vertices).all(axis=1))[0])
        raise MessageRefused(f"vertex {bad} of the mesh is not finite")
    if int(triangles.max()) >= len(vertices):
        bad = int(np.flatnonzero((triangles >= len(vertices)).any(axis=1))[0])
        raise MessageRefused(f"triangle {bad} of the mesh names a vertex beyond the last one, {len(vertices) - 1}")
    return MeshSurvey(frame.points(vertices.astype(np.float64), frame_id), triangles.astype(np.int32))


def cdr_of_mesh(survey: MeshSurvey) -> bytes:
    """Return the CDR bytes of a shape_msgs/Mesh, ready for `Publisher.publish`."""
    triangles = np.ascontiguousarray(survey.triangles, dtype="<u4").tobytes()
    vertices = np.ascontiguousarray(survey.vertices, dtype="<f8").tobytes()
    counted = struct.pack("<I", len(survey.triangles)) + triangles + struct.pack("<I", len(survey.vertices))
    return LITTLE_ENDIAN_CDR + counted + bytes(-len(counted) % 8) + vertices


def check_mesh(data: Buffer, most: int = MOST_POINTS) -> None:
    """Check the layout and the sizes of the CDR bytes of a mesh without reading its vertices; takes microseconds.

    most : largest number of vertices; twice as many triangles are allowed

    Raises MessageRefused if the layout or a size is wrong.
    """
    _split_mesh(data, most)


def same_bytes(one: Buffer, other: Buffer) -> bool:
    """True if two messages have the same bytes.

    A message of 56 MB takes 20 ms; other threads continue during the comparison.
    """
    return len(one) == len(other) and bool(np.array_equal(np.frombuffer(one, "u1"), np.frombuffer(other, "u1")))


def _check_count(points: int, most: int) -> None:
    try:
        check_points(points, most)
    except TerrainError as refusal:
        raise MessageRefused(str(refusal)) from None


def _split_mesh(data: Buffer, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles (F, 3) u32 and vertices (V, 3) f64 of a mesh message as views, after a check of all lengths."""
    if bytes(data[:HEADER]) != LITTLE_ENDIAN_CDR:
        raise MessageRefused("the mesh is not little-endian CDR (00 01 00 00), the only encapsulation rpf3d reads")
    n_triangles = _count(data, HEADER, "triangles")
    _check_count(n_triangles // 2, most)
    after_triangles = HEADER + COUNT + TRIANGLE * n_triangles
    n_vertices = _count(data, after_triangles, "vertices")
    _check_count(n_vertices, most)
    start = after_triangles + COUNT + (-(after_triangles + COUNT - HEADER) % 8)
    _check_end(data, start + VERTEX * n_vertices, f"its {n_vertices} vertices")
    triangles = np.frombuffer(data, "<u4", 3 * n_triangles, HEADER + COUNT).reshape(-1, 3)
    vertices = np.frombuffer(data, "<f8", 3 * n_vertices, start).reshape(-1, 3)
    return triangles, vertices


def _count(data: Buffer, offset: int, what: str) -> int:
    _check_end(data, offset + COUNT, f"the number of its {what}")
    (count,) = struct.unpack_from("<I", data, offset)
    if count == 0:
        raise MessageRefused(f"the mesh holds no {what}")
    return int(count)


def _check_end(data: Buffer, end: int, what: str) -> None:
    if end > len(data):
        raise MessageRefused(f"the mesh ends after {len(data)} bytes; {what} would end at byte {end}")
