"""Count rocks as if the error of the model (the misfit) had moved their paths in plan.

The results are counts in zones, areas and map cells, and runouts.
All rocks of a parameter set move by the displacement of this set (`unknowns.displacements`). Only the place of a
displaced path in plan counts, not its height above or below the ground. A vertical facet has no area in plan, so a zone
of vertical facets alone keeps the counts of the paths as simulated.
"""

import math
import queue
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.batches import Watch
from rpf3d_core.ensemble.flights import Deposits, FloatArray, Impacts, IntArray
from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING, Releases
from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.ensemble.statistics import PERCENTILES
from rpf3d_core.ensemble.stream import Sink
from rpf3d_core.hazard.by_set.set_places import PlaceCounts, PlaceTally
from rpf3d_core.hazard.by_set.set_sources import SourceSets, source_set_tally
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.reach_tally import ReachTally
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.over_facet import VERTICAL
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import DEPOSITED

NO_FACET = -1
"""Value in place of a facet's number: for an impact that is not counted, and for a place without ground."""


@dataclass(frozen=True, eq=False)
class DisplacedFigures:
    """The counts and the runout of S parameter sets with displaced paths.

    moves : (S, 2) m, displacement of each set in plan; zones, areas : counts of each set in the zones and in the areas
    sources : counts of each set for each source; None if the scene has one source
    runout : (S, P) m, the P percentiles `ensemble.statistics.PERCENTILES` over the deposits of each set; NaN for a set
        without deposits
    """

    moves: FloatArray
    zones: PlaceCounts
    areas: PlaceCounts
    runout: FloatArray
    sources: SourceSets | None = None


class DisplacedTally:
    """Counts the rocks of each parameter set with displaced paths; `hazard.by_set.sets.SetTally` calls its methods."""

    def __init__(self, moves: FloatArray, tallies: Tallies, engine: Engine) -> None:
        """Start with empty counts for S parameter sets; moves : displacement (S, 2) m of each set in plan.

        tallies : the counts of the run, which stay unchanged; engine : finds the ground at displaced places
        """
        self._moves, self._engine = moves, engine
        self._tallies = tallies_of_places(tallies)
        self._zones = PlaceTally(self._tallies.zones, len(moves))
        self._areas = PlaceTally(self._tallies.inside, len(moves))
        self._sources = source_set_tally(self._tallies.sources, len(moves))
        self._runout = [Sample() for _ in moves]

    def watch_of(self, number: int, watch: Watch) -> Watch:
        """Return a function that counts each batch of set `number` with displaced paths, then calls `watch`.

        The function `watch` gets the batch with the paths as simulated.
        """

        def both(batch: Batch, releases: Releases) -> FloatArray:
            self._tallies(displaced_batch(batch, self._moves[number], self._engine), releases)
            return watch(batch, releases)

        return both

    def sink_of(self, number: int, sink: Sink) -> Sink:
        """Return a function that records the displaced runouts of rocks of set `number`, then calls `sink`.

        The function `sink` gets the deposits and impacts as simulated.
        """

        def both(deposits: Deposits, impacts: Impacts) -> None:
            way = deposits.x[:, :2] + self._moves[number] - deposits.release[:, :2]
            self._runout[number].add(np.linalg.norm(way[np.isin(deposits.outcome, DEPOSITED)], axis=1))
            sink(deposits, impacts)

        return both

    def end(self, number: int) -> None:
        """Add to set `number` all rocks counted since the previous call of `end`, whatever set that call was for."""
        self._zones.end(number)
        self._areas.end(number)
        if self._sources is not None:
            self._sources.end(number)

    def figures(self, zones: PlaceCounts, sources: SourceSets | None) -> DisplacedFigures:
        """Return the results of all sets so far.

        zones, sources : counts of the same rocks, with paths as simulated
        """
        known = zones_in_plan(self._engine.facets, len(zones.reached[0]))
        return DisplacedFigures(
            moves=self._moves,
            zones=_in_plan(self._zones.counts(), zones, known),
            areas=self._areas.counts(),
            runout=percentiles_of(self._runout),
            sources=None if self._sources is None or sources is None else self._in_plan(sources, known),
        )

    def _in_plan(self, sources: SourceSets, known: NDArray[np.bool_]) -> SourceSets:
        """Return the counts of each source in zones and areas, from the displaced paths.

        In zones without an area in plan, the counts are from the paths as simulated.

        sources : counts from the simulated paths, not displaced; known : (Z,) flag of each zone with an area in plan
        """
        assert self._sources is not None
        moved = self._sources.counts()
        zones = _in_plan(moved.zones, sources.zones, np.tile(known, sources.rocks.shape[1]))
        return moved._replace(zones=zones)


def displaced_batch(batch: Batch, move: FloatArray, engine: Engine) -> Batch:
    """Return a batch whose paths and stops are displaced by `move` (2,) m in plan, and lifted above all ground.

    In the result, every impact has NO_FACET as its facet, and the facet of a deposit is the topmost facet at the
    displaced place.

    engine : finds the ground at the displaced places
    """
    facets = engine.facets
    shift = np.array([*move, facets.high[2] - facets.low[2] + ABOVE_EVERYTHING])
    impacts, pieces, finals = (_moved(rows, shift) for rows in (batch.impacts, batch.pieces, batch.finals))
    counts = batch.counts.copy()
    at_rest = np.isin(counts[:, 0], DEPOSITED)
    counts[at_rest, 1] = _facets_below(finals[at_rest, 1:3], engine)
    nowhere = np.full_like(batch.facets, NO_FACET)
    return replace(batch, impacts=impacts, pieces=pieces, finals=finals, counts=counts, facets=nowhere)


