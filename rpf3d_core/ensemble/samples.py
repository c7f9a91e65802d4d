"""Gather the distribution of a quantity over many rocks, in bounded memory and independent of the order of the rocks.

Up to `EXACT` values are kept unchanged. If there are more, each value is rounded to 11 significant bits: between a
number and its double, about a thousand different values remain. Percentiles are then exact to 0.05 %. The smallest and
the largest value are never rounded.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.statistics import NORMAL_QUANTILE_95

EXACT = 100_000
"""Largest number of values of a sample that are kept without rounding."""
BITS = 11
"""Number of significant bits of a rounded value; the relative error is at most 2^-BITS."""


class Sample:
    """A growing sample of the values of one quantity, from which percentiles and means are computed.

    Values that are not finite count as unknown and are ignored.

    count : number of finite values; low, high : smallest and largest value, inf and -inf without values
    """

    def __init__(self, values: ArrayLike = ()) -> None:
        self._values: FloatArray = np.empty(0)
        self._counts: IntArray = np.empty(0, dtype=np.int64)
        self._waiting: list[FloatArray] = []
        self.count = 0
        self.low, self.high = np.inf, -np.inf
        self.add(values)

    @classmethod
    def counted(cls, values: FloatArray, counts: IntArray, low: float, high: float) -> "Sample":
        """Return a sample of values (V,), in any order, each of which occurs as often as `counts` (V,) states.

        low, high : smallest and largest value, in the unit of the values
        """
        sample = cls()
        sample._values, sample._counts, sample.count = values, counts, int(counts.sum())
        sample.low, sample.high = low, high
        return sample

    def add(self, values: ArrayLike) -> None:
        """Add more values (N,) to the sample."""
        some = np.asarray(values, dtype=float)
        some = some[np.isfinite(some)]
        if not len(some):
            return
        self._waiting.append(some)
        self.count += len(some)
        self.low, self.high = min(self.low, some.min(initial=np.inf)), max(self.high, some.max(initial=-np.inf))
        if sum(map(len, self._waiting)) > EXACT:
            self._settle()

    def join(self, other: "Sample") -> None:
        """Add the values of another sample, such as another part of a run.

        The result has the same bits as if all values were added to this sample.
        """
        other._settle()
        self._settle()
        self.count += other.count
        self.low, self.high = min(self.low, other.low), max(self.high, other.high)
        self._merge(np.concatenate([self._values, other._values]), np.concatenate([self._counts, other._counts]))

    def sorted(self) -> tuple[FloatArray, IntArray]:
        """Return the distinct values (V,) of the sample, in its unit, ascending, and how often each occurs (V,)."""
        self._settle()
        return self._values, self._counts

    def percentiles(self, wanted: tuple[int, ...]) -> list[float]:
        """Return percentiles of a sample of at least one value, interpolated linearly between neighbouring values.

        wanted : the percentiles to return, in percent, such as (5, 50, 95)
        """
        values, counts = self.sorted()
        ends = np.cumsum(counts)
        rank = np.array(wanted) / 100.0 * (self.count - 1)
        low, high = (values[np.searchsorted(ends, edge(rank), side="right")] for edge in (np.floor, np.ceil))
        cuts: list[float] = (low + (high - low) * (rank - np.floor(rank))).tolist()
        return cuts

    def interval(self, wanted: int) -> tuple[float | None, float | None]:
        """Return the 95 % confidence interval of a percentile, valid for any distribution.

        Each end of the interval is a value of the sample. An end is None if the sample has too few values: the upper
        end for a high percentile, the lower end for a low percentile. A value lies in the interval if the share of
        smaller values in the sample agrees with `wanted` by the score test, the test behind Wilson's interval.

        wanted : the percentile, in percent

        Sources
        -------
        Conover 1999, Practical Nonparametric Statistics, 3rd ed., section 3.2: intervals of quantiles by ranks.
        """
        share, values = wanted / 100.0, self.count
        half = NORMAL_QUANTILE_95 * math.sqrt(values * share * (1.0 - share))
        low, high = math.floor(values * share - half), math.ceil(values * share + half) + 1
        return self._ranked(low), self._ranked(high)

    def _ranked(self, rank: int) -> float | None:
        """Return the value at a rank of the sorted sample; None if the rank is below 1 or above the number of values.

        rank : 1 for the smallest value
        """
        if not 1 <= rank <= self.count:
            return None
        values, counts = self.sorted()
        return float(values[np.searchsorted(np.cumsum(counts), rank)])

    def mean(self) -> float:
        """Return the mean of a sample of at least one value."""
        values, counts = self.sorted()
        return float((values * counts).sum() / self.count)

    def sd(self) -> float:
        """Return the sample standard deviation of at least two values."""
        values, counts = self.sorted()
        return float(np.sqrt((counts * (values - self.mean()) ** 2).sum() / (self.count - 1)))

    def summary(self, wanted: tuple[int, ...]) -> dict[str, Any]:
        """Return the figures for a run's summary: number of values, percentiles (p5 and so on) and largest value.

        wanted : percentiles, in percent; without values, all figures but the number are None
        """
        if self.count == 0:
            return {"rocks": 0, **{f"p{p}": None for p in wanted}, "max": None}
        cuts = {f"p{p}": cut for p, cut in zip(wanted, self.percentiles(wanted), strict=True)}
        return {"rocks": self.count, **cuts, "max": float(self.high)}

    def _settle(self) -> None:
        """Merge the values added since the last call into the distinct values and their counts."""
        some = np.concatenate(self._waiting) if self._waiting else np.empty(0)
        self._waiting = []
        ones = np.ones(len(some), dtype=np.int64)
        self._merge(np.concatenate([self._values, some]), np.concatenate([self._counts, ones]))

    def _merge(self, values: FloatArray, counts: IntArray) -> None:
        kept = values if self.count <= EXACT else rounded(values)
        self._values, place = np.unique(kept, return_inverse=True)
        self._counts = np.bincount(place, weights=counts, minlength=len(self._values)).astype(np.int64)


def rounded(values: FloatArray, bits: int = BITS) -> FloatArray:
    """Return values (N,) rounded to `bits` significant bits, so that a large sample has few distinct values."""
    mantissa, exponent = np.frexp(values)
    return np.asarray(np.ldexp(np.round(mantissa * 2.0**bits), exponent - bits))
