"""Engines over whole terrains, with the caps that end rocks where they fall below the ground."""

import numpy as np

from rpf3d_core.detection.caps import CapFacets
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import CRACK, Facets, Terrain, facets_of
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.gaps import Caps, caps_over
from rpf3d_core.terrain.mesh.border import border_of

FEWEST = 2
"""Least number of cap facets: the corners of a single facet lie in memory differently and would be compiled again."""


def engine_over(name: str, terrain: Terrain, facets: Facets | None = None) -> Engine:
    """Return the engine with a name over a terrain, with its index built and the gaps of the terrain capped.

    facets : of the terrain, if known already. Raises ValueError as `engine_of`.
    """
    facets = facets or facets_of(terrain)
    return engine_of(name, facets, gap_facets(terrain, facets.tolerance))


def gap_facets(terrain: Terrain, tolerance: float) -> CapFacets | None:
    """Return the caps over the gaps of a terrain as facets; None if the terrain has no gap.

    tolerance : of the terrain's contacts (m)
    """
    caps = caps_over(border_of(terrain.vertices, terrain.triangles), CRACK * tolerance)
    return _facets_of_caps(caps, tolerance) if len(caps.corners) else None


def caps_within(border: FloatArray, tolerance: float) -> CapFacets:
    """Return the caps within the border (B, 3, 3) m of a terrain as facets; without a gap, facets that no rock touches.

    tolerance : of the terrain's contacts (m)
    """
    return _facets_of_caps(caps_over(border, CRACK * tolerance), tolerance)


def _facets_of_caps(caps: Caps, tolerance: float) -> CapFacets:
    """Return caps as facets whose zone is the outcome of a rock; without caps, facets that no rock can touch."""
    missing = max(FEWEST - len(caps.corners), 0)
    corners = np.concatenate([caps.corners, np.zeros((missing, 3, 3)) + _any_corner(caps.corners)])
    outcome = np.concatenate([caps.outcome, np.zeros(missing, np.int32)])
    triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    facets = facets_of(Terrain(corners.reshape(-1, 3), triangles, outcome, ()))
    return CapFacets(facets._replace(tolerance=CRACK * tolerance, crack=CRACK * tolerance), caps.layered)


def _any_corner(corners: FloatArray) -> FloatArray:
    """Return one corner (3,) m of some triangles; the origin if there are no triangles."""
    return corners[0, 0] if len(corners) else np.zeros(3)
