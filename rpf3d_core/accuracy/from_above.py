"""Find the ground at places in plan, from above: the highest ground, or the ground nearest to an altitude."""

from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facet_geometry import REACH

MOST_LAYERS = 8
"""Largest number of layers of ground that are searched below the highest ground, such as under an overhang."""


class HeightField(NamedTuple):
    """The ground found at N places in plan: altitude, facet, and which side of the facet is up.

    z : (N,) altitude, m; facet : (N,) number of the facet; NaN and -1 where no ground was found
    side : (N,) 1.0 if the search from above met the free side of the facet, -1.0 if it met the back
    """

    z: FloatArray
    facet: IntArray
    side: FloatArray


def highest_ground(engine: Engine, x: FloatArray) -> HeightField:
    """Return the highest ground straight above or below N places (N, 3) m; for an overhang, its upper side."""
    top = np.array(x)
    top[:, 2] = max(engine.facets.high[2], float(top[:, 2].max(initial=-np.inf))) + ABOVE_EVERYTHING
    return _ground_below(engine, top)


def nearest_ground(engine: Engine, x: FloatArray, z: FloatArray) -> HeightField:
    """Return the layer of ground whose altitude is nearest to z at each of N places in plan.

    The highest layer may always be chosen, even if its free side is down, because some terrains have such facets. A
    lower layer may be chosen only if its free side is up.

    x : (N, 3) m, places; only the plan coordinates matter; z : (N,) m, altitudes
    """
    best = found = highest_ground(engine, x)
    for _ in range(MOST_LAYERS):
        found = _next_ground(engine, x, found)
        if (found.facet < 0).all():
            break
        nearer = (found.side > 0.0) & (np.abs(found.z - z) < np.abs(best.z - z))  # False without ground (NaN)
        best = HeightField(
            z=np.where(nearer, found.z, best.z),
            facet=np.where(nearer, found.facet, best.facet),
            side=np.where(nearer, found.side, best.side),
        )
    return best


def _next_ground(engine: Engine, x: FloatArray, above: HeightField) -> HeightField:
    """Return the next layer of ground below the layer `above` at N places x (N, 3) m; NaN and -1 if there is none.

    above : the layer that the previous search found
    """
    facets, under = engine.facets, np.array(x)
    under[:, 2] = np.where(above.facet >= 0, above.z - REACH * facets.tolerance, facets.low[2] - ABOVE_EVERYTHING)
    return _ground_below(engine, under)


def _ground_below(engine: Engine, x: FloatArray) -> HeightField:
    """Return the first ground straight below each of N points x (N, 3) m."""
    height, facet, side = engine.ground_below(x).T
    return HeightField(z=np.where(facet >= 0.0, x[:, 2] - height, np.nan), facet=facet.astype(np.int64), side=side)
