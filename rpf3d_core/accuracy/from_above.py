"""The ground over or under a place in plan, looked for from above everything: the highest, or that at an altitude."""

from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facet_geometry import REACH

MOST_LAYERS = 8
"""Sheets of ground over each other that are looked for under the highest: an arch has three, a bench two."""


class HeightField(NamedTuple):
    """The ground at N places: z (N,) its altitude, m, NaN where there is none; facet (N,), -1 where there is none.

    side : (N,) 1.0 where its free side was met, -1.0 where its back was: the place was inside the ground
    """

    z: FloatArray
    facet: IntArray
    side: FloatArray


def highest_ground(engine: Engine, x: FloatArray) -> HeightField:
    """The ground at N places (N, 3) m, whatever their altitude, that lies above all other: of an overhang the top."""
    top = np.array(x)
    top[:, 2] = max(engine.facets.high[2], float(top[:, 2].max(initial=-np.inf))) + ABOVE_EVERYTHING
    return _ground_below(engine, top)


def nearest_ground(engine: Engine, x: FloatArray, z: FloatArray) -> HeightField:
    """Of all ground above or below N places (N, 3) m, that with its free side up which is nearest to altitude z (N,) m.

    The highest of all counts whichever side it shows, for terrains exist that are wound downwards.
    """
    best = found = highest_ground(engine, x)
    for _ in range(MOST_LAYERS):
        found = _next_ground(engine, x, found)
        if (found.facet < 0).all():
            break
        nearer = (found.side > 0.0) & (np.abs(found.z - z) < np.abs(best.z - z))  # NaN, where there is none, is not
        best = HeightField(*(np.where(nearer, its, other) for its, other in zip(found, best, strict=True)))
    return best


def _next_ground(engine: Engine, x: FloatArray, above: HeightField) -> HeightField:
    """The ground under that which lies over, or under, N places (N, 3) m."""
    facets, under = engine.facets, np.array(x)
    under[:, 2] = np.where(above.facet >= 0, above.z - REACH * facets.tolerance, facets.low[2] - ABOVE_EVERYTHING)
    return _ground_below(engine, under)


def _ground_below(engine: Engine, x: FloatArray) -> HeightField:
    """The ground straight below N places (N, 3) m."""
    height, facet, side = engine.ground_below(x).T
    return HeightField(np.where(facet >= 0.0, x[:, 2] - height, np.nan), facet.astype(np.int64), side)
