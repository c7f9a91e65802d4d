"""The messages of survey and radar in a benchmark, laid out once as bytes, so that publishing costs only a copy.

CDR has a message's stamp at bytes 4 to 12, after the encapsulation header. A laid-out message can therefore get a new
stamp in place.
"""

import struct
import time
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_ros.demo.shift_content import heights_at
from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.terrain_messages import COUNT, HEADER, MeshSurvey, cdr_of_mesh

Floats = NDArray[np.float64]
SECOND = 1_000_000_000
STAMP = slice(4, 12)
MARKER = 4
"""Bytes of an array of markers before the header of its first marker."""
FRAME = "map"
HIGHER = 0.02
"""Height (m) by which one point of a survey differs from the previous survey: an identical survey would be ignored."""


class Heights:
    """The ground of a terrain as heights over the plan, map frame."""

    def __init__(self, terrain: Terrain) -> None:
        self._origin = np.array(terrain.frame.origin)
        self._facets = facets_of(terrain)
        self._engine: Engine = engine_of("compiled", self._facets)

    def at(self, plan: Floats) -> Floats:
        """Return the heights z (N,) m of the ground at positions (N, 2) m; NaN where there is no ground."""
        x, y = (plan - self._origin[:2]).T
        return heights_at(self._engine, self._facets, x, y) + self._origin[2]

    def grid(self, west: float, south: float, step: float, columns: int, rows: int) -> Floats:
        """Return the points (rows, columns, 3) m of a grid from its south-western corner."""
        x, y = np.meshgrid(west + step * np.arange(columns), south + step * np.arange(rows))
        return np.stack([x, y, self.at(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)], axis=-1)


def mesh_bytes(terrain: Terrain) -> bytearray:
    """Return the shape_msgs/Mesh of a terrain, map frame."""
    vertices = terrain.frame.points_to_input(terrain.vertices)
    return bytearray(cdr_of_mesh(MeshSurvey(vertices, terrain.triangles)))


def raise_mesh(data: bytes | bytearray, number: int) -> bytes:
    """Return the mesh with its first vertex raised, a little higher for each number."""
    (triangles,) = struct.unpack_from("<I", data, HEADER)
    after = COUNT + 12 * triangles + COUNT
    z = HEADER + after + (-after % 8) + 16
    (height,) = struct.unpack_from("<d", data, z)
    changed = bytearray(data)
    struct.pack_into("<d", changed, z, height + HIGHER * number)
    return bytes(changed)


def cloud_bytes(points: Floats) -> bytes:
    """Return a PointCloud2 of points (H, W, 3) or (N, 3) m, float32, without a stamp."""
    header = Header(frame_id=FRAME)
    cloud = cloud_of_columns(header, {name: points[..., i] for i, name in enumerate("xyz")})
    return bytes(serialize_message(cloud))


def stamped(data: bytes, at_ns: int | None = None) -> bytes:
    """Return a message that begins with a header, with a new stamp (ns); the current time if at_ns is None."""
    at = time.time_ns() if at_ns is None else at_ns
    return data[: STAMP.start] + struct.pack("<iI", at // SECOND, at % SECOND) + data[STAMP.stop :]


def stamp_of(data: bytes) -> int:
    """Return the stamp (ns) of a message that begins with a header."""
    sec, nanosec = struct.unpack_from("<iI", data, STAMP.start)
    return int(sec) * SECOND + int(nanosec)


def poses(places: Floats, at_ns: int = 0) -> Any:
    """Return sources at positions (S, 3) m, thrown eastwards."""
    each = [Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0)) for x, y, z in places.tolist()]
    stamp = Time(sec=at_ns // SECOND, nanosec=at_ns % SECOND)
    return PoseArray(header=Header(stamp=stamp, frame_id=FRAME), poses=each)
