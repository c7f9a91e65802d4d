"""Test for facets without area, used by the fault report and by all code that must exclude such facets."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

NO_AREA = 1e-12
"""A facet has no area if twice its area is at most this factor times its longest side squared (-).

Three corners on one line stay below this limit in spite of rounding (1e-16), for coordinates up to 1e4 times the sides.
The narrowest facet of a survey is many powers of ten wider.
"""
NO_AREA_AT_ALL = "no facet has an area, because the corners of each facet lie on one line; a terrain needs an area"


def without_area(vertices: FloatArray, triangles: NDArray[np.int32], areas: FloatArray) -> NDArray[np.bool_]:
    """Return flags (F,): true for facets without area, which no rock can touch and which have no normal.

    The longest side is computed only for the few facets that may have no area.

    Parameters
    ----------
    vertices : (V, 3) float
        m.
    triangles : (F, 3) int
        Indices into vertices.
    areas : (F, 3) float
        The area of each facet times its unit normal, of either sign, m^2.
    """
    area = np.sqrt(np.einsum("ij,ij->i", areas, areas))
    flat = np.zeros(len(area), bool)
    few = np.flatnonzero(area <= NO_AREA * _diagonal_squared(vertices))
    corners = vertices[triangles[few]]
    sides = corners - np.roll(corners, 1, axis=1)
    longest = np.einsum("fij,fij->fi", sides, sides).max(axis=1)
    flat[few] = 2.0 * area[few] <= NO_AREA * longest
    return flat


def _diagonal_squared(vertices: FloatArray) -> float:
    return float(sum((column.max() - column.min()) ** 2 for column in vertices.T))
