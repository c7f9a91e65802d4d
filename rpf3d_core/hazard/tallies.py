"""Count flown rocks into all hazard maps: cells of the raster, facets, zones and areas of interest.

Rocks are examined batch by batch, on the thread that flew them, and then discarded: memory depends on the terrain and
on the maps, not on the number of rocks.
"""

import math
import queue
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rpf3d_core.ensemble.batch import NOTHING, Batch
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.spin import spins_squared
from rpf3d_core.hazard.areas import Areas
from rpf3d_core.hazard.bins import Binning
from rpf3d_core.hazard.by_source.source_tallies import SourceTallies, source_tallies
from rpf3d_core.hazard.flown import FlownRocks, flown_rocks
from rpf3d_core.hazard.layers import layers_of, without_passages
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.reach_tally import ReachTally
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.ground import WalkedTerrain, plain_ground
from rpf3d_core.hazard.walks.visiting import visit_all
from rpf3d_core.hazard.walks.visits import empty_visits
from rpf3d_core.hazard.walks.walk import Scratch, empty_spans, with_more_room
from rpf3d_core.jit.background import Call

ROOM = 65_536
"""Largest number of visits to one kind of cell that are collected before they are added to the counts: 4 MB.

The number is doubled if the visits of a single rock do not fit.
"""


@dataclass(frozen=True, eq=False)
class Tallies:
    """The counts (tallies) behind all hazard maps: call the object with each batch of flown rocks, from any thread.

    ground : terrain and raster; areas : areas of interest; gravity : m/s^2
    squares, facets, zones, inside : tallies of map cells, facets, zones and areas of interest
    compiled : True to use compiled loops; idle : working memory that no thread uses at the moment
    spins : True if energies include rotation; barriers : counts at barriers, None if the scene has no barriers
    sources : counts of zones, areas and map cells for each source, None if they are not counted
    reach : number of rocks on each facet, counted in place of `facets`; None to count `facets`
    """

    ground: WalkedTerrain
    areas: Areas
    gravity: float
    squares: CellTally
    facets: CellTally
    zones: CellTally
    inside: CellTally
    compiled: bool
    idle: "queue.SimpleQueue[Scratch]"
    spins: bool = False  # True if energies include rotation
    barriers: Any = None  # a `hazard.barriers.BarrierTally` if the scene names barriers
    sources: SourceTallies | None = None
    reach: ReachTally | None = None

    def __call__(self, batch: Batch, releases: Releases) -> FloatArray:
        """Count the N rocks of a batch into all maps; return their largest heights above the terrain (N,) m.

        The height is NaN for a rock whose simulation failed; such a rock is in no map.
        """
        heights, begin = np.zeros(len(batch.finals)), 0
        scratch = self._scratch()
        flown = self._flown(batch, releases.mass[batch.rows], releases.radius[batch.rows])
        source = None if self.sources is None else releases.source[batch.rows]
        if self.sources is not None and source is not None:
            self.sources.note_flown(batch, source)
        while begin < len(heights):
            end = self._visit(scratch, flown, begin, heights)
            self._fold(scratch, source)
            if end == begin:
                scratch = with_more_room(scratch)
            begin = end
        self.idle.put(scratch)
        if self.barriers is not None:
            self.barriers(batch, releases)
        return heights

    def precompile(self) -> None:
        """Compile the loops that count rocks, before the first rock flies."""
        scratch, nothing = self._scratch(), np.empty(0)
        self._fold(scratch, None)
        self._visit(scratch, self._flown(NOTHING, nothing, nothing), 0, nothing)
        self.idle.put(scratch)

    def loops(self) -> tuple[Call, Call]:
        """Return the two counting loops that take longest to compile, as calls that another process can compile."""
        scratch, nothing = self._scratch(), np.empty(0)
        self.idle.put(scratch)
        flown = self._flown(NOTHING, nothing, nothing)
        visit = visit_all, (*self._places(), scratch, flown, 0, nothing)
        return visit, self.squares.loop(scratch.squares)

    def add(self, other: "Tallies") -> None:
        """Add all counts of another part of the same ensemble; the counts of each source only if both count sources."""
        for mine, theirs in zip(self._tallies, other._tallies, strict=True):
            mine.add(theirs)
        if self.barriers is not None:
            self.barriers.join(other.barriers.counts)
        if self.sources is not None and other.sources is not None:
            self.sources.add(other.sources)
        if self.reach is not None and other.reach is not None:
            self.reach.add(other.reach)

    def after(self, ground: WalkedTerrain) -> "Tallies":
        """Return tallies for a terrain whose facets have changed; they share the memory of these tallies.

        So these tallies must not be used afterwards. The result still contains the counts of the old facets: the caller
        must empty its tallies (`CellTally.emptied`) before new rocks are counted.

        ground : the changed terrain
        """
        cells = len(ground.facets.zone)
        known = len(self.facets.slot) if self.reach is None else len(self.reach.rocks)
        fits = cells <= known  # the working memory is as long as the counts, so it fits too
        if self.reach is None:
            self.facets.widened(cells)
        else:
            self.reach.widened(cells)
        return replace(self, ground=ground, idle=self.idle if fits else queue.SimpleQueue())

    def maps(self, flown: int, area_names: tuple[str, ...], lost: int = 0) -> HazardMaps:
        """Return the hazard maps of `flown` rocks, of which `lost` were lost to holes.

        area_names : names of the areas of interest, in the order of their counts
        """
        squares, facets, zones, inside = (layers_of(tally) for tally in self._tallies)
        zones, inside = without_passages(zones), without_passages(inside)
        barriers, each = (), ()
        if self.barriers is not None:
            barriers, each = self.barriers.figures, self.barriers.source_figures
        sources = None if self.sources is None else self.sources.maps(squares)._replace(barriers=each)
        return HazardMaps(
            flown, self.ground.raster, squares, facets, zones, inside, area_names, barriers, spins=self.spins,
            lost=lost, sources=sources, reached_facets=None if self.reach is None else self.reach.reached(),
        )  # fmt: skip

    def places(self, flown: int, area_names: tuple[str, ...]) -> HazardMaps:
        """Return hazard maps that have values of zones and areas only, for checks of convergence: faster than `maps`.

        flown : number of flown rocks; area_names : names of the areas of interest, in the order of their counts
        """
        nothing = layers_of(CellTally(0, self.squares.scales, math.inf))
        zones, inside = (layers_of(tally) for tally in (self.zones, self.inside))
        zones, inside = without_passages(zones), without_passages(inside)
        return HazardMaps(flown, self.ground.raster, nothing, nothing, zones, inside, area_names, (), self.spins)

    @property
    def _tallies(self) -> tuple[CellTally, CellTally, CellTally, CellTally]:
        return self.squares, self.facets, self.zones, self.inside

    def _scratch(self) -> Scratch:
        """Return unused working memory for a thread, or new memory if none is unused."""
        try:
            return self.idle.get_nowait()
        except queue.Empty:
            squares, zones, areas = (
                empty_visits(len(tally.slot), ROOM, tally.ways, self.spins, rocks=True)
                for tally in (self.squares, self.zones, self.inside)
            )
            if self.reach is None:
                facets = empty_visits(len(self.facets.slot), ROOM, spins=self.spins)
            else:
                facets = empty_visits(len(self.reach.rocks), ROOM, figures=False)
            return Scratch(squares=squares, facets=facets, zones=zones, areas=areas, spans=empty_spans())

    def _fold(self, scratch: Scratch, source: IntArray | None) -> None:
        """Add all collected visits of a thread to the counts.

        source : (N,) number of each rock's source; None if sources are not counted, or if there are no visits
        """
        if self.sources is not None and source is not None:
            self.sources.fold(scratch, source)
        self.squares.fold(scratch.squares)
        (self.facets if self.reach is None else self.reach).fold(scratch.facets)
        self.zones.fold(scratch.zones)
        self.inside.fold(scratch.areas)

    def _visit(self, scratch: Scratch, flown: FlownRocks, begin: int, heights: FloatArray) -> int:
        """Collect the visits of rocks, from number `begin` on, until the working memory is full.

        Return the number of the first rock whose visits were not collected; N if all visits were collected.

        heights : (N,) m, receives the largest height of each rock above the terrain
        """
        visit: Any = visit_all if self.compiled else visit_all.py_func  # type: ignore[attr-defined]
        return int(visit(*self._places(), scratch, flown, begin, heights))

    def _places(self) -> tuple[WalkedTerrain, Areas]:
        """Return the terrain and the areas of interest for the search of visits; the areas have new working memory."""
        areas = self.areas._replace(crossings=np.empty_like(self.areas.crossings))
        return self.ground if self.compiled else plain_ground(self.ground), areas

    def _flown(self, batch: Batch, mass: FloatArray, radius: FloatArray) -> FlownRocks:
        """Return the records of a batch of flown rocks, with spins if rocks spin.

        mass, radius : (N,) kg and m, of the rocks
        """
        spins = spins_squared(batch, radius) if self.spins else None
        return flown_rocks(batch, mass, radius, self.gravity, spins)


