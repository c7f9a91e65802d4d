"""Convert the messages of answers to recording entries: trajectories, impacts, deposits, hazard and results."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.grid_reading import percent_of_grid
from rpf3d_ros.messages.health import healths_of
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_reading import HAZARD, Colour, facets_of_markers, outlines_of_markers, strips_of_markers
from rpf3d_ros.messages.moving_rocks import motion_of
from rpf3d_ros.recording.entries import (
    EntryMaker,
    EntryTimes,
    LastContents,
    RecordingEntry,
    by_name,
    column_of,
    finite_positions,
)

REACH_COLUMNS = ("p95_energy", "first_arrival", "rocks", "result")
"""Optional fields of hazard/points that are recorded as well."""

NOTHING = np.empty(0)
"""Content of a map without cells, or of a cloud without points, to compare it with later content."""


class AnswerEntries:
    """Converts the messages of an answer to entries of a recording; all belong to the event of the answer's sources."""

    def __init__(self, frame: MapFrame, times: EntryTimes, last: LastContents | None = None) -> None:
        """Start with no answers.

        frame : the frame of the messages; times : gives each entry its time and event
        last : contents of the last recorded maps, so that an equal map is not recorded again; None to record every map
        """
        self._frame, self._times, self._last = frame, times, last
        self._levels: set[str] = set()

    def makers(self) -> Mapping[str, EntryMaker]:
        """Return the methods that convert messages to entries, by the topic of the messages."""
        clouds = {topic: partial(self.cloud, topic) for topic in ("trajectories/points", "impacts", "deposits")}
        return {
            **clouds,
            "trajectories": self.trajectories,
            "hazard/zones": self.zones,
            "hazard/points": self.reach,
            "hazard/grid": self.reach_grid,
            "results": self.results,
        }

    def trajectories(self, array: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of a message of `trajectories`: the rocks' lines, which the simulator has already thinned."""
        strips = strips_of_markers(array, self._frame)
        yield self._times.of_markers(array, lambda r: r.trajectories(strips))

    def cloud(self, topic: str, cloud: Any) -> Iterator[RecordingEntry]:
        """Yield the entries of a message of trajectories/points, impacts or deposits: its points, coloured by energy.

        For trajectories/points, also yield the motion of the rocks; for impacts, also the energies for the plots. A
        cloud without points deletes the points of the last event.
        """
        self._frame.check(cloud.header.frame_id)
        if cloud.width == 0:
            yield self._times.of_message(cloud, lambda r: r.clear(topic))
            return
        points = finite_positions(cloud, self._frame)
        energy = column_of(cloud, "energy")
        if topic == "trajectories/points":
            motion = motion_of(points, column_of(cloud, "t").astype(float), column_of(cloud, "rock"))
            yield self._times.of_message(cloud, lambda r: r.motion(motion))
        yield self._times.of_message(cloud, lambda r: r.points(topic, points, energy))
        if topic == "impacts":
            yield self._times.of_message(cloud, lambda r: r.energies(energy))

    def zones(self, array: Any) -> Iterator[RecordingEntry]:
        """Yield the entries of a message of hazard/zones, if its content is new.

        The first entries delete the zones of the previous message; the rest draws facets and outline of each zone.
        """
        levels = by_name(facets_of_markers(array, self._frame), HAZARD, "level")
        outlines = by_name(outlines_of_markers(array, self._frame), HAZARD, "level")
        if not self._is_new("hazard/zones", *_contents(levels, outlines)):
            return
        for level in sorted(self._levels):
            yield self._of_zone(array, level, lambda r, level=level: r.clear_hazard(level))
        self._levels = {*levels, *outlines}
        for level, (corners, colour) in levels.items():
            yield self._of_zone(array, level, lambda r, n=level, k=corners, c=colour: r.hazard(n, k, c))
        for level, (lines, colour) in outlines.items():
            yield self._of_zone(array, f"{level}/outline", lambda r, n=level, k=lines, c=colour: r.outline(n, k, c))

    def reach(self, cloud: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of a message of hazard/points (the map cells that rocks reached), if its content is new.

        Content is new if the positions, the reach probability or the number of rocks of a cell differ from the last
        recorded message; other fields are not compared. A cloud without points deletes the cells of the last event.
        """
        self._frame.check(cloud.header.frame_id)
        keeps = self._keeps("hazard/points")
        if cloud.width == 0:
            if self._is_new("hazard/points", NOTHING):
                yield self._times.of_message(cloud, lambda r: r.clear("hazard/points"), keeps)
            return
        points, reach = finite_positions(cloud, self._frame), column_of(cloud, "reach_probability")
        given = {field.name for field in cloud.fields}
        columns = {name: column_of(cloud, name) for name in REACH_COLUMNS if name in given}
        if self._is_new("hazard/points", points, reach, *(columns[name] for name in ("rocks",) if name in columns)):
            yield self._times.of_message(cloud, lambda r: r.reach(points, reach, columns), keeps)

    def reach_grid(self, grid: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of a message of hazard/grid, which draws reach probability in plan, if its content is new."""
        percent = percent_of_grid(grid, self._frame)
        if self._is_new("hazard/grid", percent):
            yield self._times.of_message(grid, lambda r: r.grid(percent), self._keeps("hazard/grid"))

    def _is_new(self, topic: str, *arrays: "np.ndarray") -> bool:
        return self._last is None or self._last.is_new(topic, *arrays)

    def _keeps(self, name: str) -> str:
        """Return the value of `RecordingEntry.keeps` for a map or a part of a map; "" if every map is recorded.

        If equal maps are not recorded again, every new file must begin with the last map.

        name : name of the map or of the part
        """
        return f"answer/{name}" if self._last is not None else ""

    def _of_zone(self, array: Any, name: str, draw: Callable[..., None]) -> RecordingEntry:
        return self._times.of_markers(array, draw, self._keeps(f"hazard/zones/{name}"))

    def results(self, array: Any) -> Iterator[RecordingEntry]:
        """Yield the entries of a message of `results`: the figures of an answer, as text."""
        for health in healths_of(array):
            yield self._times.of_message(array, lambda r, health=health: r.text("results", health))


def _contents(
    levels: Mapping[str, tuple[FloatArray, Colour]], outlines: Mapping[str, tuple[list[FloatArray], Colour]]
) -> "list[np.ndarray]":
    """Return names, facets, lines and colours of hazard zones as arrays, to compare them.

    levels : name -> corners (F, 3, 3) m of the facets, and colour; outlines : name -> lines (T, 3) m, and colour
    """
    named = [np.array([*levels, "", *outlines])]
    facets = [part for corners, colour in levels.values() for part in (corners, np.array(colour))]
    return [*named, *facets, *(part for lines, colour in outlines.values() for part in (*lines, np.array(colour)))]
