"""Weld points: points at most a tolerance apart become one vertex, so that neighbouring facets share vertices.

Points are sorted along one oblique direction. Two points within the tolerance of each other are also within the
tolerance along this direction. No grid of cells is used, so no pair is missed at the border of a cell.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import loop
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.components import components
from rpf3d_core.terrain.mesh.ordering import bits_left, sort_keys

Index = NDArray[np.int32]

OBLIQUE = (0.6180339887498949, 0.4142135623730951, 0.6681786379192989)
"""Direction along which points are sorted, unit length: golden ratio - 1, sqrt(2) - 1 and the remaining component.

Any direction gives the right result. This direction is not perpendicular to the rows of usual survey grids, so few
points have equal places along the direction.
"""

ROUNDING = 8 * np.finfo(float).eps
"""Rounding error of the difference of two distances along OBLIQUE, as a share of the largest distance (-).

Each distance has the rounding errors of three products and two sums.
"""


SMALLER_THAN_ONE = 1.0 - 2.0**-40
"""Factor that keeps the number of sorting steps within the available bits, for any rounding."""


def weld(points: FloatArray, tolerance: float) -> tuple[FloatArray, Index]:
    """Return the vertices and the vertex of each point: points no further apart than a tolerance become one vertex.

    Chains of points become one vertex too, if each point is at most the tolerance from the next point. The vertex lies
    on the point of the chain with the smallest number, and vertices are numbered in the order of these points.

    Parameters
    ----------
    points : (N, 3) float
        Finite, m, in a local frame, so that float64 resolves the tolerance. Fastest if each column is
        contiguous in memory.
    tolerance : float
        m, >= 0; with 0, only equal points become one vertex.

    Returns
    -------
    vertices : (V, 3) float
        m.
    index : (N,) int
        The vertex of each point.
    """
    x, y, z = (np.ascontiguousarray(column, dtype=np.float64) for column in points.T)
    along = np.empty(len(points))
    _project(x, y, z, along)
    order, step = _sorted_along(along)
    first, run, index = (np.empty_like(order) for _ in range(3))
    first = first[: _runs_of_equals(x, y, z, order, first, run)]
    first = _first_of_near(_at((x, y, z), first), along[first], first, tolerance, step)
    kept = np.empty_like(first)
    kept = kept[: _number(order, run, first, index, kept)]
    return _at((x, y, z), kept), index


def _at(columns: Sequence[FloatArray], some: Index) -> FloatArray:
    """Return selected points (N, 3) m from columns of coordinates.

    columns : x, y and z (P,) m of all points; some : (N,) numbers of the selected points
    """
    return np.stack([column[some] for column in columns], axis=1)


@loop
def _project(x: Any, y: Any, z: Any, along: Any) -> None:
    """Write the distance of each point along the direction OBLIQUE (m), by which points are sorted.

    x, y, z : (P,) m; along : (P,) receives the distances
    """
    for p in range(len(x)):
        along[p] = x[p] * OBLIQUE[0] + y[p] * OBLIQUE[1] + z[p] * OBLIQUE[2]


def _sorted_along(along: FloatArray) -> tuple[Index, float]:
    """Return the numbers (N,) of points, sorted by distance along OBLIQUE, and the precision (m) of this order.

    Two points whose distances differ by less than the precision may be in the wrong order. Distances are counted in
    whole steps; the precision is twice the length of a step.

    along : (N,) m, distances of the points along OBLIQUE
    """
    bits, steps = bits_left(len(along)), np.empty(len(along), np.int64)
    low = float(along.min())
    span = float(along.max()) - low
    _count_steps(along, low, SMALLER_THAN_ONE * 2.0**bits / (span or 1.0), steps)
    return sort_keys(steps, bits)[1], 2.0 * span / 2.0**bits


@loop
def _count_steps(along: Any, low: float, per_metre: float, steps: Any) -> None:
    """Write into `steps` (N,) how many whole steps along OBLIQUE each point is from the first point in this direction.

    along : (N,) m, distances along OBLIQUE; low : the smallest distance, m; per_metre : number of steps in a metre
    """
    for p in range(len(along)):
        steps[p] = np.int64((along[p] - low) * per_metre)


@loop
def _runs_of_equals(x: Any, y: Any, z: Any, order: Any, first: Any, run: Any) -> int:
    """Number the runs of equal points in the sorted order, so that equal points are compared once; return their count.

    x, y, z : (N,) m; order : (N,) the points in sorted order
    first : receives the first point of each run; run : (N,) receives the run of each sorted point
    """
    count = 0
    for place in range(len(order)):
        p = order[place]
        q = order[max(place - 1, 0)]
        if place == 0 or x[p] != x[q] or y[p] != y[q] or z[p] != z[q]:
            first[count] = p
            count += 1
        run[place] = count - 1
    return count


def _first_of_near(places: FloatArray, along: FloatArray, first: Index, tolerance: float, step: float) -> Index:
    """Return the smallest point number (M,) in the chain of each of M points; the chain becomes a vertex at this point.

    In a chain, each point is at most the tolerance (m) from the next point.

    places : (M, 3) m, the points sorted along OBLIQUE; step : m, precision of the order (`_sorted_along`)
    along : (M,) m, distances of the points along OBLIQUE; first : (M,) number of each point in the input
    """
    a, b = _near_pairs(places, along, tolerance, tolerance + step + ROUNDING * float(np.abs(along).max()))
    if len(a) == 0:
        return first
    chain = components(len(places), a, b)
    smallest = first.copy()
    np.minimum.at(smallest, chain, first)
    return smallest[chain]


def _near_pairs(places: FloatArray, along: FloatArray, tolerance: float, window: float) -> tuple[Index, Index]:
    """Return all pairs of points (P,), (P,) that are at most the tolerance (m) apart and are therefore welded.

    places : (M, 3) m, points sorted along OBLIQUE; the pairs are indices into `places`
    along : (M,) m, distances along OBLIQUE; window : m, largest difference of these distances in a pair
    """
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


@loop
def _number(order: Any, run: Any, first: Any, index: Any, kept: Any) -> int:
    """Number the vertices of the welded mesh: write the vertex of each point into `index`; return the vertex count.

    The vertex of a chain lies on its point with the smallest number. Points are visited in the order of their numbers,
    so this point already has its vertex when the other points of the chain are visited.

    order : (N,) points in sorted order; run : (N,) run of equal points of each sorted point
    first : smallest point number in the chain of each run
    index : (N,) receives the vertices; kept : receives the point of each vertex
    """
    for place in range(len(order)):
        index[order[place]] = first[run[place]]
    count = 0
    for p in range(len(index)):
        if index[p] == p:
            kept[count] = p
            index[p] = count
            count += 1
        else:
            index[p] = index[index[p]]
    return count
