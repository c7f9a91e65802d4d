"""Convert the rocks of an answer to recording entries, thinned: fewer rocks, and fewer points on each path."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.colours import speed_colours
from rpf3d_core.ensemble.paths import evenly, run_starts
from rpf3d_core.live.areas import reached_by
from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_reading import Strip
from rpf3d_ros.messages.moving_rocks import motion_of
from rpf3d_ros.recording.answer_entries import NOTHING, AnswerEntries
from rpf3d_ros.recording.entries import (
    EntryMaker,
    EntryTimes,
    LastContents,
    RecordingEntry,
    column_of,
    finite_positions,
    nanoseconds,
)
from rpf3d_ros.recording.thinning import POINTS_A_ROCK
from rpf3d_ros.recording.waiting import HeldLines

PATHS = "trajectories/points"
LINES = "trajectories"
Areas = Callable[[], Mapping[str, Sequence[FloatArray]]]
"""A function that returns the outlines (T, 3) m of each area of interest, by name, map frame."""


class RockEntries:
    """Converts the rocks of each answer to entries of a recording: the same chosen rocks in all topics of an answer.

    The paths of the rocks are drawn as lines from trajectories/points, which contains every rock. The published line
    markers are drawn only if no such points arrive; the markers wait in `held` until this is known.
    """

    def __init__(self, frame: MapFrame, times: EntryTimes, areas: Areas, most: int) -> None:
        """Start with no rocks.

        frame : the frame of the messages; times : gives each entry its time and event
        areas : returns the current outlines; most : number of recorded rocks of an answer, 0: all
        """
        self._frame, self._times, self._areas, self._most = frame, times, areas, most
        self._whole, self._last = AnswerEntries(frame, times), LastContents()
        self._chosen: tuple[int, IntArray] | None = None
        self._lines_of: int | None = None
        self.held = HeldLines()

    def makers(self) -> Mapping[str, EntryMaker]:
        """Return the methods that convert messages to entries, by the topic of the messages."""
        hits = {topic: partial(self.hits, topic) for topic in ("impacts", "deposits")}
        return {LINES: self.lines, PATHS: self.paths, **hits}

    def lines(self, array: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of the published line markers of an answer, unless lines were already drawn from its points.
        """
        stamp_ns = nanoseconds(array.markers[0].header.stamp) if array.markers else None
        if stamp_ns is None or stamp_ns != self._lines_of:
            yield from self._whole.trajectories(array)

    def paths(self, cloud: Any) -> Iterator[RecordingEntry]:
        """Yield the entries for motion, points and lines of the rocks chosen from a cloud of trajectories/points.

        Lines are drawn only if the cloud has a field `speed`. Yield nothing if the points and areas are the same as in
        the previous answer. A cloud without points yields, once, entries that delete the points and lines of the last
        event.
        """
        if cloud.width == 0:
            cleared = list(self._cleared(PATHS, cloud))
            yield from cleared
            self._lines_of = nanoseconds(cloud.header.stamp)
            self.held.drop()
            if cleared:
                yield self._times.of_message(cloud, lambda r: r.trajectories([]), _kept(LINES))
            return
        points, rock, t = finite_positions(cloud, self._frame), column_of(cloud, "rock"), column_of(cloud, "t")
        energy, stamp_ns = column_of(cloud, "energy"), nanoseconds(cloud.header.stamp)
        content = points, rock, t, energy, *(ring for rings in self._areas().values() for ring in rings)
        speed = column_of(cloud, "speed") if _has(cloud, "speed") else None
        if self._last.differs(PATHS, *content):
            rocks = self._choice(points, rock)
            shown = np.flatnonzero(np.isin(rock, rocks))
            motion = motion_of(points[shown], t[shown].astype(float), rock[shown])
            self._last.note(PATHS, *content)
            self._chosen = stamp_ns, rocks
            yield self._times.of_message(cloud, lambda r: r.motion(motion))
            yield from self._drawn_paths(cloud, points, energy, self._rows(shown, rock[shown]), speed)
        elif self._chosen is not None:
            self._chosen = stamp_ns, self._chosen[1]
        if speed is not None:
            self._lines_of = stamp_ns
            self.held.drop()

    def _drawn_paths(
        self, cloud: Any, points: FloatArray, energy: FloatArray, rows: list[IntArray], speed: FloatArray | None
    ) -> Iterator[RecordingEntry]:
        """Yield the points and, if `speed` is known, the lines of the chosen rocks.

        points : (N, 3) m; energy : (N,) J; speed : (N,) m/s, or None; rows : for each rock, the rows of its points
        """
        every = np.concatenate([np.empty(0, dtype=np.int64), *rows])
        yield self._times.of_message(cloud, lambda r: r.points(PATHS, points[every], energy[every]), _kept(PATHS))
        if speed is not None:
            strips = _strips(points, speed, rows)
            yield self._times.of_message(cloud, lambda r: r.trajectories(strips), _kept(LINES))

    def hits(self, topic: str, cloud: Any) -> Iterator[RecordingEntry]:
        """Yield the impacts or deposits of the chosen rocks; for impacts, also the energies of all rocks' impacts.

        Yield nothing if the content is the same as in the previous answer. A cloud without points deletes the points of
        the last event.
        """
        if cloud.width == 0:
            yield from self._cleared(topic, cloud)
            return
        points, energy = finite_positions(cloud, self._frame), column_of(cloud, "energy")
        shown = self._shown(cloud, points)
        if not self._last.is_new(topic, points, energy, shown):
            return
        yield self._times.of_message(cloud, lambda r: r.points(topic, points[shown], energy[shown]), _kept(topic))
        if topic == "impacts":
            yield self._times.of_message(cloud, lambda r: r.energies(energy))

    def _cleared(self, topic: str, cloud: Any) -> Iterator[RecordingEntry]:
        """Yield the entry of a cloud without points, which deletes the points of the last event.

        Yield nothing if the points are already deleted.
        """
        for entry in self._whole.cloud(topic, cloud):
            if self._last.is_new(topic, NOTHING):
                yield entry._replace(keeps=_kept(topic))

    def _shown(self, cloud: Any, points: FloatArray) -> NDArray[np.bool_]:
        """Return flags (N,), True for points of the chosen rocks: the same rocks as in the paths of the answer.

        If no paths of the answer have arrived, the rocks are chosen from the points. If the cloud has no field `rock`,
        all flags are True.

        points : (N, 3) m, the points of the cloud
        """
        if not _has(cloud, "rock"):
            return np.ones(len(points), dtype=bool)
        rock, stamp_ns = column_of(cloud, "rock"), nanoseconds(cloud.header.stamp)
        if self._chosen is None or self._chosen[0] != stamp_ns:
            return np.isin(rock, self._choice(points, rock))
        return np.isin(rock, self._chosen[1])

    def _rows(self, rows: IntArray, rock: IntArray) -> list[IntArray]:
        """Return the rows of the cloud with the recorded points of each chosen rock: one array for each rock.

        rows : (N,) rows of all points of the chosen rocks; rock : (N,) rock of each of these points, grouped by rock
        """
        begins = run_starts(rock)
        ends, most = np.append(begins[1:], len(rock)), POINTS_A_ROCK if self._most else len(rock)
        return [rows[begin + evenly(end - begin, most)] for begin, end in zip(begins, ends, strict=True)]

    def _choice(self, points: FloatArray, rock: IntArray) -> IntArray:
        """Return the numbers of the rocks to record: all rocks that reach an area, and evenly spread other rocks.

        The result has at most `most` rocks (parameter of `__init__`), or more if more rocks reach an area. If `most` is
        0, or if there are no more rocks, the result has all rocks.

        points : (N, 3) m; rock : (N,) rock of each point, grouped by rock
        """
        begins = run_starts(rock)
        rocks = rock[begins]
        if not self._most or len(rocks) <= self._most:
            return rocks
        reached = reached_by(self._areas().values(), points, begins)
        others, left = rocks[~reached], self._most - int(reached.sum())
        return np.concatenate([rocks[reached], others[_spread(len(others), left)]])


def _has(cloud: Any, name: str) -> bool:
    return any(field.name == name for field in cloud.fields)


def _kept(topic: str) -> str:
    """Return the name of the state that the entries of a topic set (`RecordingEntry.keeps`).

    With it, a new file begins with the last entry of each topic.
    """
    return f"answer/{topic}"


def _spread(count: int, most: int) -> IntArray:
    """Return at most `most` of the indices 0 .. count - 1, evenly spread; none if `most` is not above 0."""
    return evenly(count, most) if most > 1 or count <= most else np.arange(max(min(count, most), 0))


def _strips(points: FloatArray, speed: FloatArray, rows: list[IntArray]) -> list[Strip]:
    """Return the lines to draw, coloured by speed in the same way as the published lines.

    points : (N, 3) m; speed : (N,) m/s; rows : for each rock, the rows of its points
    """
    fastest = float(np.max(speed, initial=0.0))
    opaque = [np.concatenate([speed_colours(speed[row], fastest), np.full((len(row), 1), 255)], axis=1) for row in rows]
    return [Strip(points[row], colours.astype(np.uint8)) for row, colours in zip(rows, opaque, strict=True)
            if len(row) > 1]  # fmt: skip
