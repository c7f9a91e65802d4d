"""Assign a parameter set to each rock, so that every set flies with rocks of all sources and release points."""

import math

import numpy as np

from rpf3d_core.ensemble.flights import IntArray

GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
"""Ratio of the golden section (-), which shifts the order of the sets from one round of rocks to the next."""


def rocks_of_set(number: int, sets: int, first: int, last: int, source: int) -> IntArray:
    """Return the numbers (N,) of the rocks of a source that fly with one parameter set, within a given range.

    For n sets, each n successive rocks of the source form a round, with one rock for each set. The order of the sets
    differs from round to round: a source uses its release points in turn, so with a fixed order the rocks of a set
    would always start from the same points. The set of a rock does not depend on the number of rocks.

    number : number of the set, from 0; sets : number of sets; source : index of the source
    first, last : range of the source's rocks: number of the first rock, and the number after the last rock
    """
    rounds = np.arange(first // sets, -(-last // sets))
    rocks = rounds * sets + (number + turns(rounds, sets, source)) % sets
    return np.asarray(rocks[(rocks >= first) & (rocks < last)], dtype=np.int64)


def set_of_rock(rock: int, sets: int, source: int) -> int:
    """Return the number of the parameter set with which a rock flies.

    rock : number of the rock within its source; sets : number of sets; source : index of the source
    """
    return int(sets_of_rocks(np.array([rock]), sets, source)[0])


def sets_of_rocks(rocks: IntArray, sets: int, source: int) -> IntArray:
    """Return the numbers (N,) of the parameter sets with which rocks of a source fly.

    rocks : (N,) numbers of the rocks within the source; sets : number of sets; source : index of the source
    """
    return np.asarray((rocks - turns(rocks // sets, sets, source)) % sets, dtype=np.int64)


def turns(rounds: IntArray, sets: int, source: int) -> IntArray:
    """Return the cyclic shifts (N,) of the order of the parameter sets in N rounds of rocks, in places.

    For n sets, a round is n successive rocks of the source, one for each set. Shifts are whole numbers, 0 to n - 1.

    rounds : (N,) numbers of the rounds; sets : number of sets; source : index of the source
    """
    return np.asarray(np.floor((rounds + source) * GOLDEN % 1.0 * sets), dtype=np.int64)
