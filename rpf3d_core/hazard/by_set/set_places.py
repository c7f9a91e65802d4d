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
        """Add to set `number` all counts since the previous call of `end`, whatever set that call was for."""
        tally = self.tally
        cells, after = tally.slots.cell[: tally.used], np.zeros_like(self._before)
        for line, kind in enumerate((LINE_ROCKS, LINE_DEPOSITS)):
            after[line, cells] = tally.slots.lines.short[: tally.used, kind]
        self._counts[number] += after - self._before
        some = np.flatnonzero(after[0, cells] != self._before[0, cells])  # slots with new rocks; often few of many
        if len(some):
            bins = bins_of(tally, ENERGY, some)
            self._bins = _with_rows(self._bins, tally.used, bins.shape[1])
            new = bins - self._bins[some]
            row, column = np.nonzero(new)
            self._filled[number].append((some[row], column, new[row, column]))
            self._bins[some] = bins
        self._before = after

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
        rocks = self._bins[: tally.used].sum(axis=1, dtype=np.int64)
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
        if not filled:
            return energy
        slots = np.unique(np.concatenate([slot for slot, _, _ in filled]))
        bins = np.zeros((len(slots), self._bins.shape[1]), dtype=np.uint32)
        for slot, column, rocks in filled:
            bins[np.searchsorted(slots, slot), column] += rocks
        rocks = bins.sum(axis=1, dtype=np.int64)
        many = np.flatnonzero(rocks >= fewest)
        if len(many):
            ranks = -((-rocks[many] * P95) // 100)
            energy[tally.slots.cell[slots[many]]] = rank_values(tally, ENERGY, bins[many], ranks)
        return energy


def _with_rows(bins: NDArray[np.uint32], rows: int, columns: int) -> NDArray[np.uint32]:
    """Return bins (S, B) with rows of 0 added at the end, so that there are at least `rows` rows of `columns` bins."""
    if len(bins) >= rows:
        return bins
    longer = np.zeros((max(rows, 2 * len(bins)), columns), dtype=np.uint32)
    longer[: len(bins), : bins.shape[1]] = bins
    return longer


def less(after: NDArray[Any], before: NDArray[Any]) -> NDArray[Any]:
    """Return counts (N,) or (N, B) minus the earlier counts `before`; rows that `before` does not have count as 0."""
    new = after.copy()
    new[: len(before)] -= before
    return new
