"""What each parameter set did: counts of rocks by outcome, zone, area and map cell, and percentiles, set by set.

The counts of all sets together are the hazard maps of the run. The counts of one set are the difference of the common
counts after and before its rocks have flown. So sets cost no memory of their own while rocks fly.
"""

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.statistics import NORMAL_QUANTILE_95, PERCENTILES
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.layers import ENERGY, bins_of, rank_values
from rpf3d_core.hazard.maps import FEWEST_ROCKS, HazardMaps
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.cache_lines import LINE_DEPOSITS, LINE_ROCKS
from rpf3d_core.unknowns.parameter_sets import ParameterSets
from rpf3d_core.unknowns.predictive import ENOUGH, Interval, predictive_shares, ranked_if_enough
from rpf3d_core.values import Outcome

P95 = 95
SAMPLES = ("runout", "max_speed", "max_energy", "max_height", "ground_speed")
"""Names of the distributions in `Totals` whose percentiles are kept for each set."""
AT_ONCE = 65_536
"""Number of map cells whose intervals are computed at once, to save memory."""

Filled = tuple[IntArray, IntArray, NDArray[np.uint32]]
"""Bins that hold rocks: row, column and number of rocks of each (N,)."""


@dataclass(frozen=True, eq=False)
class PlaceCounts:
    """The rocks of S sets in P zones or areas: (S, P) rocks that reached and that stopped, and p95 energies (J).

    energy : NaN for fewer than 20 rocks of the set
    energy_sampling : (P, 2) J, the 95 % sampling interval of the p95 energy of all rocks; NaN for too few rocks
    """

    reached: FloatArray
    stopped: FloatArray
    energy: FloatArray
    energy_sampling: FloatArray


@dataclass(frozen=True, eq=False)
class SetFigures:
    """What the parameter sets of a run did, set by set, from which predictive intervals follow.

    sets : the S sets; rocks : (S,) rocks that flew with each; outcomes : of each set
    zones, areas : counts by place; percentiles : by name of `SAMPLES`, (S, P) of `PERCENTILES`, NaN for no rocks
    cells : for each set, map cells that its rocks reached and how many rocks reached each
    """

    sets: ParameterSets
    rocks: FloatArray
    outcomes: tuple[Counter[Outcome], ...]
    zones: PlaceCounts
    areas: PlaceCounts
    percentiles: dict[str, FloatArray]
    cells: tuple[tuple[IntArray, NDArray[np.uint32]], ...]

    @property
    def flown(self) -> int:
        """The number of sets with which rocks have flown."""
        return int((self.rocks > 0).sum())

    @property
    def enough_flown(self) -> bool:
        """True if at least 39 sets have flown, which predictive intervals of 95 % need."""
        return self.flown >= ENOUGH

    def outcome(self, outcome: Outcome) -> list[float]:
        """Return the predictive interval of the share of rocks with an outcome."""
        counts = np.array([float(each[outcome]) for each in self.outcomes])
        return _ends(predictive_shares(counts[:, None], self.rocks[:, None]))

    def shares(self, counts: FloatArray, of: FloatArray | None = None) -> Interval:
        """Return the predictive intervals of N shares, from counts (S, N) of all rocks, or `of` others (S, N)."""
        totals = np.broadcast_to(self.rocks[:, None], counts.shape) if of is None else of
        return predictive_shares(counts, totals)

    def predictive(self, kind: str) -> dict[str, Interval]:
        """Return the predictive intervals of the figures of all zones ("zone") or areas ("area"), by figure."""
        places = self.zones if kind == "zone" else self.areas
        return {
            "reached": self.shares(places.reached),
            "stopped": self.shares(places.stopped),
            "retained": self.shares(places.stopped, places.reached),
            "energy": ranked_if_enough(places.energy),
        }

    def sampling_of_energy(self, kind: str) -> FloatArray:
        """Return the sampling intervals (P, 2) J of the p95 energies of all zones ("zone") or areas ("area")."""
        return (self.zones if kind == "zone" else self.areas).energy_sampling

    def percentile(self, name: str) -> dict[str, list[float | None]]:
        """Return the predictive interval of each percentile of a distribution of `SAMPLES`, by p5 and so on."""
        found = ranked_if_enough(self.percentiles[name])
        return {f"p{p}": _both(found, i) for i, p in enumerate(PERCENTILES)}

    def reach(self, maps: HazardMaps) -> Interval:
        """Return the predictive intervals of the reach probability (N,) of the N map cells that rocks reached."""
        place = np.full(maps.cells.count, -1, dtype=np.int64)
        place[maps.cells.cell] = np.arange(len(maps.cells.cell))
        low, high = np.empty(len(maps.cells.cell)), np.empty(len(maps.cells.cell))
        for begin in range(0, len(low), AT_ONCE):
            some = slice(begin, min(begin + AT_ONCE, len(low)))
            counts = np.zeros((len(self.rocks), some.stop - begin))
            for number, (cells, rocks) in enumerate(self.cells):
                at = place[cells] - begin
                inside = (at >= 0) & (at < counts.shape[1])
                counts[number, at[inside]] = rocks[inside]
            low[some], high[some] = self.shares(counts)
        return Interval(low=low, high=high)


def _ends(interval: Interval) -> list[float]:
    return [float(interval.low[0]), float(interval.high[0])]


def _both(interval: Interval, i: int) -> list[float | None]:
    ends = float(interval.low[i]), float(interval.high[i])
    return [None if np.isnan(end) else end for end in ends]


