"""geometry_msgs/PoseArray <-> sources: a pose stands where a rock is released, its x axis points where it is thrown."""

from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from std_msgs.msg import Header

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.map_frame import MapFrame
from rpf3d_ros.refusals import MessageRefused
from rpf3d_ros.source_reading import placed


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
    positions, directions = placed(poses, frame)
    if not len(positions):
        raise MessageRefused("the PoseArray holds no poses; it needs one for each rock")
    return Sources(Header(stamp=poses.header.stamp, frame_id=frame.name), positions, directions)


def poses_of_sources(header: Header, positions: FloatArray, velocities: FloatArray) -> PoseArray:
    """Poses of R sources at positions (R, 3) m whose x axes point along velocities (R, 3) m/s; speed is not sent."""
    turns = quaternions_along(velocities)
    poses = [
        Pose(position=_point(position), orientation=Quaternion(x=t[0], y=t[1], z=t[2], w=t[3]))
        for position, t in zip(positions.tolist(), turns.tolist(), strict=True)
    ]
    return PoseArray(header=header, poses=poses)


def quaternions_along(velocities: FloatArray) -> FloatArray:
    """Quaternions (R, 4) x, y, z, w that turn the x axis along velocities (R, 3), without roll; identity where zero."""
    vx, vy, vz = velocities.T
    yaw, pitch = np.arctan2(vy, vx) / 2, -np.arctan2(vz, np.hypot(vx, vy)) / 2
    sy, cy, sp, cp = np.sin(yaw), np.cos(yaw), np.sin(pitch), np.cos(pitch)
    return np.stack([-sy * sp, cy * sp, sy * cp, cy * cp], axis=-1)


def _point(xyz: list[float]) -> Point:
    return Point(x=xyz[0], y=xyz[1], z=xyz[2])
