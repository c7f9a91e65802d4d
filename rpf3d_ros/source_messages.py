"""geometry_msgs/PoseArray <-> sources: a pose stands where a rock is released, its x axis points where it is thrown."""

from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from std_msgs.msg import Header

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.map_frame import MapFrame
from rpf3d_ros.refusals import MessageRefused

UNIT_TOLERANCE = 1.0e-3
"""How far a quaternion's length may be from 1: one typed by hand with three decimals passes, a zero one does not."""


@dataclass(frozen=True, eq=False)
class Sources:
    """header : the message's, copied to every output, in the map frame
    positions : (R, 3) m, map frame; directions : (R, 3) unit, the poses' x axes, zero where a pose has no orientation.
    """

    header: Header
    positions: FloatArray
    directions: FloatArray


def sources_of_poses(poses: PoseArray, frame: MapFrame) -> Sources:
    """The sources of a message, one rock a pose; an all-zero orientation is a rock without direction.

    Raises MessageRefused for a foreign frame, no poses, and a pose that is not finite or not a rotation.
    """
    frame.check(poses.header.frame_id)
    if not poses.poses:
        raise MessageRefused("the PoseArray holds no poses; it needs one for each rock")
    positions = np.array([(p.position.x, p.position.y, p.position.z) for p in poses.poses])
    turns = np.array([(p.orientation.x, p.orientation.y, p.orientation.z, p.orientation.w) for p in poses.poses])
    _check_poses(positions, turns)
    header = Header(stamp=poses.header.stamp, frame_id=frame.name)
    return Sources(header, frame.points(positions, poses.header.frame_id), x_axes(turns))


def poses_of_sources(header: Header, positions: FloatArray, velocities: FloatArray) -> PoseArray:
    """Poses of R sources at positions (R, 3) m whose x axes point along velocities (R, 3) m/s; speed is not sent."""
    turns = quaternions_along(velocities)
    poses = [
        Pose(position=_point(position), orientation=Quaternion(x=t[0], y=t[1], z=t[2], w=t[3]))
        for position, t in zip(positions.tolist(), turns.tolist(), strict=True)
    ]
    return PoseArray(header=header, poses=poses)


def x_axes(turns: FloatArray) -> FloatArray:
    """First columns (R, 3) of the rotation matrices of unit quaternions (R, 4) x, y, z, w; zero for a zero one."""
    x, y, z, w = turns.T
    return np.stack([w * w + x * x - y * y - z * z, 2 * (x * y + z * w), 2 * (x * z - y * w)], axis=-1)


def quaternions_along(velocities: FloatArray) -> FloatArray:
    """Quaternions (R, 4) x, y, z, w that turn the x axis along velocities (R, 3), without roll; identity where zero."""
    vx, vy, vz = velocities.T
    yaw, pitch = np.arctan2(vy, vx) / 2, -np.arctan2(vz, np.hypot(vx, vy)) / 2
    sy, cy, sp, cp = np.sin(yaw), np.cos(yaw), np.sin(pitch), np.cos(pitch)
    return np.stack([-sy * sp, cy * sp, sy * cp, cy * cp], axis=-1)


def _check_poses(positions: FloatArray, turns: FloatArray) -> None:
    finite = np.isfinite(positions).all(axis=1) & np.isfinite(turns).all(axis=1)
    if not bool(finite.all()):
        raise MessageRefused(f"pose {int(np.flatnonzero(~finite)[0])} is not finite")
    length = np.linalg.norm(turns, axis=1)
    turned = (length == 0.0) | (np.abs(length - 1.0) <= UNIT_TOLERANCE)
    if not bool(turned.all()):
        bad = int(np.flatnonzero(~turned)[0])
        raise MessageRefused(f"the orientation of pose {bad} has length {length[bad]:.4g}; a quaternion has length 1")


def _point(xyz: list[float]) -> Point:
    return Point(x=xyz[0], y=xyz[1], z=xyz[2])
