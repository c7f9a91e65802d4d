"""Tallies of an ensemble while it flies: raster, facets, zones and areas of interest.

Rocks are looked at batch by batch, on the thread that flew them, and forgotten: memory depends on the terrain and on
the maps, not on the number of rocks.
"""

import math
import queue
import time
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.compiling import kernel, loop
from rpf3d_core.ensemble.batch import NOTHING, Batch
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.hazard.areas import Areas, contains_point, walk_areas
from rpf3d_core.hazard.bins import Scales
from rpf3d_core.hazard.ground import Ground, plain_ground
from rpf3d_core.hazard.layers import layers_of, without_passages
from rpf3d_core.hazard.maps import HazardMaps, Raster
from rpf3d_core.hazard.tally import Tally
from rpf3d_core.hazard.tracks import Track, square_at, track_of, tracks_of
from rpf3d_core.hazard.visits import (
    DEPOSITS,
    FULL,
    HEIGHT,
    IMPACTS,
    OF_ROCK,
    USED,
    Visits,
    empty_visits,
    next_rock,
    note_count,
    note_stay,
    take_back,
    visit,
)
from rpf3d_core.hazard.walk_buckets import Spans, empty_spans, walk_buckets
from rpf3d_core.hazard.walk_raster import walk_raster
from rpf3d_core.hazard.walk_sheet import NOWHERE, walk_sheet
from rpf3d_core.values import Outcome

STOPPED, CAUGHT, FAILED = int(Outcome.STOPPED), int(Outcome.CAUGHT), int(Outcome.FAILED)
ROOM = 65_536
"""Visits to one kind of cell that are gathered before they are folded in: 4 MB."""


class Scratch(NamedTuple):
    """What one thread needs to look at rocks: visits to squares, facets, zones and areas, and spans."""

    squares: Visits
    facets: Visits
    zones: Visits
    areas: Visits
    spans: Spans


@dataclass(frozen=True, eq=False)
class Tallies:
    """Counts over everything that hazard is told of. Call it with each batch of flown rocks; any thread may."""

    ground: Ground
    areas: Areas
    gravity: float
    squares: Tally
    facets: Tally
    zones: Tally
    inside: Tally
    compiled: bool
    idle: "queue.SimpleQueue[Scratch]"
    barriers: Any = None  # a `hazard.barriers.BarrierTally` where the scene names some

    def __call__(self, batch: Batch, releases: Releases) -> FloatArray:
        """Count N rocks in; their largest heights above the terrain (N,) m."""
        heights, begin = np.zeros(len(batch.finals)), 0
        scratch = self._scratch()
        mass = releases.mass[batch.rows]
        while begin < len(heights):
            end = self._visit(scratch, batch, mass, begin, heights)
            self._fold(scratch)
            if end == begin:
                scratch = _with_more_room(scratch)
            begin = end
        self.idle.put(scratch)
        if self.barriers is not None:
            self.barriers(batch, releases)
        return heights

    def warm(self) -> float:
        """Compile what counting needs; returns the seconds it took."""
        began = time.perf_counter()
        scratch = self._scratch()
        self._visit(scratch, NOTHING, np.empty(0), 0, np.empty(0))
        self._fold(scratch)
        self.idle.put(scratch)
        return time.perf_counter() - began

    def add(self, other: "Tallies") -> None:
        """Count in what another part of the same ensemble has counted."""
        for mine, theirs in zip(self._tallies, other._tallies, strict=True):
            mine.add(theirs)
        if self.barriers is not None:
            self.barriers.join(other.barriers.counted)

    def maps(self, flown: int, area_names: tuple[str, ...]) -> HazardMaps:
        """The maps of an ensemble of which so many rocks have flown."""
        squares, facets, zones, inside = (layers_of(tally) for tally in self._tallies)
        zones, inside = without_passages(zones), without_passages(inside)
        barriers = () if self.barriers is None else self.barriers.figures
        return HazardMaps(flown, self.ground.raster, squares, facets, zones, inside, area_names, barriers)

    def places(self, flown: int, area_names: tuple[str, ...]) -> HazardMaps:
        """As `maps`, of zones and areas of interest only: what is asked for again and again is quick."""
        nothing = layers_of(Tally(0, self.squares.scales, math.inf))
        zones, inside = (layers_of(tally) for tally in (self.zones, self.inside))
        zones, inside = without_passages(zones), without_passages(inside)
        return HazardMaps(flown, self.ground.raster, nothing, nothing, zones, inside, area_names)

    @property
    def _tallies(self) -> tuple[Tally, Tally, Tally, Tally]:
        return self.squares, self.facets, self.zones, self.inside

    def _scratch(self) -> Scratch:
        try:
            return self.idle.get_nowait()
        except queue.Empty:
            squares, facets, zones, areas = (empty_visits(len(tally.slot), ROOM) for tally in self._tallies)
            return Scratch(squares, facets, zones, areas, empty_spans())

    def _fold(self, scratch: Scratch) -> None:
        kinds = (scratch.squares, scratch.facets, scratch.zones, scratch.areas)
        for tally, visits in zip(self._tallies, kinds, strict=True):
            tally.fold(visits)

    def _visit(self, scratch: Scratch, batch: Batch, mass: FloatArray, begin: int, heights: FloatArray) -> int:
        written = (batch.counts, batch.finals, batch.impacts, batch.facets, batch.pieces, batch.modes, batch.first)
        areas = self.areas._replace(crossings=np.empty_like(self.areas.crossings))
        visit_all = _visit_all if self.compiled else _visit_all.py_func  # type: ignore[attr-defined]
        ground = self.ground if self.compiled else plain_ground(self.ground)
        return int(visit_all(ground, areas, scratch, self.gravity, *written, mass, begin, heights))


