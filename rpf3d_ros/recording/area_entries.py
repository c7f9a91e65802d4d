"""Convert messages of areas of interest to recording entries: definitions, and outlines on the ground."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.interface.transforms import AREAS_STAY, InputFrames
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_reading import AREAS, outlines_of_markers
from rpf3d_ros.messages.source_reading import positions_of
from rpf3d_ros.recording.entries import (
    EntryMaker,
    EntryTimes,
    LoggedStates,
    RecordingEntry,
    by_name,
    finite_points,
    nanoseconds,
)


class AreaEntries:
    """Converts messages of areas of interest to entries of a recording."""

    def __init__(self, frame: MapFrame, frames: InputFrames, times: EntryTimes) -> None:
        """Start with no areas; attribute `rings` has the outlines (T, 3) m of each area, by name, map frame.

        frame : the frame of the outlines that the simulator publishes; frames : the frames of the inputs
        """
        self._frame, self._frames, self._times = frame, frames, times
        self._logged = LoggedStates()
        self._outlined: set[str] = set()
        self.rings: Mapping[str, list[FloatArray]] = {}

    def makers(self) -> Mapping[str, EntryMaker]:
        """Return the methods that convert messages to entries, by the topic of the messages."""
        return {"areas/polygon": self.polygon, "areas/equipment": self.equipment, "areas/outlines": self.outlines}

    def _frame_of(self, message: Any) -> MapFrame:
        return self._frames.static(message.header.frame_id, AREAS_STAY)

    def polygon(self, polygon: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of a message of areas/polygon: the outline of the live area as it was received."""
        corners = np.array([(p.x, p.y, p.z) for p in polygon.polygon.points], dtype=float).reshape(-1, 3)
        corners = finite_points(corners, polygon.header.frame_id, self._frame_of(polygon))
        stamp_ns = nanoseconds(polygon.header.stamp)
        yield self._times.at(stamp_ns, lambda r: r.area("live_area", corners), "areas/live_area")

    def equipment(self, poses: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of a message of areas/equipment: the places of equipment, as points."""
        positions = finite_points(positions_of(poses), poses.header.frame_id, self._frame_of(poses))
        stamp_ns = nanoseconds(poses.header.stamp)
        yield self._times.at(stamp_ns, lambda r: r.places("equipment", positions), "areas/equipment")

    def outlines(self, array: Any) -> Iterator[RecordingEntry]:
        """Yield the entries of a message of areas/outlines: draw changed outlines, delete outlines that it lacks.

        The entries have the time of its reception, not its stamp, because an answer to older sources may contain newer
        areas.
        """
        areas = by_name(outlines_of_markers(array, self._frame), AREAS, "name")
        for name in sorted(self._outlined - set(areas)):
            self._logged.forget(name)
            yield self._times.at(self._times.now(), lambda r, n=name: r.clear_area(n), f"outline/{name}")
        self._outlined = set(areas)
        self.rings = {name: lines for name, (lines, _) in areas.items()}
        for name, (lines, _) in areas.items():
            if self._logged.is_new(name, [line.tobytes() for line in lines]):
                now_ns = self._times.now()
                yield self._times.at(now_ns, lambda r, n=name, k=lines: r.area_outline(n, k), f"outline/{name}")
