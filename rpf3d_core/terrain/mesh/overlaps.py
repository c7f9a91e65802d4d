"""Find pieces of a terrain that may pass through each other, such as a slope and a muck pile in a separate file.

Facets with a vertex in common belong to one piece. If pieces overlap, a rock that slides over one piece may meet
another piece. So each ground segment needs a search (`detection.terrain_pieces`), which is left out for terrains
without overlaps.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import loop
from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.mesh.components import components_of_facets
from rpf3d_core.terrain.mesh.edges import edges_of


def pieces_of(terrain: Terrain) -> IntArray:
    """Return the number (F,) of the piece of terrain of each facet: the smallest number of a vertex in the piece.

    A piece is a group of facets that are connected by common vertices.
    """
    owner = components_of_facets(len(terrain.vertices), terrain.triangles)
    return np.asarray(owner[terrain.triangles[:, 0]])


def rims_of(terrain: Terrain) -> NDArray[np.uint8]:
    """Return bits (F,) for each facet: bit k is 1 if the edge from corner k to the next corner is at the rim.

    An edge is at the rim of a piece if no other facet has the same edge.
    """
    edges, rims = edges_of(terrain.triangles, len(terrain.vertices)), np.zeros(len(terrain.triangles), np.uint8)
    alone = edges.uses == 1
    facet, ends = edges.facet[edges.start[alone]], np.stack([edges.low[alone], edges.high[alone]], axis=1)
    for k in range(3):
        sides = np.sort(terrain.triangles[facet][:, [k, (k + 1) % 3]], axis=1)
        rims[facet[(sides == ends).all(axis=1)]] |= np.uint8(1 << k)
    return rims


def may_cross(terrain: Terrain, piece: IntArray) -> bool:
    """Return True if the bounding boxes of two pieces overlap: the pieces may pass through each other.

    Boxes that only touch at vertical sides, such as the boxes of tiles, do not overlap. Boxes that touch at top and
    bottom do overlap: a rock on a level piece may slide under the piece above. The result may be True for pieces that
    lie one above the other without contact.

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
    """Return True if any two of P boxes overlap; low, high : (P, 3) m, corners of the boxes, sorted by lowest x."""
    for i in range(len(low)):
        for j in range(i + 1, len(low)):
            if low[j, 0] >= high[i, 0]:
                break
            apart = low[i, 2] > high[j, 2] or low[j, 2] > high[i, 2]
            for k in range(2):
                apart = apart or low[i, k] >= high[j, k] or low[j, k] >= high[i, k]
            if not apart:
                return True
    return False