def tallies_over(
    ground: Ground, areas: Areas, zones: int, gravity: float, scales: Scales, fine: Scales, limit: float, compiled: bool
) -> Tallies:
    """Tallies over a ground of so many zones with nothing counted yet.

    scales : of squares and facets; fine : of zones and areas; limit : bytes that the bins of the former may take
    """
    squares, facets = (
        Tally(n, scales, 0.5 * limit, compiled)
        for n in (ground.raster.nx * ground.raster.ny, len(ground.facets.zone))
    )
    places, inside = (Tally(n, fine, math.inf, compiled) for n in (zones, len(areas.boxes)))
    return Tallies(ground, areas, gravity, squares, facets, places, inside, compiled, queue.SimpleQueue())


def _with_more_room(scratch: Scratch) -> Scratch:
    """Scratch with twice the room, for a rock that goes to more cells than there was room for."""
    squares, facets, zones, areas = (
        empty_visits(len(visits.mark), 2 * len(visits.cell))
        for visits in (scratch.squares, scratch.facets, scratch.zones, scratch.areas)
    )
    return Scratch(squares, facets, zones, areas, scratch.spans)


@loop
def _visit_all(
    ground: Ground, areas: Areas, scratch: Scratch, gravity: float, counts: Any, finals: Any, impacts: Any,
    facets: Any, pieces: Any, modes: Any, first: Any, mass: Any, begin: int, heights: Any,
) -> int:  # fmt: skip
    """Gather the visits of rock after rock from number `begin` on; the number of the first that found no room.

    Rows of the record begin at first[r, 0] for the impacts and at first[r, 1] for the pieces of rock r.
    """
    for r in range(begin, len(heights)):
        _next_rock(scratch)
        if counts[r, 0] == FAILED:
            heights[r] = math.nan  # and nothing of it in any map
            continue
        q, at = first[r, 0], NOWHERE
        for p in range(first[r, 1], first[r + 1, 1] - 1):
            at = _walk_piece(ground, areas, scratch, pieces, modes, p, gravity, mass[r], at)
            while q < first[r + 1, 0] and impacts[q, 0] <= pieces[p + 1, 0]:
                if facets[q] >= 0:  # an obstacle is no ground: the flights before and after it tell of it
                    _note_impact(ground, areas, scratch, impacts, q, facets[q], mass[r])
                q += 1
        _come_to_rest(ground, areas, scratch, counts[r, 0], counts[r, 1], finals[r], mass[r])
        if not _fits(scratch):
            return r
        heights[r] = _largest_height(scratch.zones)
    return len(heights)


@kernel
def _next_rock(scratch: Scratch) -> None:
    next_rock(scratch.squares)
    next_rock(scratch.facets)
    next_rock(scratch.zones)
    next_rock(scratch.areas)


