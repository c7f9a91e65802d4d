"""Read release points and directions from a geometry_msgs/PoseArray.

The message may be an object of rclpy or, if read from a bag, of rosbags.
"""

from typing import TYPE_CHECKING

import numpy as np

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.map_frame import UNIT_TOLERANCE, MapFrame
from rpf3d_ros.messages.refusals import MessageRefused

if TYPE_CHECKING:
    from geometry_msgs.msg import PoseArray


def placed(poses: "PoseArray", frame: MapFrame) -> tuple[FloatArray, FloatArray]:
    """Return the positions (R, 3) m and the directions (R, 3) of the poses in a message, map frame.

    A direction is the x axis of a pose; it is zero for a quaternion of four zeros, which means "no direction". R is the
    number of poses, and may be 0.

    Raises MessageRefused in the cases of `MapFrame.points`, and for a pose that is not finite or not a rotation.
    """
    frame.check(poses.header.frame_id)
    at = positions_of(poses)
    turns = [(p.orientation.x, p.orientation.y, p.orientation.z, p.orientation.w) for p in poses.poses]
    axes = np.array(turns, dtype=float).reshape(-1, 4)
    _check_poses(at, axes)
    frame_id = poses.header.frame_id
    return frame.points(at, frame_id), frame.directions(x_axes(axes), frame_id)


def positions_of(poses: "PoseArray") -> FloatArray:
    """Return the positions (R, 3) m of the poses in a message, in the frame of the message, unchecked; R may be 0."""
    return np.array([(p.position.x, p.position.y, p.position.z) for p in poses.poses], dtype=float).reshape(-1, 3)


def x_axes(turns: FloatArray) -> FloatArray:
    """Return the x axis (R, 3), rotated by unit quaternions (R, 4) x, y, z, w; zero for a zero quaternion.

    The rotated x axis is the first column of the rotation matrix.
    """
    x, y, z, w = turns.T
    return np.stack([w * w + x * x - y * y - z * z, 2 * (x * y + z * w), 2 * (x * z - y * w)], axis=-1)


def _check_poses(positions: FloatArray, turns: FloatArray) -> None:
    finite = np.isfinite(positions).all(axis=1) & np.isfinite(turns).all(axis=1)
    if not bool(finite.all()):
        raise MessageRefused(f"pose {int(np.flatnonzero(~finite)[0])} is not finite")
    length = np.linalg.norm(turns, axis=1)  # a pose without orientation has length 0
    turned = (length == 0.0) | (np.abs(length - 1.0) <= UNIT_TOLERANCE)
    if not bool(turned.all()):
        bad = int(np.flatnonzero(~turned)[0])
        raise MessageRefused(f"the orientation of pose {bad} has length {length[bad]:.4g}; a quaternion has length 1")
