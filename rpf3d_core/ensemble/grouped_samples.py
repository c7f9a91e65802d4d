"""Gather the distributions of a quantity in many groups of rocks, such as the rocks of each source, in bounded memory.

Up to `EXACT` values of all groups together are kept unchanged. If there are more, each value is rounded. The number of
significant bits depends on the number of groups, so that memory does not grow with the number of groups. With at most
FULL groups, values are as exact as in a `Sample`. The smallest and the largest value of a group are never rounded.
"""

import math

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.samples import BITS, EXACT, Sample, rounded

FULL = 64
"""Largest number of groups whose values have BITS (11) significant bits; each doubling of the number costs one bit."""
FEWEST_BITS = 5
"""Smallest number of significant bits: 16 different values between a number and its double, so an error below 4 %."""


class GroupedSample:
    """A growing sample of values for each of G groups, such as the energies of the rocks of each source.

    count : (G,) number of values of each group
    low, high : (G,) smallest and largest value of each group, never rounded; inf and -inf for a group without values
    bits : number of significant bits to which values are rounded if there are more than EXACT
    """

    def __init__(self, groups: int) -> None:
        self.bits = max(FEWEST_BITS, BITS - max(0, math.ceil(math.log2(max(groups, 1) / FULL))))
        self._group: IntArray = np.empty(0, dtype=np.int64)
        self._values: FloatArray = np.empty(0)
        self._counts: IntArray = np.empty(0, dtype=np.int64)
        self._waiting: list[tuple[IntArray, FloatArray]] = []
        self.count = np.zeros(groups, dtype=np.int64)
        self.low, self.high = np.full(groups, np.inf), np.full(groups, -np.inf)

    def add(self, group: IntArray, values: FloatArray) -> None:
        """Add values (N,) to groups; values that are not finite are ignored, as in a `Sample`.

        group : (N,) number of the group of each value
        """
        finite = np.isfinite(values)
        if not finite.any():
            return
        group, values = group[finite], values[finite]
        self._waiting.append((group, values))
        np.add.at(self.count, group, 1)
        np.minimum.at(self.low, group, values)
        np.maximum.at(self.high, group, values)
        if sum(len(values) for _, values in self._waiting) > EXACT:
            self._settle()

    def join(self, other: "GroupedSample") -> None:
        """Add the values of another sample of the same groups, such as another part of a run.

        The result has the same bits as if all values were added to this sample.
        """
        other._settle()
        self._settle()
        self.count += other.count
        self.low, self.high = np.minimum(self.low, other.low), np.maximum(self.high, other.high)
        self._merge(
            np.concatenate([self._group, other._group]), np.concatenate([self._values, other._values]),
            np.concatenate([self._counts, other._counts]),
        )  # fmt: skip

    def of(self, first: int, last: int) -> Sample:
        """Return one sample of all values of the groups from `first` up to, but not including, group `last`."""
        self._settle()
        some = slice(*np.searchsorted(self._group, [first, last]).tolist())
        low, high = self.low[first:last].min(initial=np.inf), self.high[first:last].max(initial=-np.inf)
        return Sample.counted(self._values[some], self._counts[some], low, high)

    def percentiles(self, wanted: int, fewest: int) -> FloatArray:
        """Return one percentile (G,) of each of G groups, in the unit of the values, as in `Sample.percentiles`.

        The result is NaN for a group without values, or with fewer values than `fewest`.

        wanted : the percentile, in percent
        """
        self._settle()
        found, many = np.full(len(self.count), np.nan), np.flatnonzero(self.count >= max(fewest, 1))
        ends, before = np.cumsum(self._counts), np.cumsum(self.count) - self.count
        rank = np.array(wanted) / 100.0 * (self.count[many] - 1)
        low, high = (
            self._values[np.searchsorted(ends, before[many] + edge(rank), side="right")] for edge in (np.floor, np.ceil)
        )
        found[many] = low + (high - low) * (rank - np.floor(rank))
        return found

    def _settle(self) -> None:
        """Merge the values added since the last call into the distinct values and their counts."""
        if not self._waiting:
            return
        group = np.concatenate([self._group, *(group for group, _ in self._waiting)])
        values = np.concatenate([self._values, *(values for _, values in self._waiting)])
        new = len(values) - len(self._values)
        self._waiting = []
        self._merge(group, values, np.concatenate([self._counts, np.ones(new, dtype=np.int64)]))

    def _merge(self, group: IntArray, values: FloatArray, counts: IntArray) -> None:
        """Keep the given values as the content of the sample, with one row for each distinct value of a group."""
        kept = values if self.count.sum() <= EXACT else rounded(values, self.bits)
        order = np.lexsort((kept, group))
        group, kept, counts = group[order], kept[order], counts[order]
        new = np.append(True, (group[1:] != group[:-1]) | (kept[1:] != kept[:-1]))[: len(kept)]
        first = np.flatnonzero(new)
        self._group, self._values = group[first], kept[first]
        self._counts = np.add.reduceat(counts, first) if len(first) else counts
