"""Convert PoseArray, PointStamped and PointCloud2 messages to sources, and sources to a PoseArray.

The position of a pose is the release point of a rock; the x axis of the pose is the direction of its throw. An array
without poses, or a cloud without points, means that the walls are watched and no rock is moving. Such a message is
handled like any other.
"""

from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import Point, PointStamped, Pose, PoseArray, Quaternion
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from rpf3d_core.scene.releases import FASTEST
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.cloud_reading import columns_of_cloud, positions_of_cloud
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.source_fields import DIAMETER, VELOCITY, check_names
from rpf3d_ros.messages.source_reading import placed
from rpf3d_ros.messages.stamps import nanoseconds

MOST_SOURCES = 10_000
"""Largest number of sources in one message; a radar detects dozens of moving blocks.

A cloud of raw lidar points is therefore refused.
"""

SMALLEST_DIAMETER, LARGEST_DIAMETER = 1.0e-3, 100.0
"""Range of accepted diameters (m) of a source in a message; any other value is a wrong unit or a wrong field."""

IDENTITY = (0.0, 0.0, 0.0, 1.0)
"""Quaternion x, y, z, w without rotation, which is the default of many programs."""


@dataclass(frozen=True, eq=False)
class Sources:
    """The S sources of one message.

    header : stamp of the message, and name of the map frame
    positions : (S, 3) m, map frame
    velocities : (S, 3) m/s
    diameters : (S,) m, NaN if unknown; None if no source has a diameter
    """

    header: Header
    positions: FloatArray
    velocities: FloatArray
    diameters: FloatArray | None = None

    @property
    def stamp_ns(self) -> int:
        """The stamp of the message (ns)."""
        return nanoseconds(self.header.stamp)


def sources_of_poses(poses: PoseArray, frame: MapFrame, speed: float = 1.0) -> Sources:
    """Return the sources in a pose message: one for each pose, thrown at a speed (m/s) along its x axis.

    A pose without orientation (a quaternion of four zeros) becomes a source at rest.

    Raises MessageRefused in the cases of `placed`, and for more than MOST_SOURCES poses.
    """
    frame.check(poses.header.frame_id)
    _check_number(len(poses.poses))
    positions, directions = placed(poses, frame)
    return Sources(
        header=Header(stamp=poses.header.stamp, frame_id=frame.name), positions=positions, velocities=speed * directions
    )


def doubt_of_poses(poses: PoseArray, speed: float) -> str:
    """Return a warning if rocks may be thrown in a direction that the publisher did not intend; "" otherwise.

    If no pose of a message is rotated, its orientations may be the default values of a program that knows no direction.

    speed : speed (m/s) of the throw along the x axis of a pose
    """
    turns = [(one.orientation.x, one.orientation.y, one.orientation.z, one.orientation.w) for one in poses.poses]
    if not turns or speed == 0.0 or any(turn != IDENTITY for turn in turns):
        return ""
    return (
        f"all poses are without rotation, so all rocks are thrown along the x axis of {poses.header.frame_id} at "
        f"{speed:g} m/s: is this intended? A quaternion of four zeros means a release from rest"
    )


def sources_of_point(point: PointStamped, frame: MapFrame) -> Sources:
    """Return the single source at a clicked point; the source starts at rest.

    Raises MessageRefused in the cases of `MapFrame.points`, and for a point that is not finite.
    """
    frame.check(point.header.frame_id)
    position = np.array([[point.point.x, point.point.y, point.point.z]])
    if not bool(np.isfinite(position).all()):
        raise MessageRefused("the point is not finite")
    return _sources(point.header, frame, position, np.zeros((1, 3)))


def sources_of_cloud(cloud: PointCloud2, frame: MapFrame) -> Sources:
    """Return the sources in a point cloud: x, y, z (m), with optional fields diameter (m) and vx, vy, vz (m/s).

    Without vx, vy, vz all sources are at rest. A NaN in diameter means that the diameter is unknown. A cloud without
    points gives no sources.

    Raises MessageRefused in the cases of `positions_of_cloud`, `columns_of_cloud`, `check_names` and `MapFrame.points`.
    Also refused are more than MOST_SOURCES points, a point with a NaN in x, y or z, a cloud that states 0 points but
    contains data, rows with room for further points (they may be sources that the publisher forgot to announce), and an
    impossible diameter or velocity.
    """
    frame.check(cloud.header.frame_id)
    _check_number(cloud.height * cloud.width)
    check_names([field.name for field in cloud.fields])
    if cloud.height * cloud.width == 0:
        _check_no_data(cloud)
        return _sources(cloud.header, frame, np.empty((0, 3)), np.empty((0, 3)))
    _check_rows(cloud)
    positions = positions_of_cloud(cloud).reshape(-1, 3)
    there = _known_points(np.isnan(positions))
    velocities, diameters = _velocities(cloud)[there], _diameters(cloud)
    diameters = None if diameters is None else _checked_diameters(diameters[there])
    return _sources(cloud.header, frame, positions[there], _checked_velocities(velocities), diameters)


def _check_rows(cloud: PointCloud2) -> None:
    if cloud.row_step - cloud.width * cloud.point_step >= cloud.point_step:
        raise MessageRefused(
            f"row_step is {cloud.row_step}, room for more points than the {cloud.width} of a row that are announced"
        )


