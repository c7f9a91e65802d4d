"""Tallies of an ensemble while it flies: raster, facets, zones and areas of interest.

Rocks are looked at batch by batch, on the thread that flew them, and forgotten: memory depends on the terrain and on
the maps, not on the number of rocks.
"""

import math
import queue
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rpf3d_core.compiling_beside import Call
from rpf3d_core.ensemble.batch import NOTHING, Batch
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.spin import spins_squared
from rpf3d_core.hazard.areas import Areas
from rpf3d_core.hazard.bins import Scales
from rpf3d_core.hazard.ground import Ground, plain_ground
from rpf3d_core.hazard.layers import layers_of, without_passages
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.tally import Tally
from rpf3d_core.hazard.visiting import Scratch, visit_all, with_more_room
from rpf3d_core.hazard.visits import empty_visits
from rpf3d_core.hazard.walk_buckets import empty_spans

ROOM = 65_536
"""Visits to one kind of cell that are gathered before they are folded in: 4 MB."""


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
    spins: bool = False  # whether energies count rotation
    barriers: Any = None  # a `hazard.barriers.BarrierTally` where the scene names some

    def __call__(self, batch: Batch, releases: Releases) -> FloatArray:
        """Count N rocks in; their largest heights above the terrain (N,) m."""
        heights, begin = np.zeros(len(batch.finals)), 0
        scratch = self._scratch()
        mass = releases.mass[batch.rows]
        spins = spins_squared(batch, releases.radius[batch.rows]) if self.spins else None
        while begin < len(heights):
            end = self._visit(scratch, batch, mass, spins, begin, heights)
            self._fold(scratch)
            if end == begin:
                scratch = with_more_room(scratch)
            begin = end
        self.idle.put(scratch)
        if self.barriers is not None:
            self.barriers(batch, releases)
        return heights

    def warm(self, wait: Callable[[], None] | None = None) -> float:
        """Compile what counting needs; returns the seconds it took.

        wait : called before the loops that `loops` tells of are needed
        """
        began = time.perf_counter()
        scratch = self._scratch()
        if wait:
            wait()
        self._fold(scratch)
        nothing = np.empty(0)
        self._visit(scratch, NOTHING, nothing, self._no_spins, 0, nothing)
        self.idle.put(scratch)
        return time.perf_counter() - began

    def loops(self) -> tuple[Call, Call]:
        """The loops of `warm` that take longest to compile, with arguments."""
        scratch, nothing = self._scratch(), np.empty(0)
        self.idle.put(scratch)
        visit = visit_all, (*self._arguments(scratch, NOTHING, nothing, self._no_spins), 0, nothing)
        return visit, self.squares.loop(scratch.squares)

    def add(self, other: "Tallies") -> None:
        """Count in what another part of the same ensemble has counted."""
        for mine, theirs in zip(self._tallies, other._tallies, strict=True):
            mine.add(theirs)
        if self.barriers is not None:
            self.barriers.join(other.barriers.counted)

    def after(self, ground: Ground) -> "Tallies":
        """The same counts over the ground that came of a change of facets; throw them away before rocks fly over it."""
        cells = len(ground.facets.zone)
        fits = cells <= len(self.facets.slot)  # so does the scratch, then, which is as long
        self.facets.widened(cells)
        return replace(self, ground=ground, idle=self.idle if fits else queue.SimpleQueue())

    def maps(self, flown: int, area_names: tuple[str, ...], lost: int = 0) -> HazardMaps:
        """The maps of an ensemble of which so many rocks have flown, and so many were lost to holes."""
        squares, facets, zones, inside = (layers_of(tally) for tally in self._tallies)
        zones, inside = without_passages(zones), without_passages(inside)
        barriers = () if self.barriers is None else self.barriers.figures
        return HazardMaps(
            flown, self.ground.raster, squares, facets, zones, inside, area_names, barriers, spins=self.spins, lost=lost
        )

    def places(self, flown: int, area_names: tuple[str, ...]) -> HazardMaps:
        """As `maps`, of zones and areas of interest only: what is asked for again and again is quick."""
        nothing = layers_of(Tally(0, self.squares.scales, math.inf))
        zones, inside = (layers_of(tally) for tally in (self.zones, self.inside))
        zones, inside = without_passages(zones), without_passages(inside)
        return HazardMaps(flown, self.ground.raster, nothing, nothing, zones, inside, area_names, (), self.spins)

    @property
    def _tallies(self) -> tuple[Tally, Tally, Tally, Tally]:
        return self.squares, self.facets, self.zones, self.inside

    @property
    def _no_spins(self) -> Any:
        """What stands for the spins of a batch of no rocks."""
        return spins_squared(NOTHING, np.empty(0)) if self.spins else None

    def _scratch(self) -> Scratch:
        try:
            return self.idle.get_nowait()
        except queue.Empty:
            squares, facets, zones, areas = (
                empty_visits(len(tally.slot), ROOM, tally.ways, self.spins) for tally in self._tallies
            )
            return Scratch(squares, facets, zones, areas, empty_spans())

    def _fold(self, scratch: Scratch) -> None:
        kinds = (scratch.squares, scratch.facets, scratch.zones, scratch.areas)
        for tally, visits in zip(self._tallies, kinds, strict=True):
            tally.fold(visits)

    def _visit(
        self, scratch: Scratch, batch: Batch, mass: FloatArray, spins: Any, begin: int, heights: FloatArray
    ) -> int:
        visit: Any = visit_all if self.compiled else visit_all.py_func  # type: ignore[attr-defined]
        return int(visit(*self._arguments(scratch, batch, mass, spins), begin, heights))

    def _arguments(self, scratch: Scratch, batch: Batch, mass: FloatArray, spins: Any) -> tuple[Any, ...]:
        """What `visit_all` is to be called with, but for the rocks to begin with."""
        written = (batch.counts, batch.finals, batch.impacts, batch.facets, batch.pieces, batch.modes, batch.first)
        areas = self.areas._replace(crossings=np.empty_like(self.areas.crossings))
        ground = self.ground if self.compiled else plain_ground(self.ground)
        return ground, areas, scratch, self.gravity, *written, mass, spins


def with_ways(tallies: Tallies) -> Tallies:
    """Tallies with nothing counted yet that gather the lengths of ways inside the squares of the raster as well."""
    return replace(tallies, squares=tallies.squares.with_ways())


def tallies_over(
    ground: Ground, areas: Areas, zones: int, gravity: float, scales: Scales, fine: Scales, limit: float, compiled: bool
) -> Tallies:
    """Tallies over a ground of so many zones with nothing counted yet.

    scales : of squares and facets; fine : of zones and areas; limit : bytes that the bins of the former may take
    """
    squares, facets = (
        Tally(n, scales, 0.5 * limit, compiled) for n in (ground.raster.nx * ground.raster.ny, len(ground.facets.zone))
    )
    places, inside = (Tally(n, fine, math.inf, compiled) for n in (zones, len(areas.boxes)))
    return Tallies(ground, areas, gravity, squares, facets, places, inside, compiled, queue.SimpleQueue())
