"""Which rocks fly with which parameter set: each set gets its share of the rocks of every source, and of all places."""

import math

import numpy as np

from rpf3d_core.ensemble.flights import IntArray

GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
"""Ratio of the golden section (-), which shifts the order of the sets from one round of rocks to the next."""


def rocks_of_set(number: int, sets: int, first: int, last: int, source: int) -> IntArray:
    """Return the rocks (N,) of a source, among rocks `first` to `last` - 1, that fly with one of the parameter sets.

    A round of as many successive rocks as there are sets has one rock for each set. The order of the sets differs from
    round to round: otherwise a set would always meet the same release points, which a source uses in turn. The set of a
    rock does not depend on the number of rocks.

    number : number of the set, from 0; sets : number of sets; source : number of the source
    """
    rounds = np.arange(first // sets, -(-last // sets))
    rocks = rounds * sets + (number + turns(rounds, sets, source)) % sets
    return np.asarray(rocks[(rocks >= first) & (rocks < last)], dtype=np.int64)


def set_of_rock(rock: int, sets: int, source: int) -> int:
    """Return the number of the parameter set with which a rock of a source flies."""
    return int(sets_of_rocks(np.array([rock]), sets, source)[0])


def sets_of_rocks(rocks: IntArray, sets: int, source: int) -> IntArray:
    """Return the numbers (N,) of the parameter sets with which rocks (N,) of a source fly."""
    return np.asarray((rocks - turns(rocks // sets, sets, source)) % sets, dtype=np.int64)


def turns(rounds: IntArray, sets: int, source: int) -> IntArray:
    """Return the cyclic shift (N,) of the order of the parameter sets in rounds (N,) of a source.

    A round has one rock of the source for each set.
    """
    return np.asarray(np.floor((rounds + source) * GOLDEN % 1.0 * sets), dtype=np.int64)