def _known_points(unknown: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return flags (N,), all True, if every point of a cloud has a position; otherwise raise MessageRefused.

    A point without a position may be a dangerous source whose place the sensor does not know.

    unknown : (N, 3), True where x, y or z is NaN
    """
    there = ~unknown.any(axis=1)
    if bool(there.any()) and not bool(there.all()):
        raise MessageRefused(f"point {np.argmin(there)} has a NaN in x, y or z: a source at an unknown place; if there "
                             "is no source, leave such points out of the cloud")  # fmt: skip
    if not bool(there.any()):
        raise MessageRefused(f"all its {len(unknown):,} points are NaN, so the places of sources are unknown; "
                             "publish a cloud without points if the sensor sees no sources")  # fmt: skip
    return there


def poses_of_sources(header: Header, positions: FloatArray, velocities: FloatArray) -> PoseArray:
    """Return sources as a pose message, one pose for each; speeds are not part of the message.

    positions : (S, 3) m and velocities : (S, 3) m/s, in the frame of `header`; the x axis of a pose points along the
        velocity of the source, or is not rotated if the velocity is zero
    """
    turns = quaternions_along(velocities)
    poses = [
        Pose(position=_point(position), orientation=Quaternion(x=t[0], y=t[1], z=t[2], w=t[3]))
        for position, t in zip(positions.tolist(), turns.tolist(), strict=True)
    ]
    return PoseArray(header=header, poses=poses)


def quaternions_along(velocities: FloatArray) -> FloatArray:
    """Return quaternions (S, 4) x, y, z, w that turn the x axis into the directions of velocities (S, 3).

    There is no roll. The quaternion of a zero velocity is the identity.
    """
    vx, vy, vz = velocities.T
    yaw, pitch = np.arctan2(vy, vx) / 2, -np.arctan2(vz, np.hypot(vx, vy)) / 2
    sy, cy, sp, cp = np.sin(yaw), np.cos(yaw), np.sin(pitch), np.cos(pitch)
    return np.stack([-sy * sp, cy * sp, sy * cp, cy * cp], axis=-1)


def _sources(
    header: Header, frame: MapFrame, positions: FloatArray, velocities: FloatArray, diameters: FloatArray | None = None
) -> Sources:
    """Return the sources of a message, converted to the map frame.

    positions : (S, 3) m and velocities : (S, 3) m/s, in the frame of `header`
    diameters : (S,) m, NaN if unknown; None if no source has a diameter
    """
    ours = Header(stamp=header.stamp, frame_id=frame.name)
    return Sources(
        header=ours, positions=frame.points(positions, header.frame_id),
        velocities=frame.directions(velocities, header.frame_id), diameters=diameters,
    )  # fmt: skip


def _check_no_data(cloud: PointCloud2) -> None:
    """Refuse a cloud of 0 points that has data, a width or a `row_step`: its points may have been lost.

    Such a cloud does not prove that no rock is moving.
    """
    if len(cloud.data):
        raise MessageRefused(
            f"the cloud announces {cloud.height} x {cloud.width} points but has {len(cloud.data)} bytes"
        )
    if cloud.row_step * max(cloud.height, 1) > 0 or cloud.width > 0:
        raise MessageRefused(
            f"the cloud has no data, but announces rows of {cloud.width} points and {cloud.row_step} bytes (row_step): "
            "was its data lost? Publish a width and a row_step of 0 if the sensor sees no sources"
        )


def _check_number(sources: int) -> None:
    if sources > MOST_SOURCES:
        raise MessageRefused(f"the message has {sources:,} sources; at most {MOST_SOURCES:,} are allowed")


def _velocities(cloud: PointCloud2) -> FloatArray:
    """Return the velocities (N, 3) m/s of a cloud; zero if it has none of the fields vx, vy, vz.

    A cloud with only one or two of the three fields is refused, because the others are missing.
    """
    if not any(field.name in VELOCITY for field in cloud.fields):
        return np.zeros((cloud.height * cloud.width, 3))
    columns = columns_of_cloud(cloud, VELOCITY)
    return np.stack([columns[name].astype(np.float64).ravel() for name in VELOCITY], axis=-1)


def _checked_velocities(velocities: FloatArray) -> FloatArray:
    speed = np.sqrt((velocities * velocities).sum(axis=1))
    sound = speed <= FASTEST  # False for NaN
    if not bool(sound.all()):
        bad = int(np.flatnonzero(~sound)[0])
        raise MessageRefused(f"source {bad} has a speed of {speed[bad]:g} m/s; it must be from 0 to {FASTEST:g} m/s")
    return velocities


def _diameters(cloud: PointCloud2) -> FloatArray | None:
    """Return the diameters (N,) m of a cloud; None if the cloud has no field diameter."""
    if not any(field.name == DIAMETER for field in cloud.fields):
        return None
    return np.asarray(columns_of_cloud(cloud, (DIAMETER,))[DIAMETER].astype(np.float64).ravel())


def _checked_diameters(diameters: FloatArray) -> FloatArray:
    sound = np.isnan(diameters) | ((diameters >= SMALLEST_DIAMETER) & (diameters <= LARGEST_DIAMETER))
    if not bool(sound.all()):
        bad = int(np.flatnonzero(~sound)[0])
        raise MessageRefused(
            f"source {bad} has a diameter of {diameters[bad]:g} m; it must be from {SMALLEST_DIAMETER:g} to "
            f"{LARGEST_DIAMETER:g} m, or NaN where it is not known"
        )
    return diameters


def _point(xyz: list[float]) -> Point:
    return Point(x=xyz[0], y=xyz[1], z=xyz[2])
