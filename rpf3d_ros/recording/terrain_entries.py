"""Convert surveys to recording entries: the terrain, and the patches on the terrain."""

import hashlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rpf3d_ros.interface.transforms import MESH_HAS_NO_STAMP, InputFrames
from rpf3d_ros.messages.cloud_reading import positions_of_cloud
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.survey_mesh import ground_mesh
from rpf3d_ros.messages.terrain_messages import MeshSurvey, mesh_of_cdr, survey_of_cloud
from rpf3d_ros.recording.entries import EntryMaker, EntryTimes, RecordingEntry, frame_of, nanoseconds

UPDATES_SHOWN = 200
"""Largest number of terrain patches that are shown together; the next patch replaces the oldest."""

LARGEST_PATCH = 10_000_000
"""Largest number of points in a patch."""


class TerrainEntries:
    """Converts surveys to entries of a recording.

    A whole survey that repeats the last whole survey gives no entry, unless a patch was recorded in between.
    """

    def __init__(self, frames: InputFrames, mesh_frame: str, times: EntryTimes) -> None:
        """Start with no terrain.

        frames : the frames of the inputs; mesh_frame : name of the frame of terrain/mesh
        times : gives each entry its time and event
        """
        self._frames, self._mesh_frame, self._times = frames, mesh_frame, times
        self._digest, self._updates = b"", 0

    def makers(self) -> Mapping[str, EntryMaker]:
        """Return the methods that convert messages to entries, by the topic of the messages."""
        return {"terrain/points": self.cloud, "terrain/mesh": self.mesh, "terrain/update": self.update}

    def cloud(self, cloud: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of a terrain as points, in rows or scattered; nothing if the cloud repeats the last survey.

        Raises MessageRefused, and TerrainError if the points make no triangle.
        """
        survey = survey_of_cloud(cloud, frame_of(cloud, self._frames))
        digest = hashlib.sha256(survey.points.tobytes()).digest()
        if digest != self._digest:
            yield self._terrain(ground_mesh(survey), digest, nanoseconds(cloud.header.stamp))

    def mesh(self, data: bytes) -> Iterator[RecordingEntry]:
        """Yield the entry of a terrain as a mesh (CDR bytes); nothing if the mesh repeats the last survey.

        The entry has the current time, because a mesh has no stamp.
        """
        frame = self._frames.static(self._mesh_frame, MESH_HAS_NO_STAMP)
        digest = hashlib.sha256(data).digest() + b"".join(each.tobytes() for each in (frame.other or ())[1:])
        if digest != self._digest:
            yield self._terrain(mesh_of_cdr(data, frame, self._mesh_frame), digest, self._times.now())

    def update(self, cloud: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of a patch of the terrain, without its NaN points.

        Raises MessageRefused for a patch with more than LARGEST_PATCH points.
        """
        if cloud.width * cloud.height > LARGEST_PATCH:
            raise MessageRefused(
                f"the patch has {cloud.width * cloud.height} points; at most {LARGEST_PATCH} are shown"
            )
        frame = frame_of(cloud, self._frames)
        points = frame.points(positions_of_cloud(cloud).reshape(-1, 3), cloud.header.frame_id)
        points = points[~np.isnan(points).any(axis=1)]
        number = self._updates % UPDATES_SHOWN
        self._digest, self._updates = b"", self._updates + 1  # an equal survey is then drawn again, without the patch
        stamp_ns = nanoseconds(cloud.header.stamp)
        yield self._times.at(stamp_ns, lambda r: r.update(number, points), f"terrain/updates/{number}")

    def _terrain(self, mesh: MeshSurvey, digest: bytes, stamp_ns: int) -> RecordingEntry:
        self._digest, self._updates = digest, 0
        return self._times.at(stamp_ns, lambda r: r.terrain(mesh.vertices, mesh.triangles), "terrain")
