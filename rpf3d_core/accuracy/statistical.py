"""Measure the statistical error: how much maps, shares and the p95 of energy would still change with more rocks."""

import math
from typing import NamedTuple

import numpy as np

from rpf3d_core.accuracy.differences import map_distance
from rpf3d_core.accuracy.flown import FlownSample, Reached, fly, some_rocks
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.statistics import NORMAL_QUANTILE_95
from rpf3d_core.setup.prepared import Prepared

FEWEST = 125
"""Number of rocks of the smallest group that is flown to measure the statistical error."""
MOST = 32_000
"""Largest number of rocks of a group that is flown to measure the statistical error."""
QUANTILE = 0.95


class Sampled(NamedTuple):
    """The statistical errors of results from a number of rocks: the effect of chance that more rocks would reduce.

    rocks : number of rocks
    of_map : estimated distance (-) between the map of these rocks and the map of infinitely many rocks
    apart : distance (-) between the maps of two different groups of this number of rocks
    half_width : half-width of the widest 95 % interval of a share (-)
    energy : half-width of the 95 % interval of the p95 of energy, divided by this p95 (-); None if unknown
    seconds : of one core, to fly the rocks and to count them into maps
    """

    rocks: int
    of_map: float
    apart: float
    half_width: float
    energy: float | None
    seconds: float


class Pair(NamedTuple):
    """Two groups of rocks of equal size but with different rocks, to measure the effect of chance.

    one, other : maps of the two groups; half_width, energy : of the first group, as in `Sampled`
    seconds : s of one core, mean of the two groups
    """

    one: Reached
    other: Reached
    half_width: float
    energy: float | None
    seconds: float


def doublings(prepared: Prepared, budget: float) -> list[Sampled]:
    """Return the statistical errors of 125, 250, 500, ... rocks, until a time budget (s of one core) is used up.

    The largest number of rocks is 32,000. For each number, two groups of different rocks are flown.
    """
    pairs: list[Pair] = []
    rocks, spent = FEWEST, 0.0
    while rocks <= MOST and spent < budget:
        one, other = (fly(prepared, some_rocks(prepared, rocks, lot)) for lot in (0, 1))
        spent += one.seconds + other.seconds
        pairs.append(_pair(one, other))
        rocks *= 2
    everything = together(pairs[-1].one, pairs[-1].other)
    return [_sampled(pair, everything) for pair in pairs]


def _pair(one: FlownSample, other: FlownSample) -> Pair:
    energy = quantile_half_width(one.flights.deposits.max_energy, QUANTILE)
    return Pair(
        one=one.reached,
        other=other.reached,
        half_width=one.places.half_width,
        energy=energy,
        seconds=0.5 * (one.seconds + other.seconds),
    )


def _sampled(pair: Pair, everything: Reached) -> Sampled:
    errors = [distance_from_truth(some, everything) for some in (pair.one, pair.other)]
    apart = map_distance(pair.one, pair.other)
    return Sampled(
        rocks=pair.one.flown,
        of_map=0.5 * sum(errors),
        apart=apart,
        half_width=pair.half_width,
        energy=pair.energy,
        seconds=pair.seconds,
    )


def together(one: Reached, other: Reached) -> Reached:
    """Return one map of the rocks of two maps, as if all these rocks had flown together; no rock may be in both."""
    cells, place = np.unique(np.concatenate([one.cells, other.cells]), return_inverse=True)
    rocks = np.bincount(place, np.concatenate([one.rocks, other.rocks]), len(cells)).astype(np.int64)
    return Reached(cells, rocks, one.flown + other.flown)


def distance_from_truth(some: Reached, everything: Reached) -> float:
    """Return the estimated distance (-) between the map of some rocks and the map of infinitely many rocks.

    The measured distance is that between the maps of n rocks and of all N flown rocks. It is smaller than the distance
    from infinitely many rocks by the factor sqrt(1 - n/N), the correction for a finite population. The distance between
    the maps of two small groups, divided by 2 or sqrt(2), would be too small: in a cell that hardly any rock reaches,
    the two maps differ no more than each of them differs from the map of infinitely many rocks.

    some : map of n rocks; everything : map of all N flown rocks, which include these n rocks

    Sources
    -------
    Cochran 1977, Sampling Techniques, section 2.6.
    """
    left = 1.0 - some.flown / everything.flown
    return min(map_distance(some, everything) / math.sqrt(left), 1.0)


def quantile_half_width(values: FloatArray, quantile: float) -> float | None:
    """Return the relative uncertainty of a quantile: half the width of its 95 % interval divided by its value (-).

    The ends of the interval are two of the sorted values: the number of values below the true quantile has a binomial
    distribution, approximated by a normal distribution. Return None if the interval reaches beyond the smallest or
    largest value, or if the quantile's value is not above 0.

    values : (N,), NaN values are ignored; quantile : 0.95 for the p95 (-)

    Sources
    -------
    Conover 1999, Practical Nonparametric Statistics, section 3.2.
    """
    known = np.sort(values[np.isfinite(values)])
    n = len(known)
    spread = NORMAL_QUANTILE_95 * math.sqrt(n * quantile * (1.0 - quantile))
    low, high = math.floor(n * quantile - spread), math.ceil(n * quantile + spread)
    if low < 1 or high > n:
        return None
    middle = float(known[min(max(math.ceil(n * quantile), 1), n) - 1])
    return 0.5 * float(known[high - 1] - known[low - 1]) / middle if middle > 0.0 else None


def floor_of(rocks: int, sampled: list[Sampled]) -> float:
    """Return the distance (-) that chance alone causes between two maps of different rocks.

    The distance is that of the nearest measured number of rocks, scaled by 1 / sqrt(rocks).

    rocks : number of rocks of each ensemble; sampled : statistical errors of the measured numbers of rocks
    """
    nearest = min(sampled, key=lambda one: abs(math.log(one.rocks / rocks)))
    return min(math.sqrt(nearest.rocks / rocks) * nearest.apart, 1.0)


def beyond_chance(distance: float, chance: float) -> float:
    """Return the part (-) of the distance between two maps that chance does not explain; 0 if chance explains all.

    The distance has two causes: chance, and the difference of the settings (or grounds). Its square is the sum of the
    squares of both effects. Chance has an effect even if both settings fly the same rocks: the paths of rocks with a
    shape are chaotic. With another accuracy, such a rock soon takes another path, and the two maps differ as much as
    maps of different rocks.

    distance : (-), between the maps of two settings
    chance : (-), distance between two maps of one setting, from two groups of different rocks of equal number
    """
    return math.sqrt(max(distance * distance - chance * chance, 0.0))
