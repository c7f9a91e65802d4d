"""Build an engine over a whole terrain: with caps over gaps, and with the parts (pieces) that may cross each other.

Facets that share vertices belong to one piece, such as a slope; a muck pile from a file of its own is another piece.
"""

import numpy as np

from rpf3d_core.detection.cap_neighbours import neighbours_of
from rpf3d_core.detection.caps import CapFacets, CapLayout
from rpf3d_core.detection.terrain_pieces import PieceNumbers
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import CRACK, Facets, Terrain, facets_of
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.gaps import IN_PLAN, Caps, caps_over
from rpf3d_core.terrain.mesh.border import border_of
from rpf3d_core.terrain.mesh.overlaps import may_cross, pieces_of, rims_of

FEWEST = 2
"""Smallest number of cap facets, so that numba compiles the search for contacts only once.

For the array of a single facet, which has another memory layout, numba would compile all functions again.
"""

APART = PieceNumbers(np.zeros(1, np.int32), np.zeros(1, np.uint8), False)
"""Value for every terrain whose separate parts (pieces) cannot pass through each other; its arrays are not used."""


def engine_over(name: str, terrain: Terrain, facets: Facets | None = None) -> Engine:
    """Return a new engine for a terrain, with its search structure built and all gaps of the terrain closed by caps.

    name : of the engine, "reference" or "compiled"; facets : facets of the terrain, if the caller has them already

    Raises ValueError for an unknown name, or for "compiled" without numba.
    """
    facets = facets or facets_of(terrain)
    return engine_of(name, facets, gap_facets(terrain, facets.tolerance), piece_numbers(terrain))


def piece_numbers(terrain: Terrain) -> PieceNumbers | None:
    """Return the number of the separate part (piece) of the terrain that each facet belongs to.

    The result is None if no two parts can cross (pass through each other), as in nearly all terrains.
    """
    pieces = pieces_that_cross(terrain)
    return pieces if pieces.overlap else None


def pieces_that_cross(terrain: Terrain) -> PieceNumbers:
    """Return the number of the separate part (piece) that each facet belongs to; APART if no two parts can cross."""
    number = pieces_of(terrain)
    return PieceNumbers(number, rims_of(terrain), True) if may_cross(terrain, number) else APART


def gap_facets(terrain: Terrain, tolerance: float) -> CapFacets | None:
    """Return the caps over the gaps of a terrain as facets; None if the terrain has no gap.

    tolerance : contact tolerance of the terrain (m)
    """
    caps = caps_over(border_of(terrain.vertices, terrain.triangles), CRACK * tolerance)
    return _facets_of_caps(caps, tolerance) if len(caps.corners) else None


def caps_within(border: FloatArray, tolerance: float) -> CapFacets:
    """Return the caps over the gaps inside a terrain's border (B, 3, 3) m, as facets.

    If the terrain has no gap, the result has only dummy facets, which no rock can touch.

    border : sides of the border, from `border_of`; tolerance : contact tolerance of the terrain (m)
    """
    return _facets_of_caps(caps_over(border, CRACK * tolerance), tolerance)


def _facets_of_caps(caps: Caps, tolerance: float) -> CapFacets:
    """Return the caps as facets; the zone number of a facet is the outcome of a rock that passes through the facet.

    Fewer caps than FEWEST are filled up with dummy facets, which no rock can touch.

    tolerance : of the terrain, m
    """
    missing = max(FEWEST - len(caps.corners), 0)
    corners = np.concatenate([caps.corners, np.zeros((missing, 3, 3)) + _any_corner(caps.corners)])
    outcome = np.concatenate([caps.outcome, np.zeros(missing, np.int32)])
    ring = np.concatenate([caps.ring, np.full(missing, IN_PLAN, np.int32)])
    triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    facets = facets_of(Terrain(corners.reshape(-1, 3), triangles, outcome, ()))
    layout = CapLayout(neighbours=neighbours_of(corners), ring=ring, layered=caps.layered)
    return CapFacets(facets=facets._replace(tolerance=CRACK * tolerance, crack=CRACK * tolerance), layout=layout)


def _any_corner(corners: FloatArray) -> FloatArray:
    """Return the place (3,) m of dummy facets: the first corner of the caps, or the origin if there are no caps.

    corners : (N, 3, 3) m, of the caps
    """
    return corners[0, 0] if len(corners) else np.zeros(3)
