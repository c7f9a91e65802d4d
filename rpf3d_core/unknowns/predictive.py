"""Predictive intervals: the range of a result at a site whose parameters are unknown.

Each parameter set gives its own result. The parameters of the site are one more draw from the same distribution. So the
result of the site lies between rank a and rank b of the S results of the sets with probability (b - a) / (S + 1),
whatever the distribution of the results.

A set flies only n rocks, so its share also has noise, which is not a property of the ground. The variance of this noise
is known and is subtracted: the shares of the sets are moved towards their mean until their variance is that of sets
without noise. The variance between sets is itself an estimate, so one standard error is added to it. Noise is not
subtracted if a set has, on average, few rocks that the share counts, or few rocks that the share does not count: the
interval is then wider. The interval is never narrower than the sampling interval of all rocks together.

If at most half of the sets have a rock that the share counts, the ranks do not show well how large the share of a site
with such rocks may be. `shares_of_site` then bounds the share by Markov's inequality.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.statistics import wilson_intervals

FloatArray = NDArray[np.float64]

LEVEL = 0.95
"""Probability (-) with which a predictive interval contains the result."""

FEWEST = 5.0
"""Smallest mean number of rocks per set, both of rocks that the share counts and of others, to subtract the noise."""


ENOUGH = 39
"""Smallest number of sets whose extreme results enclose one more result with 95 %: (39 - 1) / (39 + 1)."""


class Interval(NamedTuple):
    """The ends of N intervals; NaN where an interval is unknown.

    low, high : (N,) lower and upper ends, in the unit of the quantity
    """

    low: FloatArray
    high: FloatArray


def predictive_shares(counts: FloatArray, totals: FloatArray, level: float = LEVEL) -> Interval:
    """Return the predictive intervals of N shares (-).

    counts : (S, N) number of rocks of each set that the share counts, such as the rocks that reached an area
    totals : (S, N) number of rocks of each set; a set without rocks has no share
    level : probability that an interval contains the share of one more set (-)

    The ends are NaN if fewer than ENOUGH (39) sets have rocks: with 20 sets, for example, one more share lies between
    the smallest and the largest share with a probability of only 90 %.
    """
    has = totals > 0
    sets = has.sum(axis=0)
    shares = np.where(has, counts / np.maximum(totals, 1), np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.nansum(shares, axis=0) / sets
        seen = np.nansum((shares - mean) ** 2, axis=0) / (sets - 1)
        kept = np.sqrt(np.clip(_between(shares, totals, seen, sets) / seen, 0.0, 1.0))
        rarer = np.minimum(counts.sum(axis=0), (totals - counts).sum(axis=0))
        kept = np.where((seen > 0.0) & (rarer >= FEWEST * sets), kept, 1.0)
        low, high = ranked(mean + kept * (shares - mean), level)
        pooled = wilson_intervals(counts.sum(axis=0), np.maximum(totals.sum(axis=0), 1))
    enough = sets >= ENOUGH
    return Interval(
        low=np.where(enough, np.clip(np.minimum(low, pooled[0]), 0.0, 1.0), np.nan),
        high=np.where(enough, np.clip(np.maximum(high, pooled[1]), 0.0, 1.0), np.nan),
    )


def shares_of_site(counts: FloatArray, totals: FloatArray) -> Interval:
    """Return the predictive intervals (95 %) of N shares (-), widened so that rare rocks are not underestimated.

    The upper end is at least `least_end` of the counted rocks. The lower end is at most 1 minus `least_end` of the
    rocks that are not counted.

    The live simulator uses `predictive_shares` instead, because alerts have their own limits for too few rocks. Cells
    of maps use `predictive_shares` too, because few sets reach a cell (`SetFigures.shares_of_cells`).

    counts, totals : (S, N) as for `predictive_shares`; ends are NaN as for `predictive_shares`
    """
    low, high = predictive_shares(counts, totals)
    return Interval(
        low=np.minimum(low, 1.0 - least_end(totals - counts, totals)), high=np.maximum(high, least_end(counts, totals))
    )


def least_end(counts: FloatArray, totals: FloatArray) -> FloatArray:
    """Return the smallest upper ends (N,) that predictive intervals of N shares (-) may have.

    The result is the smaller of two bounds. First bound: if a share p has the mean m over all sites, then
    P(p > x) <= m / x (Markov's inequality). The share of a site exceeds the upper end with a probability of 2.5 %, so
    the upper end is at most m / 0.025. For m, the upper end of the sampling interval of the mean share is used. Second
    bound: the upper end of the sampling interval of the largest share of a single set. Both bounds count only the hits,
    that is the counted rocks, of the 2.5 % of the sets (rounded up to whole sets) with the largest
    shares. So, while at most half of the sets have a hit, an interval of `shares_of_site` never becomes lower if a set
    has more hits. If more than half of the sets have a hit, the ranks show the upper end, and each of these largest
    shares counts as one hit at most.

    counts : (S, N) number of rocks of each set that the share counts, the hits; totals : (S, N) number of rocks of each
        set. The sets have equal weights; sampling errors are computed from the harmonic mean of the numbers of rocks
    """
    tail, has = 0.5 * (1.0 - LEVEL), totals > 0
    sets = np.maximum(has.sum(axis=0), 1)
    rocks = sets / np.maximum(np.where(has, 1.0 / np.maximum(totals, 1), 0.0).sum(axis=0), 1e-12)
    shares = np.where(has, counts / np.maximum(totals, 1), 0.0)
    many_hit = 2 * (shares > 0.0).sum(axis=0) > sets
    shares = np.where(many_hit, np.minimum(shares, 1.0 / rocks), shares)
    few = np.arange(len(shares))[:, None] < np.ceil(tail * sets)
    shares = np.where(few, np.sort(shares, axis=0)[::-1], 0.0)
    mean = wilson_intervals(shares.sum(axis=0) * rocks, sets * rocks)[1]
    most = wilson_intervals(shares.max(axis=0) * rocks, rocks)[1]
    return np.asarray(np.minimum(np.minimum(mean / tail, most), 1.0))


def holding(interval: Interval, counts: FloatArray, totals: FloatArray) -> Interval:
    """Return N intervals (-), each widened so that it contains the 95 % sampling interval of the share counts / totals.

    Ends that are NaN stay NaN. An interval is not widened where `totals` is 0.

    counts : (N,) number of rocks that the share counts; totals : (N,) number of rocks in total
    """
    low, high = wilson_intervals(counts, np.maximum(totals, 1))
    some = totals > 0
    return Interval(
        low=np.where(some, np.minimum(interval.low, low), interval.low),
        high=np.where(some, np.maximum(interval.high, high), interval.high),
    )


def _between(shares: FloatArray, totals: FloatArray, seen: FloatArray, sets: NDArray[np.int64]) -> FloatArray:
    """Return the variance (N,) of N shares between parameter sets, without noise, plus one standard error.

    Noise is the variance of a share that is due to the number of rocks. The noise of a set with a single rock cannot be
    measured and counts as 0.

    shares : (S, N) (-), shares in each set; totals : (S, N) number of rocks of each set
    seen : (N,) variance of the shares between sets, noise included; sets : (N,) number of sets with rocks
    """
    noise = np.where(totals > 1, shares * (1.0 - shares) / np.maximum(totals - 1, 1), 0.0)
    upper = seen * (1.0 + np.sqrt(2.0 / (sets - 1)))
    return np.asarray(np.maximum(upper - np.nansum(noise, axis=0) / sets, 0.0))


def ranked(values: FloatArray, level: float = LEVEL) -> Interval:
    """Return the intervals that contain one more draw with probability `level`, from S draws (S, N) of N quantities.

    Values that are NaN count as missing. With too few draws for the level, the ends are the smallest and the largest
    draw; without a draw, both ends are NaN.
    """
    some = np.sort(values, axis=0)  # NaN sort to the end
    sets = np.isfinite(some).sum(axis=0)
    tail = 0.5 * (1.0 - level) * (sets + 1)
    return Interval(low=_at_rank(some, sets, tail), high=_at_rank(some, sets, sets + 1 - tail))


def ranked_if_enough(values: FloatArray) -> Interval:
    """Return the intervals of `ranked` for a level of 95 %, from S draws (S, N); NaN if fewer than 39 draws are known.

    Ends have the unit of the values.
    """
    low, high = ranked(values)
    enough = np.isfinite(values).sum(axis=0) >= ENOUGH
    return Interval(low=np.where(enough, low, np.nan), high=np.where(enough, high, np.nan))


def _at_rank(some: FloatArray, sets: NDArray[np.int64], rank: FloatArray) -> FloatArray:
    """Return the values (N,) at ranks (N,), counted from 1, of sorted values (S, N), linear between ranks.

    some : (S, N) values, sorted in each column, NaN last; sets : (N,) number of values in each column that are not NaN
    rank : (N,) ranks, not necessarily whole numbers; limited to 1 and the number of values
    """
    place = np.clip(rank, 1.0, np.maximum(sets, 1)) - 1.0
    low = np.floor(place).astype(np.int64)
    high = np.minimum(low + 1, np.maximum(sets - 1, 0))
    columns = np.arange(some.shape[1])
    return np.asarray(some[low, columns] + (place - low) * (some[high, columns] - some[low, columns]))
