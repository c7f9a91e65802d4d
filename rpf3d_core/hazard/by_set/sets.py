"""The results of each parameter set: counts of rocks by outcome, zone, area and map cell, and percentiles.

The hazard maps of the run count the rocks of all sets together. In zones, areas and map cells, the counts of one set
are the counts of the run after the rocks of the set have flown, minus the counts before. So no separate counts are kept
there while the rocks of a set fly.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.batches import Watch
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.statistics import PERCENTILES
from rpf3d_core.ensemble.stream import Sink
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.by_set.displaced import DisplacedFigures, DisplacedTally, moved_cells, percentiles_of
from rpf3d_core.hazard.by_set.set_places import PlaceCounts, PlaceTally, less
from rpf3d_core.hazard.by_set.set_sources import SourceSets, source_set_tally
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.walks.cache_lines import LINE_ROCKS
from rpf3d_core.unknowns.parameter_sets import ParameterSets
from rpf3d_core.unknowns.predictive import (
    ENOUGH,
    Interval,
    holding,
    predictive_shares,
    ranked_if_enough,
    shares_of_site,
)
from rpf3d_core.values import Outcome

RUNOUT = "runout"
"""Name of the only distribution in SAMPLES that changes if paths are displaced by the error of the model (misfit)."""
SAMPLES = (RUNOUT, "max_speed", "max_energy", "max_height", "ground_speed")
"""Names of the distributions in `Totals` whose percentiles are kept for each set."""
AT_ONCE = 65_536
"""Number of map cells whose intervals are computed in one step, to save memory."""

Reached = tuple[IntArray, NDArray[Any]]
"""Map cells (N,) that the rocks of a set reached, and how many rocks reached each (N,)."""


class ReachBand(NamedTuple):
    """The predictive intervals of the reach probability of N map cells.

    cell : (N,) numbers of the cells that rocks reached, or may reach with displaced paths, ascending
    low, high : (N,) lower and upper ends (-); NaN if fewer than 39 sets have flown
    """

    cell: IntArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, eq=False)
class SetFigures:
    """The results of each parameter set of a run, from which predictive intervals follow.

    sets : the S sets; rocks : (S,) number of rocks flown with each set; outcomes : number of rocks by outcome, per set
    zones, areas : counts of each set in the zones and in the areas
    percentiles : for each name in `SAMPLES`, the percentiles `ensemble.statistics.PERCENTILES` of each set (S, P); NaN
        for a set without values
    cells : for each set, the map cells that its rocks reached, and how many rocks reached each cell
    displaced : results of the same rocks with paths displaced by the error of the model; None if this error is unknown
    barriers : predictive intervals at each barrier, `hazard.by_set.set_barriers.Bands`; empty without barriers
    sources : counts of each set for each source; None if the scene has one source
    """

    sets: ParameterSets
    rocks: FloatArray
    outcomes: tuple[Counter[Outcome], ...]
    zones: PlaceCounts
    areas: PlaceCounts
    percentiles: dict[str, FloatArray]
    cells: tuple[Reached, ...]
    displaced: DisplacedFigures | None = None
    barriers: tuple[Any, ...] = ()
    sources: SourceSets | None = None

    def of_source(self, number: int) -> "SetFigures":
        """Return the results of the sets in zones and areas and at barriers for one source; number : of the source.

        Outcomes, percentiles and map cells are still those of all sources.
        """
        assert self.sources is not None
        rocks, zones, areas = self.sources.of_source(number)
        displaced = None
        if self.displaced is not None and self.displaced.sources is not None:
            _, *places = self.displaced.sources.of_source(number)
            displaced = replace(self.displaced, zones=places[0], areas=places[1], sources=None)
        barriers = self.sources.barriers[number] if self.sources.barriers else ()
        return replace(
            self, rocks=rocks, zones=zones, areas=areas, displaced=displaced, barriers=barriers, sources=None
        )  # fmt: skip

    @property
    def flown(self) -> int:
        """The number of sets with which rocks have flown."""
        return int((self.rocks > 0).sum())

    @property
    def enough_flown(self) -> bool:
        """True if at least 39 sets have flown, which predictive intervals of 95 % need."""
        return self.flown >= ENOUGH

    def outcome(self, *outcomes: Outcome) -> list[float]:
        """Return the predictive interval of the share of rocks with one of the outcomes: lower and upper end (-).

        The interval is widened if few or no sets have these outcomes (`shares_of_site`). The ends are NaN if fewer than
        39 sets have flown.
        """
        return _ends(shares_of_site(self._with_outcome(*outcomes), self.rocks[:, None]))

    def seen_outcome(self, *outcomes: Outcome) -> list[float]:
        """Return the predictive interval of the share of rocks with one of the outcomes, without widening.

        Lower and upper end (-), NaN if fewer than 39 sets have flown. In contrast, `outcome` widens the interval if few
        or no sets have these outcomes.
        """
        return _ends(predictive_shares(self._with_outcome(*outcomes), self.rocks[:, None]))

    def _with_outcome(self, *outcomes: Outcome) -> FloatArray:
        """Return the numbers (S, 1) of rocks of each set with one of the outcomes."""
        return np.array([[float(sum(each[outcome] for outcome in outcomes))] for each in self.outcomes])

    def shares_of_cells(self, counts: FloatArray) -> Interval:
        """Return the predictive intervals of the shares (-) of rocks that reach each of N map cells.

        Unlike in `shares_of_site`, the intervals are not widened for cells that few sets reach. The widened upper ends
        would be nearly the same in most cells, and would hide where rocks go.

        counts : (S, N) number of rocks of each set that reached each cell
        """
        return predictive_shares(counts, np.broadcast_to(self.rocks[:, None], counts.shape))

    def predictive(self, kind: str) -> dict[str, Interval]:
        """Return the predictive intervals of all zones (kind "zone") or areas ("area"), by name of the figure.

        The figures are the shares (-) `reached`, `stopped` and `retained`, and the p95 `energy` (J). An interval of a
        share from displaced paths is widened to contain the sampling interval of the paths as simulated.
        """
        flown = places = self._places(self, kind)
        if self.displaced is not None:
            places = self._places(self.displaced, kind)
        all_rocks = np.broadcast_to(self.rocks[:, None], flown.reached.shape)
        found = {
            "reached": self._held(places.reached, all_rocks, flown.reached, all_rocks),
            "stopped": self._held(places.stopped, all_rocks, flown.stopped, all_rocks),
            "retained": self._held(places.stopped, places.reached, flown.stopped, flown.reached),
        }
        return {**found, "energy": ranked_if_enough(places.energy)}

    @staticmethod
    def _places(figures: "SetFigures | DisplacedFigures", kind: str) -> PlaceCounts:
        return figures.zones if kind == "zone" else figures.areas

    def _held(self, counts: FloatArray, of: FloatArray, flown: FloatArray, flown_of: FloatArray) -> Interval:
        """Return the predictive intervals of N shares (-).

        With displaced paths, the intervals are widened to contain the sampling intervals of the paths as simulated.

        counts, of : (S, N) numbers of rocks of each set, numerators and denominators of the shares
        flown, flown_of : (S, N) numerators and denominators for the paths as simulated
        """
        found = shares_of_site(counts, of)
        return found if self.displaced is None else holding(found, flown.sum(axis=0), flown_of.sum(axis=0))

    def sampling_of_energy(self, kind: str) -> FloatArray:
        """Return the sampling intervals (P, 2) J of the p95 energies of all zones (kind "zone") or areas ("area")."""
        return (self.zones if kind == "zone" else self.areas).energy_sampling

    def percentile(self, name: str) -> dict[str, list[float | None]]:
        """Return the predictive interval of each percentile of a distribution in `SAMPLES`, by name of the percentile.

        The ends are in the unit of the distribution. Both ends are None if the interval is unknown.
        """
        displaced = self.displaced if self.is_displaced(name) else None
        found = ranked_if_enough(self.percentiles[name] if displaced is None else displaced.runout)
        return {f"p{p}": _both(found, i) for i, p in enumerate(PERCENTILES)}

    @staticmethod
    def is_displaced(name: str) -> bool:
        """Return True for the runout, the only distribution in `SAMPLES` that displaced paths change.

        name : of the distribution in `SAMPLES`
        """
        return name == RUNOUT

    def reach(self, maps: HazardMaps) -> ReachBand:
        """Return the predictive intervals of reach probability for all map cells that rocks reached.

        With displaced paths, the result also has the cells that rocks reach only on displaced paths.
        """
        sets = self.cells if self.displaced is None else self._moved_cells(maps)
        place = np.full(maps.cells.count, -1, dtype=np.int64)
        for cells in (maps.cells.cell, *(cells for cells, _ in sets)):
            place[cells] = 0
        cell = np.flatnonzero(place == 0)
        place[cell] = np.arange(len(cell))
        low, high = np.empty(len(cell)), np.empty(len(cell))
        for begin in range(0, len(cell), AT_ONCE):
            some = slice(begin, min(begin + AT_ONCE, len(cell)))
            low[some], high[some] = self.shares_of_cells(_counts_at(sets, place, some))
        if self.displaced is not None:
            flown = maps.cells.everywhere(maps.cells.rocks, 0)[cell]
            low, high = holding(Interval(low=low, high=high), flown, np.full(len(cell), self.rocks.sum()))
        return ReachBand(cell=cell, low=low, high=high)

    def _moved_cells(self, maps: HazardMaps) -> list[Reached]:
        """Return for each set the map cells that its displaced paths reach, and how many rocks reach each cell."""
        assert self.displaced is not None
        pairs = zip(self.cells, self.displaced.moves, strict=True)
        return [moved_cells(cells, rocks, move, maps.raster) for (cells, rocks), move in pairs]


def _counts_at(sets: Sequence[Reached], place: IntArray, some: slice) -> FloatArray:
    """Return the number (S, N) of rocks of each of S sets that reached each of N map cells.

    place : (C,) position of each map cell in a list of cells, -1 for a cell that is not in the list
    some : positions of the N cells in this list, a range
    """
    counts = np.zeros((len(sets), some.stop - some.start))
    for number, (cells, rocks) in enumerate(sets):
        at = place[cells] - some.start
        inside = (at >= 0) & (at < counts.shape[1])
        counts[number, at[inside]] = rocks[inside]
    return counts


def _ends(interval: Interval) -> list[float]:
    return [float(interval.low[0]), float(interval.high[0])]


def _both(interval: Interval, i: int) -> list[float | None]:
    ends = float(interval.low[i]), float(interval.high[i])
    return [None if np.isnan(end) else end for end in ends]


class SetTally:
    """Counts the results of each parameter set of a run: call `end` after the rocks of a set have flown.

    Rocks of one set may fly in several rounds, as with `rocks: auto`.

    tallies : the counts of the run; displaced : counts of the same rocks with displaced paths; None if the error of the
        model is unknown
    """

    def __init__(self, sets: ParameterSets, tallies: Tallies, displaced: DisplacedTally | None = None) -> None:
        self._sets, self._tallies, self._displaced = sets, tallies, displaced
        self._totals = [Totals() for _ in range(len(sets))]
        self._zones = PlaceTally(tallies.zones, len(sets))
        self._areas = PlaceTally(tallies.inside, len(sets))
        self._barriers = None if tallies.barriers is None else _barrier_sets(tallies.barriers, len(sets))
        self._sources = source_set_tally(tallies.sources, len(sets))
        self._cells = [np.zeros(0, dtype=np.uint32) for _ in range(len(sets))]
        self._before = np.zeros(0, dtype=np.uint32)

    def totals_of(self, number: int) -> Totals:
        """Return the totals of set `number`, to which the deposits of its rocks are added while they fly."""
        return self._totals[number]

    def watch_of(self, number: int) -> Watch:
        """Return the function to call with each batch of set `number`; call `watch_of` before the rocks fly.

        The call also starts the counts of this set at barriers.
        """
        if self._barriers is not None:
            self._barriers.begin(number)
        return self._tallies if self._displaced is None else self._displaced.watch_of(number, self._tallies)

    def sink_of(self, number: int, sink: Sink) -> Sink:
        """Return the function to call with deposits and impacts of set `number`; it also calls `sink` with both."""
        return sink if self._displaced is None else self._displaced.sink_of(number, sink)

    def end(self, number: int) -> None:
        """Add to set `number` all rocks counted since the previous call of `end`, whatever set that call was for.

        The counts are those in zones, areas and map cells. Totals and barriers have separate counts for each set.
        Call this after rocks of set `number` have flown, and before rocks of another set fly.
        """
        squares = self._tallies.squares
        after = squares.slots.lines.short[: squares.used, LINE_ROCKS].copy()
        self._cells[number] = _sum(self._cells[number], less(after, self._before))
        self._before = after
        self._zones.end(number)
        self._areas.end(number)
        if self._sources is not None:
            self._sources.end(number)
        if self._displaced is not None:
            self._displaced.end(number)

    def figures(self) -> SetFigures:
        """Return the counts and percentiles of all parameter sets so far."""
        order = self._tallies.squares.slots.cell
        reached = [(np.flatnonzero(counts), counts) for counts in self._cells]
        zones = self._zones.counts()
        rocks = np.array([float(totals.rocks) for totals in self._totals])
        sources = None if self._sources is None else self._sources.counts()
        if sources is not None and self._barriers is not None:
            sources = sources._replace(barriers=self._barriers.source_bands(sources.rocks))
        return SetFigures(
            sets=self._sets,
            rocks=rocks,
            outcomes=tuple(totals.outcomes for totals in self._totals),
            zones=zones,
            areas=self._areas.counts(),
            percentiles={name: self._percentiles(name) for name in SAMPLES},
            cells=tuple((order[slots].astype(np.int64), counts[slots]) for slots, counts in reached),
            displaced=None if self._displaced is None else self._displaced.figures(zones, sources),
            barriers=() if self._barriers is None else self._barriers.bands(rocks),
            sources=sources,
        )

    def _percentiles(self, name: str) -> FloatArray:
        """Return the percentiles (S, P) of the distribution of this name for each set; NaN for a set without values."""
        return percentiles_of([getattr(totals, name) for totals in self._totals])


def _barrier_sets(tally: Any, sets: int) -> Any:
    """Return empty counts at barriers for `sets` sets; tally : `hazard.barriers.BarrierTally` of the run."""
    from rpf3d_core.hazard.by_set.set_barriers import BarrierSets  # imported only for scenes with barriers

    return BarrierSets(tally, sets)


def _sum(first: NDArray[Any], second: NDArray[Any]) -> NDArray[Any]:
    """Return the sum of two arrays of counts; the shorter array is added to the first rows of the longer array."""
    longer, shorter = (first, second) if len(first) > len(second) else (second, first)
    total = longer.copy()
    total[: len(shorter)] += shorter
    return total
