"""Convert messages of sources to recording entries: release points and directions of throw."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.interface.recorded_topics import CLOUD_SOURCES, POSE_SOURCES, RecordedSensors
from rpf3d_ros.interface.transforms import InputFrames
from rpf3d_ros.messages.source_reading import placed
from rpf3d_ros.recording.entries import (
    EntryMaker,
    EntryTimes,
    RecordingEntry,
    column_of,
    finite_points,
    finite_positions,
    frame_of,
)


class SourceEntries:
    """Converts messages of sources to entries of a recording; each new stamp begins an event.

    Each sensor whose topic is not a default topic has separate rows, because its messages have no information about
    other sensors.
    """

    def __init__(self, frames: InputFrames, times: EntryTimes, sensors: RecordedSensors) -> None:
        self._frames, self._times, self._sensors = frames, times, sensors

    def makers(self) -> Mapping[str, EntryMaker]:
        """Return the methods that convert messages to entries, by the topic of the messages."""
        return {
            "clicked_point": self.click,
            **{topic: partial(self.poses, sensor=_sensor_of(topic)) for topic in self._sensors.poses},
            **{topic: partial(self.cloud, sensor=_sensor_of(topic)) for topic in self._sensors.clouds},
        }

    def poses(self, poses: Any, sensor: str) -> Iterator[RecordingEntry]:
        """Yield the entry of the sources in a PoseArray; sensor : as in `Recording.sources`."""
        positions, directions = placed(poses, frame_of(poses, self._frames))
        yield self._entry(poses, positions, directions, sensor)

    def click(self, point: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of the single source at a clicked point."""
        at = np.array([[point.point.x, point.point.y, point.point.z]], dtype=float)
        frame = frame_of(point, self._frames)
        yield self._entry(point, finite_points(at, point.header.frame_id, frame), np.zeros((1, 3)))

    def cloud(self, cloud: Any, sensor: str) -> Iterator[RecordingEntry]:
        """Yield the entry of the sources in a cloud; a cloud without points means that no rock is moving.

        sensor : as in `Recording.sources`
        """
        frame = frame_of(cloud, self._frames)
        if cloud.width * cloud.height == 0:
            frame.check(cloud.header.frame_id)
            yield self._entry(cloud, np.empty((0, 3)), np.empty((0, 3)), sensor)
            return
        points = finite_positions(cloud, frame)
        names = [field.name for field in cloud.fields]
        directions = np.zeros_like(points)
        if {"vx", "vy", "vz"} <= set(names) and len(points):
            velocity = np.stack([column_of(cloud, name) for name in ("vx", "vy", "vz")], axis=-1).astype(float)
            with np.errstate(over="ignore"):
                speed = np.linalg.norm(velocity, axis=1, keepdims=True)
            directions = np.divide(velocity, speed, out=directions, where=(speed > 0.0) & np.isfinite(speed))
        yield self._entry(cloud, points, frame.directions(directions, cloud.header.frame_id), sensor)

    def _entry(self, message: Any, positions: FloatArray, directions: FloatArray, sensor: str = "") -> RecordingEntry:
        named = (sensor,) if sensor else ()
        return self._times.of_message(
            message, lambda r: r.sources(positions, directions, *named), "/".join(("sources", *named))
        )


def _sensor_of(topic: str) -> str:
    """Return the name of a topic's sensor in a recording: "" for the default topics, which share rows with clicks."""
    return "" if topic in (POSE_SOURCES, CLOUD_SOURCES) else topic
