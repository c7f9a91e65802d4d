"""Prepare the messages of survey and radar for a benchmark as bytes, so that publishing costs only a copy.

CDR, the byte format of ROS messages, has a message's stamp at bytes 4 to 12, after the encapsulation header. A prepared
message can therefore get a new stamp in place.
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
"""Number of additional bytes before the header of the first marker in a MarkerArray: the number of markers."""
FRAME = "map"
HIGHER = 0.02
"""Height (m) by which one point of a survey is raised from survey to survey, because the node ignores an equal survey.
"""


class Heights:
    """Finds heights of a terrain at places in plan, to make surveys of the terrain; all coordinates: map frame."""

    def __init__(self, terrain: Terrain) -> None:
        self._origin = np.array(terrain.frame.origin)
        self._facets = facets_of(terrain)
        self._engine: Engine = engine_of("compiled", self._facets)

    def at(self, plan: Floats) -> Floats:
        """Return the heights (N,) m of the ground at places (N, 2) m in plan; NaN where there is no ground."""
        x, y = (plan - self._origin[:2]).T
        return heights_at(self._engine, self._facets, x, y) + self._origin[2]

    def grid(self, west: float, south: float, step: float, columns: int, rows: int) -> Floats:
        """Return a grid of points (rows, columns, 3) m on the ground; west, south : corner (m); step : spacing (m)."""
        x, y = np.meshgrid(west + step * np.arange(columns), south + step * np.arange(rows))
        return np.stack([x, y, self.at(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)], axis=-1)


def mesh_bytes(terrain: Terrain) -> bytearray:
    """Return a terrain as the bytes of a shape_msgs/Mesh message, map frame."""
    vertices = terrain.frame.points_to_input(terrain.vertices)
    return bytearray(cdr_of_mesh(MeshSurvey(vertices, terrain.triangles)))


def raise_mesh(data: bytes | bytearray, number: int) -> bytes:
    """Return the bytes of a mesh message whose first vertex is raised by HIGHER (m) times `number`."""
    (triangles,) = struct.unpack_from("<I", data, HEADER)
    after = COUNT + 12 * triangles + COUNT
    z = HEADER + after + (-after % 8) + 16
    (height,) = struct.unpack_from("<d", data, z)
    changed = bytearray(data)
    struct.pack_into("<d", changed, z, height + HIGHER * number)
    return bytes(changed)


def cloud_bytes(points: Floats) -> bytes:
    """Return points (H, W, 3) or (N, 3) m as the bytes of a PointCloud2 message, float32, without a stamp."""
    header = Header(frame_id=FRAME)
    cloud = cloud_of_columns(header, {name: points[..., i] for i, name in enumerate("xyz")})
    return bytes(serialize_message(cloud))


def stamped(data: bytes, at_ns: int | None = None) -> bytes:
    """Return the bytes of a message with a new time stamp (ns); the current time if at_ns is None."""
    at = time.time_ns() if at_ns is None else at_ns
    return data[: STAMP.start] + struct.pack("<iI", at // SECOND, at % SECOND) + data[STAMP.stop :]


def stamp_of(data: bytes) -> int:
    """Return the time stamp (ns) of a message from its bytes; the message must begin with a header."""
    sec, nanosec = struct.unpack_from("<iI", data, STAMP.start)
    return int(sec) * SECOND + int(nanosec)


def poses(places: Floats, at_ns: int = 0) -> Any:
    """Return a PoseArray with sources of rocks at positions (S, 3) m, thrown eastwards; at_ns : its stamp (ns)."""
    each = [Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0)) for x, y, z in places.tolist()]
    stamp = Time(sec=at_ns // SECOND, nanosec=at_ns % SECOND)
    return PoseArray(header=Header(stamp=stamp, frame_id=FRAME), poses=each)
