"""Make the ROS messages of a combination of the campaign, damage them, and serialize terrain messages."""

from typing import Any

import numpy as np
from geometry_msgs.msg import Point, PointStamped, Pose, PoseArray, Quaternion
from messages.live_peer import cloud, header, polygon
from never_green.pit import THROW
from never_green.plan import Send
from rclpy.serialization import serialize_message

from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh

SECOND = 1_000_000_000
SPEED = float(np.linalg.norm(THROW))
"""Speed (m/s) of thrown sources; the parameter `release_speed` of the node, because a pose has only a direction."""

TERRAIN = ("grid", "mesh", "patch")
"""Kinds of messages that the node receives as CDR bytes, together with their time of publication."""


def message_of(send: Send, stamp_ns: int) -> Any:
    """Return the message of a `Send`, with its damage; a mesh is returned as CDR bytes.

    stamp_ns : stamp (ns); negative stamps become 0
    """
    made = _made(send, max(stamp_ns, 0))
    return made if send.damage is None else send.damage(made)


def bytes_of(message: Any) -> bytes:
    """Return the CDR bytes of a terrain message; bytes are returned unchanged."""
    return message if isinstance(message, bytes) else serialize_message(message)


def _made(send: Send, stamp_ns: int) -> Any:
    if send.kind in ("grid", "patch"):
        return cloud(send.places, stamp_ns, send.frame)
    if send.kind == "cloud":
        return _source_cloud(send, stamp_ns)
    if send.kind == "mesh":
        return cdr_of_mesh(grid_mesh(send.places))
    if send.kind == "point":
        x, y, z = send.places[0].tolist()
        return PointStamped(header=header(stamp_ns, send.frame), point=Point(x=x, y=y, z=z))
    if send.kind == "polygon":
        return polygon(send.places.tolist(), stamp_ns, send.frame)
    return _poses(send, stamp_ns)


def _source_cloud(send: Send, stamp_ns: int) -> Any:
    """Return a cloud of sources; only a cloud of thrown sources has fields of velocities."""
    places = send.places.reshape(-1, 3)
    if not send.is_thrown:
        return cloud(places, stamp_ns, send.frame)
    columns = np.column_stack([places, np.tile(THROW, (len(places), 1))])
    names = ("x", "y", "z", "vx", "vy", "vz")
    return cloud_of_columns(header(stamp_ns, send.frame), dict(zip(names, columns.T, strict=True)))


def _poses(send: Send, stamp_ns: int) -> PoseArray:
    """Return a message of poses; without an orientation, which means at rest, unless they are thrown along THROW."""
    turn = Quaternion(z=1.0, w=0.0) if send.is_thrown else Quaternion(w=0.0)  # half a turn: -x
    each = [Pose(position=Point(x=x, y=y, z=z), orientation=turn) for x, y, z in send.places.tolist()]
    return PoseArray(header=header(stamp_ns, send.frame), poses=each)


def truncated(message: Any) -> Any:
    """Damage a message and return it.

    Bytes and clouds lose the second half of their data. The last pose of a PoseArray gets a quaternion that is not a
    rotation; a PoseArray without poses stays unchanged.
    """
    if isinstance(message, bytes):
        return message[: len(message) // 2]
    if isinstance(message, PoseArray) and not message.poses:
        return message
    if isinstance(message, PoseArray):
        message.poses[-1:] = [Pose(position=message.poses[-1].position, orientation=Quaternion(x=3.0, w=3.0))]
        return message
    message.data = message.data[: len(message.data) // 2]
    return message


def lengthened(mesh: bytes, count: int) -> bytes:
    """Return the CDR bytes of a mesh followed by more bytes, which have no meaning; count : their number."""
    return mesh + bytes(count)


def dense(message: Any) -> Any:
    """Mark a cloud as dense, so that no point may be NaN, and return it."""
    message.is_dense = True
    return message


def with_nan(places: np.ndarray, row: int) -> np.ndarray:
    """Return a copy of places (N, 3) m in which one place is NaN; row : its row, modulo N."""
    changed = np.array(places, dtype=float)
    changed[row % len(changed)] = np.nan
    return changed
