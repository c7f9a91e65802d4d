"""Sources <- PoseArray, PointStamped and PointCloud2; PoseArray <- sources.

A pose stands where a rock is released, and its x axis points where it is thrown. An array without poses, or a cloud
without points, says that the walls are watched and nothing is seen: that is a message like any other.
"""

from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import Point, PointStamped, Pose, PoseArray, Quaternion
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from rpf3d_core.scene.releases import FASTEST
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.cloud_reading import columns_of_cloud, positions_of_cloud
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.source_reading import placed
from rpf3d_ros.messages.stamps import nanoseconds

MOST_SOURCES = 10_000
"""Of one message: a radar sees dozens of moving blocks, and a lidar's raw points are no sources."""

LARGEST_DIAMETER = 1.0e3
"""m, of a source that tells its size."""

VELOCITY = ("vx", "vy", "vz")


@dataclass(frozen=True, eq=False)
class Sources:
    """header : the message's, copied to every output, in the map frame
    positions : (S, 3) m, map frame; velocities : (S, 3) m/s; diameters : (S,) m, NaN where unknown, None where all are.
    """

    header: Header
    positions: FloatArray
    velocities: FloatArray
    diameters: FloatArray | None = None

    @property
    def stamp_ns(self) -> int:
        """The message's stamp."""
        return nanoseconds(self.header.stamp)

    @property
    def directions(self) -> FloatArray:
        """Where they are thrown, (S, 3) unit vectors; zero where they are not."""
        speed = np.linalg.norm(self.velocities, axis=1, keepdims=True)
        return np.asarray(np.divide(self.velocities, speed, out=np.zeros_like(self.velocities), where=speed > 0.0))


def sources_of_poses(poses: PoseArray, frame: MapFrame, speed: float = 1.0) -> Sources:
    """The sources of a message, one a pose, thrown with a speed (m/s); one without orientation is not thrown.

    Raises MessageRefused for a foreign frame, too many poses, and a pose that is not finite or not a rotation.
    """
    frame.check(poses.header.frame_id)
    _check_number(len(poses.poses))
    positions, directions = placed(poses, frame)
    return Sources(Header(stamp=poses.header.stamp, frame_id=frame.name), positions, speed * directions)


def sources_of_point(point: PointStamped, frame: MapFrame) -> Sources:
    """The one source of a point that somebody clicked; it falls from rest. Raises MessageRefused."""
    frame.check(point.header.frame_id)
    position = np.array([[point.point.x, point.point.y, point.point.z]])
    if not bool(np.isfinite(position).all()):
        raise MessageRefused("the point is not finite")
    return _sources(point.header, frame, position, np.zeros((1, 3)))


def sources_of_cloud(cloud: PointCloud2, frame: MapFrame) -> Sources:
    """The sources of a cloud x, y, z (m), where it has them with diameter (m) and vx, vy, vz (m/s).

    A point with a NaN in x, y, z is none, as in every cloud that is not dense; a NaN in its diameter says that it is
    not known. Raises MessageRefused as `columns_of_cloud`, and for a diameter or a velocity that no rock has.
    """
    frame.check(cloud.header.frame_id)
    _check_number(cloud.height * cloud.width)
    if cloud.height * cloud.width == 0:
        return _sources(cloud.header, frame, np.empty((0, 3)), np.empty((0, 3)))
    positions = positions_of_cloud(cloud).reshape(-1, 3)
    there = ~np.isnan(positions).any(axis=1)
    velocities, diameters = _velocities(cloud)[there], _diameters(cloud)
    diameters = None if diameters is None else _checked_diameters(diameters[there])
    return _sources(cloud.header, frame, positions[there], _checked_velocities(velocities), diameters)


def poses_of_sources(header: Header, positions: FloatArray, velocities: FloatArray) -> PoseArray:
    """Poses of S sources at positions (S, 3) m whose x axes point along velocities (S, 3) m/s; speed is not sent."""
    turns = quaternions_along(velocities)
    poses = [
        Pose(position=_point(position), orientation=Quaternion(x=t[0], y=t[1], z=t[2], w=t[3]))
        for position, t in zip(positions.tolist(), turns.tolist(), strict=True)
    ]
    return PoseArray(header=header, poses=poses)


def quaternions_along(velocities: FloatArray) -> FloatArray:
    """Quaternions (S, 4) x, y, z, w that turn the x axis along velocities (S, 3), without roll; identity where zero."""
    vx, vy, vz = velocities.T
    yaw, pitch = np.arctan2(vy, vx) / 2, -np.arctan2(vz, np.hypot(vx, vy)) / 2
    sy, cy, sp, cp = np.sin(yaw), np.cos(yaw), np.sin(pitch), np.cos(pitch)
    return np.stack([-sy * sp, cy * sp, sy * cp, cy * cp], axis=-1)


def _sources(
    header: Header, frame: MapFrame, positions: FloatArray, velocities: FloatArray, diameters: FloatArray | None = None
) -> Sources:
    """Sources in the map frame."""
    ours = Header(stamp=header.stamp, frame_id=frame.name)
    return Sources(ours, frame.points(positions, header.frame_id), velocities, diameters)


def _check_number(sources: int) -> None:
    if sources > MOST_SOURCES:
        raise MessageRefused(f"the message holds {sources:,} sources, more than the {MOST_SOURCES:,} that it may hold")


def _velocities(cloud: PointCloud2) -> FloatArray:
    """Velocities (N, 3) of a cloud; zero where it tells none. One or two of the three fields are refused as missing."""
    if not any(field.name in VELOCITY for field in cloud.fields):
        return np.zeros((cloud.height * cloud.width, 3))
    columns = columns_of_cloud(cloud, VELOCITY)
    return np.stack([columns[name].astype(np.float64).ravel() for name in VELOCITY], axis=-1)


def _checked_velocities(velocities: FloatArray) -> FloatArray:
    speed = np.sqrt((velocities * velocities).sum(axis=1))
    sound = speed <= FASTEST  # no NaN is
    if not bool(sound.all()):
        bad = int(np.flatnonzero(~sound)[0])
        raise MessageRefused(f"source {bad} has a speed of {speed[bad]:g} m/s; it must be from 0 to {FASTEST:g} m/s")
    return velocities


def _diameters(cloud: PointCloud2) -> FloatArray | None:
    """Diameters (N,) of a cloud; None where it tells none."""
    if not any(field.name == "diameter" for field in cloud.fields):
        return None
    return np.asarray(columns_of_cloud(cloud, ("diameter",))["diameter"].astype(np.float64).ravel())


def _checked_diameters(diameters: FloatArray) -> FloatArray:
    sound = np.isnan(diameters) | ((diameters > 0.0) & (diameters <= LARGEST_DIAMETER))
    if not bool(sound.all()):
        bad = int(np.flatnonzero(~sound)[0])
        raise MessageRefused(
            f"source {bad} has a diameter of {diameters[bad]:g} m; it must be above 0 and up to "
            f"{LARGEST_DIAMETER:g} m, or NaN where it is not known"
        )
    return diameters


def _point(xyz: list[float]) -> Point:
    return Point(x=xyz[0], y=xyz[1], z=xyz[2])
