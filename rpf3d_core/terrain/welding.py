"""Welding: points nearer than a tolerance become one vertex.

No grid of cells is involved, so no pair is split by a cell's border: points are sorted along one oblique direction,
and two points within the tolerance of each other are within the tolerance along that direction too.
"""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.components import components
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.ordering import bits_left, sort_keys

Index = NDArray[np.int32]

OBLIQUE = (0.6180339887498949, 0.4142135623730951, 0.6681786379192989)
"""Sorting direction, unit length: golden ratio - 1, sqrt(2) - 1 and the rest.

Any direction is right; one that no survey grid is square to keeps few points at equal heights along it.
"""

ROUNDING = 8 * np.finfo(float).eps
"""Relative rounding of a place along OBLIQUE: three products and two sums, doubled for the difference of two."""


SMALLER_THAN_ONE = 1.0 - 2.0**-40
"""Keeps the last step within its bits, whatever the rounding."""


def weld(points: FloatArray, tolerance: float) -> tuple[FloatArray, Index]:
    """Make points one vertex where they are no further apart than a tolerance.

    Chains count: a vertex stands for all points that are linked by steps of at most the tolerance. It lies on the
    first of them, and vertices are numbered in the order in which they are first met.

    Parameters
    ----------
    points : (N, 3) float
        Finite, m, in a local frame, so that float64 resolves the tolerance. Fastest in column order.
    tolerance : float
        m, >= 0; 0 makes only equal points one.

    Returns
    -------
    vertices : (V, 3) float
        m.
    index : (N,) int
        The vertex of each point.
    """
    along = points[:, 0] * OBLIQUE[0] + points[:, 1] * OBLIQUE[1] + points[:, 2] * OBLIQUE[2]
    order, step = _sorted_along(along)
    begins = _begins_of_equal_runs(points, order)
    first = order[begins]
    first = _first_of_near(points[first], along[first], first, tolerance, step)
    chosen = np.empty(len(points), np.int32)
    chosen[order] = first[np.cumsum(begins, dtype=np.int32) - np.int32(1)]
    return _numbered(points, chosen)


def _sorted_along(along: FloatArray) -> tuple[Index, float]:
    """The points (N,) in rising order of their place, as far as whole steps tell, and the length of a step (m)."""
    bits = bits_left(len(along))
    low, span = float(along.min()), float(np.ptp(along))
    steps = ((along - low) * (SMALLER_THAN_ONE * 2.0**bits / (span or 1.0))).astype(np.int64)
    return sort_keys(steps, bits)[1], 2.0 * span / 2.0**bits


def _begins_of_equal_runs(points: FloatArray, order: Index) -> NDArray[np.bool_]:
    """(N,) whether the point at each place of the order differs from the one before it."""
    begins = np.zeros(len(order), bool)
    begins[0] = True
    for k in range(3):
        column = points[:, k][order]
        begins[1:] |= column[1:] != column[:-1]
    return begins


def _first_of_near(places: FloatArray, along: FloatArray, first: Index, tolerance: float, step: float) -> Index:
    """(M,) the smallest of `first` in the chain of each of M places, which are sorted along OBLIQUE by steps (m)."""
    a, b = _near_pairs(places, along, tolerance, tolerance + step + ROUNDING * float(np.abs(along).max()))
    if len(a) == 0:
        return first
    chain = components(len(places), a, b)
    smallest = first.copy()
    np.minimum.at(smallest, chain, first)
    return smallest[chain]


def _near_pairs(places: FloatArray, along: FloatArray, tolerance: float, window: float) -> tuple[Index, Index]:
    """Pairs of places (a < b) at most the tolerance apart, sought no further than a window (m) along OBLIQUE."""
    found_a, found_b = [np.empty(0, np.int32)], [np.empty(0, np.int32)]
    for step in range(1, len(places)):
        a = np.flatnonzero(along[step:] - along[:-step] <= window)
        if len(a) == 0:
            break
        distance = places[a + step] - places[a]
        a = a[np.einsum("ij,ij->i", distance, distance) <= tolerance * tolerance].astype(np.int32)
        found_a.append(a)
        found_b.append(a + np.int32(step))
    return np.concatenate(found_a), np.concatenate(found_b)


def _numbered(points: FloatArray, chosen: Index) -> tuple[FloatArray, Index]:
    """Vertices and the vertex of each point, from the point chosen for each point."""
    kept = chosen == np.arange(len(chosen), dtype=np.int32)
    number = np.cumsum(kept, dtype=np.int32) - np.int32(1)
    return np.stack([column[kept] for column in points.T], axis=1), number[chosen]