@kernel
def _fits(scratch: Scratch) -> bool:
    """Whether the rock at hand found room everywhere; if not, it has been nowhere yet."""
    full = scratch.squares.state[FULL] + scratch.facets.state[FULL]
    if full + scratch.zones.state[FULL] + scratch.areas.state[FULL] == 0:
        return True
    take_back(scratch.squares)
    take_back(scratch.facets)
    take_back(scratch.zones)
    take_back(scratch.areas)
    return False


@kernel
def _walk_piece(
    ground: Ground, areas: Areas, scratch: Scratch, pieces: Any, modes: Any, p: int, gravity: float, mass: float,
    at: int,
) -> int:  # fmt: skip
    """Visit all that one piece of path passes over; the facet it ends over, from the one it may begin over."""
    count = tracks_of(pieces, modes, p)
    for k in range(count):
        track = track_of(pieces, modes, p, k, count, gravity)
        walk_raster(ground.raster, scratch.squares, track, mass)
        at = _walk_facets(ground, scratch, track, mass, at)
        walk_areas(areas, scratch.areas, track, mass)
    return at


@kernel
def _walk_facets(ground: Ground, scratch: Scratch, track: Track, mass: float, at: int) -> int:
    """Visit all facets that a track passes over: over their sides as far as that goes, then bucket by bucket."""
    squares, facets, zones = scratch.squares, scratch.facets, scratch.zones
    at, walked = walk_sheet(ground, squares, facets, zones, track, mass, at)
    if at == NOWHERE:
        walk_buckets(ground, scratch.spans, squares, facets, zones, track, mass, walked)
    return at


@kernel
def _square(raster: Raster, x: float, y: float) -> int:
    """The number of the square that a point lies in."""
    i = square_at(x, raster.x, raster.cell, raster.nx)
    return square_at(y, raster.y, raster.cell, raster.ny) * raster.nx + i


@kernel
def _note_impact(
    ground: Ground, areas: Areas, scratch: Scratch, impacts: Any, q: int, facet: int, mass: float
) -> None:
    """Count an impact where it is; a vertical facet is visited by nothing else."""
    t, speed2 = impacts[q, 0], impacts[q, 7] * impacts[q, 7]
    x = (impacts[q, 1], impacts[q, 2], impacts[q, 3])
    k = visit(scratch.squares, _square(ground.raster, x[0], x[1]), t, mass)
    note_stay(scratch.squares, k, t, t, speed2)
    note_count(scratch.squares, k, IMPACTS)
    k = visit(scratch.facets, facet, t, mass)
    note_stay(scratch.facets, k, t, t, speed2)
    note_count(scratch.facets, k, IMPACTS)
    k = visit(scratch.zones, ground.facets.zone[facet], t, mass)
    note_stay(scratch.zones, k, t, t, speed2)
    note_count(scratch.zones, k, IMPACTS)
    for a in range(len(areas.boxes)):
        if contains_point(areas, a, x):
            k = visit(scratch.areas, a, t, mass)
            note_stay(scratch.areas, k, t, t, speed2)
            note_count(scratch.areas, k, IMPACTS)


@kernel
def _come_to_rest(
    ground: Ground, areas: Areas, scratch: Scratch, outcome: int, facet: int, final: Any, mass: float
) -> None:
    """Count a rock that has stopped, where it lies; and one that never moved, where it was released."""
    t, x = final[0], (final[1], final[2], final[3])
    k = visit(scratch.squares, _square(ground.raster, x[0], x[1]), t, mass)
    note_stay(scratch.squares, k, t, t, 0.0)
    if outcome != STOPPED and outcome != CAUGHT:
        return
    note_count(scratch.squares, k, DEPOSITS)
    if facet >= 0:
        note_count(scratch.facets, visit(scratch.facets, facet, t, mass), DEPOSITS)
        note_count(scratch.zones, visit(scratch.zones, ground.facets.zone[facet], t, mass), DEPOSITS)
    for a in range(len(areas.boxes)):
        if contains_point(areas, a, x):
            note_count(scratch.areas, visit(scratch.areas, a, t, mass), DEPOSITS)


@kernel
def _largest_height(visits: Visits) -> float:
    """The largest height in the visits of the rock at hand (m)."""
    height = 0.0
    for k in range(visits.state[OF_ROCK], visits.state[USED]):
        height = max(height, visits.most[k, HEIGHT])
    return height