def _facets_below(places: FloatArray, engine: Engine) -> IntArray:
    """Return the number (N,) of the topmost facet at places in plan (N, 2) m; NO_FACET where there is no ground."""
    top = np.column_stack([places, np.full(len(places), engine.facets.high[2] + ABOVE_EVERYTHING)])
    return np.asarray(engine.ground_below(top)[:, 1].astype(np.int64))


def percentiles_of(samples: list[Sample]) -> FloatArray:
    """Return percentiles (S, P) of S samples, in the unit of the values; NaN for a sample without values.

    The P percentiles are `ensemble.statistics.PERCENTILES`.
    """
    nothing = [np.nan] * len(PERCENTILES)
    return np.array([sample.percentiles(PERCENTILES) if sample.count else nothing for sample in samples])


def moved_cells(cells: IntArray, rocks: NDArray[Any], move: FloatArray, raster: Raster) -> tuple[IntArray, FloatArray]:
    """Return the map cells (M,) that rocks reach on displaced paths, and how many rocks reach each cell (M,).

    A displaced cell overlaps up to four cells; its rocks are divided among these cells by area. Parts outside the
    raster do not count.

    cells, rocks : (N,) cells on the paths as simulated, and how many rocks reached each; move : displacement (2,) m
    """
    whole, part = np.divmod(move / raster.cell, 1.0)
    found, counts = [], []
    for i, in_x in ((0, 1.0 - part[0]), (1, part[0])):
        for j, in_y in ((0, 1.0 - part[1]), (1, part[1])):
            column = cells % raster.nx + int(whole[0]) + i
            row = cells // raster.nx + int(whole[1]) + j
            inside = (column >= 0) & (column < raster.nx) & (row >= 0) & (row < raster.ny) & (in_x * in_y > 0.0)
            found.append((row * raster.nx + column)[inside])
            counts.append(rocks[inside] * (in_x * in_y))
    moved, which = np.unique(np.concatenate(found), return_inverse=True)
    return moved, np.bincount(which, weights=np.concatenate(counts), minlength=len(moved)).astype(float)


def zones_in_plan(facets: Facets, zones: int) -> NDArray[np.bool_]:
    """Return flags (Z,), True for each zone with at least one facet that is not vertical; zones : number Z of zones."""
    inclined = np.abs(np.asarray(facets.normals)[:, 2]) > VERTICAL
    return np.asarray(np.bincount(np.asarray(facets.zone)[inclined], minlength=zones) > 0)


def _in_plan(moved: PlaceCounts, unmoved: PlaceCounts, known: NDArray[np.bool_]) -> PlaceCounts:
    """Return the counts of each place: from the displaced paths if the place has an area in plan.

    For all other places, the counts are from the paths as simulated. The sampling intervals of the p95 energies always
    come from the paths as simulated.

    moved, unmoved : counts from the displaced paths, and from the paths as simulated
    known : (P,) flag of each place with an area in plan
    """
    return PlaceCounts(
        reached=np.where(known, moved.reached, unmoved.reached),
        stopped=np.where(known, moved.stopped, unmoved.stopped),
        energy=np.where(known, moved.energy, unmoved.energy),
        energy_sampling=unmoved.energy_sampling,
    )


def _moved(rows: FloatArray, shift: FloatArray) -> FloatArray:
    """Return a copy of rows (N, K) whose positions, in columns 1 to 3, are displaced by `shift` (3,) m."""
    moved = rows.copy()
    moved[:, 1:4] += shift
    return moved


def tallies_of_places(tallies: Tallies) -> Tallies:
    """Return empty counts of the zones and areas of `tallies`, to count rocks with displaced paths.

    In the result, the raster has only one cell, because map cells are not counted. Visits to zones are found by
    following paths over facets, so visits to facets are counted, too, but with the fewest bins, or only rocks.
    """
    facets = tallies.ground.facets
    side = max(facets.high[0] - facets.low[0], facets.high[1] - facets.low[1], 1.0)
    raster = Raster(x=facets.low[0], y=facets.low[1], cell=float(side), nx=1, ny=1)
    zones, inside = (_empty(tally, len(tally.slot)) for tally in (tallies.zones, tallies.inside))
    return replace(
        tallies, ground=tallies.ground._replace(raster=raster), squares=_empty(tallies.squares, 1, 0.0),
        facets=_empty(tallies.facets, len(tallies.facets.slot), 0.0), zones=zones, inside=inside,
        idle=queue.SimpleQueue(), barriers=None,
        sources=None if tallies.sources is None else tallies.sources.emptied(),
        reach=None if tallies.reach is None else ReachTally(len(tallies.reach.rocks), tallies.compiled),
    )  # fmt: skip


def _empty(tally: CellTally, cells: int, limit: float = math.inf) -> CellTally:
    """Return an empty tally of `cells` cells with the settings of `tally`; limit : bytes above which bins merge."""
    return CellTally(cells, tally.scales, limit, tally.compiled, tally.ways)