def with_ways(tallies: Tallies) -> Tallies:
    """Return tallies whose map cells, empty at first, also count path lengths in each cell, for passages per metre.

    tallies : empty counts; the tallies of facets, zones and areas are used unchanged
    """
    return replace(tallies, squares=tallies.squares.with_ways())


def with_reach_only(tallies: Tallies) -> Tallies:
    """Return tallies that count only rocks on facets, no energies, speeds or heights; tallies : empty counts."""
    reach = ReachTally(len(tallies.facets.slot), tallies.compiled)
    return replace(tallies, facets=CellTally(0, tallies.facets.scales, math.inf, tallies.compiled), reach=reach)


def with_sources(tallies: Tallies, names: Sequence[str]) -> Tallies:
    """Return tallies that also count zones, areas and map cells for each source, if there are at least two sources.

    tallies : empty counts; names : of the sources, in the order of the numbers in `Releases.source`
    """
    if len(names) < 2:
        return tallies
    return replace(tallies, sources=source_tallies(names, tallies.zones, tallies.inside, tallies.squares))


def tallies_over(
    ground: WalkedTerrain, areas: Areas, zones: int, gravity: float, binning: Binning, compiled: bool
) -> Tallies:
    """Return empty counts (tallies) for all hazard maps over a terrain with `zones` zones; gravity : m/s^2.

    binning : bins of energies, speeds and heights; compiled : True to use compiled loops
    """
    squares, facets = (
        CellTally(n, binning.coarse, 0.5 * binning.limit, compiled)
        for n in (ground.raster.nx * ground.raster.ny, len(ground.facets.zone))
    )
    places, inside = (CellTally(n, binning.fine, math.inf, compiled) for n in (zones, len(areas.boxes)))
    return Tallies(ground, areas, gravity, squares, facets, places, inside, compiled, queue.SimpleQueue())
