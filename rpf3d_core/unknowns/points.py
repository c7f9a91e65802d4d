"""Make evenly spread points for parameter sets: a randomized Halton sequence that depends on the seed alone."""

import math

import numpy as np

from rpf3d_core.materials.streams import Purpose, uniform
from rpf3d_core.unknowns.parameter_sets import FloatArray

SMALLEST = 2.0**-53
"""Weight (-) of a digit, such as 1/2 or 1/4, below which the digit no longer changes a 64-bit number in [0, 1)."""


def spread_points(points: int, dimensions: int, seed: int) -> FloatArray:
    """Return points (P, D) in the unit cube [0, 1), spread more evenly than independent random points.

    A longer sequence begins with the same points.

    points, dimensions : P and D; seed : of the random permutations

    Sources
    -------
    Owen 2017, "A randomized Halton algorithm in R", arXiv:1706.02808: each digit of each base is permuted at random.
    The permutations are drawn from the counter-based random streams of rpf3d.
    """
    columns = [_in_base(points, base, i, seed) for i, base in enumerate(_primes(dimensions))]
    return np.stack(columns, axis=1) if columns else np.empty((points, 0))


def _in_base(points: int, base: int, dimension: int, seed: int) -> FloatArray:
    """Return the coordinates (P,) of the points in one dimension of the Halton sequence.

    A coordinate has the digits of the point's number, written in the base, in reverse order after the radix point. At
    each position, the digits are exchanged by a random permutation, which is drawn separately for each position.

    points : number of points P; dimension : number of the dimension, from 0; seed : of the permutations
    """
    places = math.ceil(-math.log(SMALLEST) / math.log(base))
    draws = uniform(seed, dimension, np.arange(places * base), Purpose.PARAMETER_SET).reshape(places, base)
    left, x, weight = np.arange(points), np.zeros(points), 1.0
    for order in np.argsort(draws, axis=1):
        left, digit = np.divmod(left, base)
        weight /= base
        x += order[digit] * weight
    return np.minimum(x, 1.0 - SMALLEST)


def _primes(count: int) -> list[int]:
    """Return the first `count` prime numbers."""
    primes, number = list[int](), 2
    while len(primes) < count:
        if all(number % prime for prime in primes):
            primes.append(number)
        number += 1
    return primes