class SetTally:
    """Counts what each parameter set of a run does: call `end` after the rocks of a set have flown.

    A set may fly several times, as with `rocks: auto`.
    """

    def __init__(self, sets: ParameterSets, tallies: Tallies) -> None:
        self._sets, self._tallies = sets, tallies
        self._totals = [Totals() for _ in range(len(sets))]
        self._zones = _PlaceTally(tallies.zones, len(sets))
        self._areas = _PlaceTally(tallies.inside, len(sets))
        self._cells = [np.zeros(0, dtype=np.uint32) for _ in range(len(sets))]
        self._before = np.zeros(0, dtype=np.uint32)

    def totals_of(self, number: int) -> Totals:
        """Return the totals of a set, to which its deposits are added while its rocks fly."""
        return self._totals[number]

    def end(self, number: int) -> None:
        """Add what has been counted since the last call to a set, after its rocks have flown."""
        squares = self._tallies.squares
        after = squares.slots.lines.short[: squares.used, LINE_ROCKS].copy()
        self._cells[number] = _sum(self._cells[number], _less(after, self._before))
        self._before = after
        self._zones.end(number)
        self._areas.end(number)

    def figures(self) -> SetFigures:
        """Return what the sets did so far."""
        order = self._tallies.squares.slots.cell
        reached = [(np.flatnonzero(counts), counts) for counts in self._cells]
        return SetFigures(
            sets=self._sets,
            rocks=np.array([float(totals.rocks) for totals in self._totals]),
            outcomes=tuple(totals.outcomes for totals in self._totals),
            zones=self._zones.counts(),
            areas=self._areas.counts(),
            percentiles={name: self._percentiles(name) for name in SAMPLES},
            cells=tuple((order[slots].astype(np.int64), counts[slots]) for slots, counts in reached),
        )

    def _percentiles(self, name: str) -> FloatArray:
        """Return the percentiles (S, P) of a distribution, NaN for a set without values."""
        samples = [getattr(totals, name) for totals in self._totals]
        nothing = [np.nan] * len(PERCENTILES)
        return np.array([sample.percentiles(PERCENTILES) if sample.count else nothing for sample in samples])


class _PlaceTally:
    """The counts of zones or areas, set by set, as differences of the common counts of a tally."""

    def __init__(self, tally: CellTally, sets: int) -> None:
        places = len(tally.slot)
        self.tally = tally
        self._counts = np.zeros((sets, 2, places), dtype=np.int64)
        self._before = np.zeros((2, places), dtype=np.int64)
        self._bins = np.zeros((0, 0), dtype=np.uint32)
        self._filled: list[list[Filled]] = [[] for _ in range(sets)]

    def end(self, number: int) -> None:
        """Add what has been counted since the last call to a set."""
        tally = self.tally
        cells, after = tally.slots.cell[: tally.used], np.zeros_like(self._before)
        for row, kind in enumerate((LINE_ROCKS, LINE_DEPOSITS)):
            after[row, cells] = tally.slots.lines.short[: tally.used, kind]
        self._counts[number] += after - self._before
        bins = bins_of(tally, ENERGY)
        new = _less(bins, self._bins) if len(self._bins) else bins
        slot, column = np.nonzero(new)
        self._filled[number].append((slot, column, new[slot, column]))
        self._before, self._bins = after, bins

    def counts(self) -> PlaceCounts:
        """Return the counts of all sets."""
        energy = np.array([self._energies(filled) for filled in self._filled])
        reached, stopped = self._counts[:, 0].astype(float), self._counts[:, 1].astype(float)
        return PlaceCounts(reached=reached, stopped=stopped, energy=energy, energy_sampling=self._sampling())

    def _sampling(self) -> FloatArray:
        """Return the sampling intervals (P, 2) J of the p95 energies of all rocks, by ranks as in `Sample.interval`."""
        tally, ends = self.tally, np.full((len(self.tally.slot), 2), np.nan)
        rocks = self._bins.sum(axis=1, dtype=np.int64)
        half = NORMAL_QUANTILE_95 * np.sqrt(rocks * P95 * (100 - P95)) / 100.0
        ranks = (np.floor(rocks * P95 / 100.0 - half), np.ceil(rocks * P95 / 100.0 + half) + 1)
        for end, rank in enumerate(ranks):
            some = np.flatnonzero((rank >= 1) & (rank <= rocks) & (rocks >= FEWEST_ROCKS))
            if len(some):
                values = rank_values(tally, ENERGY, self._bins[some], rank[some].astype(np.int64))
                ends[tally.slots.cell[some], end] = values
        return ends

    def _energies(self, filled: "list[Filled]") -> FloatArray:
        """Return the p95 energy (P,) J of the rocks of a set in each place, from the bins that they fill."""
        tally, energy = self.tally, np.full(len(self.tally.slot), np.nan)
        bins = np.zeros(self._bins.shape, dtype=np.uint32)
        for slot, column, rocks in filled:
            bins[slot, column] += rocks
        rocks = bins.sum(axis=1, dtype=np.int64)
        many = np.flatnonzero(rocks >= FEWEST_ROCKS)
        if len(many):
            energy[tally.slots.cell[many]] = rank_values(tally, ENERGY, bins[many], -((-rocks[many] * P95) // 100))
        return energy


def _less(after: NDArray[Any], before: NDArray[Any]) -> NDArray[Any]:
    """Return what has been added to counts (N,) or (N, B), of whose rows the first were there before."""
    new = after.copy()
    new[: len(before)] -= before
    return new


def _sum(first: NDArray[Any], second: NDArray[Any]) -> NDArray[Any]:
    """Return the sum of two arrays of counts, of which one may have fewer rows."""
    longer, shorter = (first, second) if len(first) > len(second) else (second, first)
    total = longer.copy()
    total[: len(shorter)] += shorter
    return total
