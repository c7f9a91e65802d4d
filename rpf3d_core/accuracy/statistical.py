"""What the number of rocks leaves open: maps of some of all rocks flown, intervals of shares, p95 of energy."""

import math
from typing import NamedTuple

import numpy as np

from rpf3d_core.accuracy.differences import map_distance
from rpf3d_core.accuracy.flown import FlownSample, Reached, fly, some_rocks
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.statistics import NORMAL_QUANTILE_95
from rpf3d_core.setup.prepared import Prepared

FEWEST = 125
"""Rocks that the doublings begin with."""
MOST = 32_000
"""Rocks that they end with."""
QUANTILE = 0.95


class Sampled(NamedTuple):
    """What is known from so many rocks.

    of_map : distance (-) of their map from that of all rocks there could be; apart : of two such maps from each other
    half_width : of the widest 95 % interval of a share (-)
    energy : half-width of the 95 % interval of the p95 of energy over that p95 (-), None if unknown
    """

    rocks: int
    of_map: float
    apart: float
    half_width: float
    energy: float | None
    seconds: float


class Pair(NamedTuple):
    """Two ensembles of as many, but other, rocks: their maps, and what is known from one of them, as of `Sampled`."""

    one: Reached
    other: Reached
    half_width: float
    energy: float | None
    seconds: float


def doublings(prepared: Prepared, budget: float) -> list[Sampled]:
    """Ensembles of 125, 250, ... rocks, until a budget (s of one core) is used up; each is flown twice, other rocks."""
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
    return Pair(one.reached, other.reached, one.places.half_width, energy, 0.5 * (one.seconds + other.seconds))


def _sampled(pair: Pair, everything: Reached) -> Sampled:
    errors = [distance_from_truth(some, everything) for some in (pair.one, pair.other)]
    apart = map_distance(pair.one, pair.other)
    return Sampled(pair.one.flown, 0.5 * sum(errors), apart, pair.half_width, pair.energy, pair.seconds)


def together(one: Reached, other: Reached) -> Reached:
    """The map of two ensembles without a rock in common."""
    cells, place = np.unique(np.concatenate([one.cells, other.cells]), return_inverse=True)
    rocks = np.bincount(place, np.concatenate([one.rocks, other.rocks]), len(cells)).astype(np.int64)
    return Reached(cells, rocks, one.flown + other.flown)


def distance_from_truth(some: Reached, everything: Reached) -> float:
    """How far (-) the map of some rocks is from that of all there could be, told from all that were flown.

    n of N rocks are off those N by less than off the truth, by the square root of 1 - n/N: the correction for a finite
    population. Half of the distance of two maps would not do, nor that over the square root of two: of a cell that
    next to no rock comes to, two small ensembles are no further apart than each is off the truth.

    everything : a map that the rocks of `some` are among

    Sources
    -------
    Cochran 1977, Sampling Techniques, section 2.6.
    """
    left = 1.0 - some.flown / everything.flown
    return min(map_distance(some, everything) / math.sqrt(left), 1.0)


def quantile_half_width(values: FloatArray, quantile: float) -> float | None:
    """Half-width of the 95 % interval of a quantile (-) of values (N,), over its own size (-).

    The interval lies between two order statistics: how many of N values lie below the true quantile is binomial, here
    by its normal limit. None where that reaches beyond the largest value, or the values have no size.

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
    """How far two maps (-) of so many different rocks each are apart, from the doublings nearest to that number.

    Errors go as one over the square root of the number of rocks.
    """
    nearest = min(sampled, key=lambda one: abs(math.log(one.rocks / rocks)))
    return min(math.sqrt(nearest.rocks / rocks) * nearest.apart, 1.0)
