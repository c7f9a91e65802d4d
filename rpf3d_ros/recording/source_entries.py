"""Convert messages of sources to recording entries: release points and directions of throw."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rpf3d_core.terrain.frame import FloatArray
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
    """Converts messages of sources to entries of a recording; each new stamp begins an event."""

    def __init__(self, frames: InputFrames, times: EntryTimes) -> None:
        self._frames, self._times = frames, times

    def makers(self) -> Mapping[str, EntryMaker]:
        """Return the methods that convert messages to entries, by the topic of the messages."""
        return {"sources": self.poses, "clicked_point": self.click, "source_cloud": self.cloud}

    def poses(self, poses: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of the sources in a PoseArray."""
        positions, directions = placed(poses, frame_of(poses, self._frames))
        yield self._entry(poses, positions, directions)

    def click(self, point: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of the single source at a clicked point."""
        at = np.array([[point.point.x, point.point.y, point.point.z]], dtype=float)
        frame = frame_of(point, self._frames)
        yield self._entry(point, finite_points(at, point.header.frame_id, frame), np.zeros((1, 3)))

    def cloud(self, cloud: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of the sources in a cloud; a cloud without points means that no rock is moving."""
        frame = frame_of(cloud, self._frames)
        if cloud.width * cloud.height == 0:
            frame.check(cloud.header.frame_id)
            yield self._entry(cloud, np.empty((0, 3)), np.empty((0, 3)))
            return
        points = finite_positions(cloud, frame)
        names = [field.name for field in cloud.fields]
        directions = np.zeros_like(points)
        if {"vx", "vy", "vz"} <= set(names) and len(points):
            velocity = np.stack([column_of(cloud, name) for name in ("vx", "vy", "vz")], axis=-1).astype(float)
            with np.errstate(over="ignore"):
                speed = np.linalg.norm(velocity, axis=1, keepdims=True)
            directions = np.divide(velocity, speed, out=directions, where=(speed > 0.0) & np.isfinite(speed))
        yield self._entry(cloud, points, frame.directions(directions, cloud.header.frame_id))

    def _entry(self, message: Any, positions: FloatArray, directions: FloatArray) -> RecordingEntry:
        return self._times.of_message(message, lambda r: r.sources(positions, directions), "sources")
