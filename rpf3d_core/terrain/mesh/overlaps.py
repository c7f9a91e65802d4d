"""Find pieces of a terrain that may pass through each other, such as a slope and a muck pile in a file of its own.

Facets with a vertex in common belong to one piece. A rock that slides over one piece must look for the others if they
overlap (`detection.terrain_pieces`). That costs a search for each ground segment, so it is left out for all other
terrains.
"""

from typing import Any

import numpy as np

from rpf3d_core.jit.dispatch import loop
from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.mesh.components import components


def pieces_of(terrain: Terrain) -> IntArray:
    """Return the piece (F,) of each facet: the smallest vertex number in it."""
    a, b, c = terrain.triangles.T
    owner = components(len(terrain.vertices), np.concatenate([a, b]), np.concatenate([b, c]))
    return np.asarray(owner[a])


def may_cross(terrain: Terrain, piece: IntArray) -> bool:
    """True if the bounding boxes of two pieces overlap: the pieces may pass through each other.

    A level piece has a flat box, which overlaps the boxes that it cuts. Boxes that only touch, as those of tiles, do
    not overlap. Pieces whose boxes overlap may still pass one above the other.

    piece : (F,) from `pieces_of`
    """
    if bool((piece == piece[0]).all()):
        return False
    owners, number = np.unique(piece, return_inverse=True)
    low, high = np.full((len(owners), 3), np.inf), np.full((len(owners), 3), -np.inf)
    for k in range(3):
        corners = terrain.vertices[terrain.triangles[:, k]]
        np.minimum.at(low, number, corners)
        np.maximum.at(high, number, corners)
    order = np.argsort(low[:, 0], kind="stable")
    return bool(_any_overlap(low[order], high[order]))


@loop
def _any_overlap(low: Any, high: Any) -> bool:
    """True if two of the boxes with corners (P, 3) and (P, 3) m, sorted by their lowest x, overlap."""
    for i in range(len(low)):
        for j in range(i + 1, len(low)):
            if low[j, 0] >= high[i, 0]:
                break
            apart = False
            for k in range(3):
                apart = apart or low[i, k] >= high[j, k] or low[j, k] >= high[i, k]
            if not apart:
                return True
    return False
