"""What the number of rocks leaves open: maps of two independent ensembles, intervals of shares, p95 of energy."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rpf3d_core.accuracy.differences import map_distance
from rpf3d_core.accuracy.flown import Flown, fly, some_rocks
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.statistics import NORMAL_QUANTILE_95
from rpf3d_core.prepared import Prepared

FEWEST = 125
"""Rocks that the doublings begin with."""
MOST = 32_000
"""Rocks that they end with."""
QUANTILE = 0.95


class Sampled(NamedTuple):
    """What is known from so many rocks.

    of_map : distance (-) of their map from that of all rocks there could be; half_width : of the widest 95 % interval
    of a share (-); energy : half-width of the 95 % interval of the p95 of energy over that p95 (-), None if unknown
    """

    rocks: int
    of_map: float
    half_width: float
    energy: float | None
    seconds: float


def doublings(prepared: Prepared, budget: float) -> Iterator[Sampled]:
    """Ensembles of 125, 250, ... rocks, until a budget (s of one core) is used up.

    Each is flown twice, with other rocks. Both maps are off the true one by as much, independently, so they are
    apart by the square root of two times that.
    """
    rocks, spent = FEWEST, 0.0
    while rocks <= MOST and spent < budget:
        one, other = (fly(prepared, some_rocks(prepared, rocks, lot)) for lot in (0, 1))
        spent += one.seconds + other.seconds
        yield _sampled(one, other)
        rocks *= 2


def _sampled(one: Flown, other: Flown) -> Sampled:
    return Sampled(
        rocks=len(one.rows),
        of_map=map_distance(one.reached, other.reached) / math.sqrt(2.0),
        half_width=one.places.half_width,
        energy=quantile_half_width(one.flights.deposits.max_energy, QUANTILE),
        seconds=0.5 * (one.seconds + other.seconds),
    )


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
    return min(math.sqrt(2.0 * nearest.rocks / rocks) * nearest.of_map, 1.0)
