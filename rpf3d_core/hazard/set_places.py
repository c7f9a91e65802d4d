"""Counts and p95 energies of each parameter set in zones or areas.

All sets share the counts of the run. The counts of one set are the counts of the run after the rocks of the set have
flown, minus the counts of the run before.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.statistics import NORMAL_QUANTILE_95
from rpf3d_core.hazard.layers import ENERGY, bins_of, rank_values
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.cache_lines import LINE_DEPOSITS, LINE_ROCKS

P95 = 95

Filled = tuple[IntArray, IntArray, NDArray[np.uint32]]
"""The N bins that contain rocks: row (N,) and column (N,) in the array of bins, and number of rocks (N,)."""


@dataclass(frozen=True, eq=False)
class PlaceCounts:
    """The counts and p95 energies of S sets in P zones or areas.

    reached, stopped : (S, P) number of rocks that reached each place, and that stopped there
    energy : (S, P) J, p95 energy; NaN for fewer than 20 rocks of the set
    energy_sampling : (P, 2) J, the 95 % sampling interval of the p95 energy of all rocks; NaN for too few rocks
    """

    reached: FloatArray
    stopped: FloatArray
    energy: FloatArray
    energy_sampling: FloatArray


class PlaceTally:
    """The counts of zones or areas for each parameter set, from a tally that all sets share.

    The rocks of the sets fly one set after another: call `end` after the rocks of a set have flown.
    """

    def __init__(self, tally: CellTally, sets: int) -> None:
        places = len(tally.slot)
        self.tally = tally
        self._counts = np.zeros((sets, 2, places), dtype=np.int64)
        self._before = np.zeros((2, places), dtype=np.int64)
        self._bins = np.zeros((0, 0), dtype=np.uint32)
        self._filled: list[list[Filled]] = [[] for _ in range(sets)]

    def end(self, number: int) -> None:
        """Add to set `number` all that the tally has counted since the previous call of `end`, for whatever set."""
        tally = self.tally
        cells, after = tally.slots.cell[: tally.used], np.zeros_like(self._before)
        for row, kind in enumerate((LINE_ROCKS, LINE_DEPOSITS)):
            after[row, cells] = tally.slots.lines.short[: tally.used, kind]
        self._counts[number] += after - self._before
        bins = bins_of(tally, ENERGY)
        new = less(bins, self._bins) if len(self._bins) else bins
        slot, column = np.nonzero(new)
        if len(slot):
            self._filled[number].append((slot, column, new[slot, column]))
        self._before, self._bins = after, bins

    def counts(self) -> PlaceCounts:
        """Return the counts of all sets."""
        stopped, sampling = self._counts[:, 1].astype(float), self._sampling()
        return PlaceCounts(
            reached=self.reached, stopped=stopped, energy=self.energies(FEWEST_ROCKS), energy_sampling=sampling
        )

    @property
    def reached(self) -> FloatArray:
        """Numbers (S, P) of rocks (-): how many rocks of each set reached each place."""
        return self._counts[:, 0].astype(float)

    def energies(self, fewest: int) -> FloatArray:
        """Return the p95 energies (S, P) J of the rocks of each set in each place; NaN for fewer rocks than `fewest`.

        The p95 of fewer than 20 rocks is their largest energy.
        """
        return np.array([self._energies(filled, fewest) for filled in self._filled])

    def _sampling(self) -> FloatArray:
        """Return the sampling intervals (P, 2) J of the p95 energies over the rocks of all sets; NaN if unknown.

        Ranks are computed as in `Sample.interval`.
        """
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

    def _energies(self, filled: "list[Filled]", fewest: int) -> FloatArray:
        """Return the p95 energy (P,) J of the rocks of one set in each place; NaN for fewer rocks than `fewest`.

        filled : the bins of energy that contain rocks of this set
        """
        tally, energy = self.tally, np.full(len(self.tally.slot), np.nan)
        bins = np.zeros(self._bins.shape, dtype=np.uint32)
        for slot, column, rocks in filled:
            bins[slot, column] += rocks
        rocks = bins.sum(axis=1, dtype=np.int64)
        many = np.flatnonzero(rocks >= fewest)
        if len(many):
            energy[tally.slots.cell[many]] = rank_values(tally, ENERGY, bins[many], -((-rocks[many] * P95) // 100))
        return energy


def less(after: NDArray[Any], before: NDArray[Any]) -> NDArray[Any]:
    """Return counts (N,) or (N, B) minus the earlier counts `before`; rows that `before` does not have count as 0."""
    new = after.copy()
    new[: len(before)] -= before
    return new
