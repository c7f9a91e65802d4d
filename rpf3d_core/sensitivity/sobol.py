"""Sobol indices: the share of a result's variance that one unknown causes, alone and with all its interactions.

Sources
-------
Sobol 2001, Math. Comput. Simul. 55:271-280: the indices.
Saltelli et al. 2010, Computer Physics Communications 181:259-270: the design (matrices A, B, and A with one column of
B), and the estimators: table 2 (b) for the first order; table 2 (f), by Jansen 1999, for the total.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.sensitivity.morris import ENDS, REDRAWS
from rpf3d_core.unknowns.points import spread_points

FloatArray = NDArray[np.float64]


class Indices(NamedTuple):
    """Sobol indices of U unknowns on Y results, shares (-) of the variance; each with its 95 % interval.

    first, total : (U, Y) share of the unknown alone, and with its interactions; NaN where the result does not vary
    first_ends, total_ends : (2, U, Y) lower and upper ends of the 95 % intervals of `first` and `total`
    """

    first: FloatArray
    total: FloatArray
    first_ends: FloatArray
    total_ends: FloatArray


def design(count: int, unknowns: int, seed: int) -> FloatArray:
    """Return the points of Sobol's design in the unit cube: (count, U + 2, U) (-).

    Each of the `count` rows has a point A, a point B and, for each unknown u, the point A with its coordinate u
    replaced by the coordinate u of B.

    unknowns : number U of unknowns; seed : of the evenly spread points
    """
    both = spread_points(count, 2 * unknowns, seed)
    a, b = both[:, :unknowns], both[:, unknowns:]
    mixed = np.repeat(a[:, None, :], unknowns, axis=1)
    mixed[:, range(unknowns), range(unknowns)] = b
    return np.concatenate([a[:, None], b[:, None], mixed], axis=1)


def indices_of(results: FloatArray, seed: int) -> Indices:
    """Return the Sobol indices of U unknowns on Y results, with intervals by the bootstrap.

    results : (N, U + 2, Y) at the points of a design; seed : of the random draws for the intervals
    """
    random = np.random.Generator(np.random.Philox(key=[seed, 2**33 + 2]))
    count = len(results)
    first, total = _estimates(results)
    again = [_estimates(results[random.integers(0, count, count)]) for _ in range(REDRAWS // 2)]
    with np.errstate(invalid="ignore"):
        ends = [np.percentile(np.stack(each), ENDS, axis=0) for each in zip(*again, strict=True)]
    return Indices(first=first, total=total, first_ends=ends[0], total_ends=ends[1])


def _estimates(results: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the first-order and the total indices, two arrays (U, Y); NaN for a result that does not vary.

    results : (N, U + 2, Y) at the points of a design
    """
    a, b, mixed = results[:, 0], results[:, 1], results[:, 2:]
    variance = np.concatenate([a, b]).var(axis=0)
    varies = variance > 1e-24 * np.maximum(np.abs(a).max(axis=0), 1.0) ** 2
    scale = np.where(varies, variance, np.nan)
    centred = b - np.concatenate([a, b]).mean(axis=0)
    first = (centred[:, None] * (mixed - a[:, None])).mean(axis=0) / scale
    total = 0.5 * ((a[:, None] - mixed) ** 2).mean(axis=0) / scale
    return first, total
