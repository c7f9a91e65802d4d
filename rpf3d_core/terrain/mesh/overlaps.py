"""Find pieces of a terrain that may pass through each other: a sliding rock would go on below one of them.

A slide follows the facets of its own piece, from edge to edge. It does not look for other pieces that cut through these
facets, as a muck pile does that is a file of its own. A flight meets the facets of all pieces.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.components import components

MOST_COMPARED = 2_000
"""Largest number of pieces whose boxes are compared with each other: 2,000 take 0.1 s. Of more pieces, the largest."""

Boxes = NDArray[np.float64]


def pieces_that_overlap(terrain: Terrain) -> int:
    """Return the number of pieces whose bounding box has a volume in common with the box of another piece.

    Pieces have no vertex in common. Tiles that only touch do not overlap. Pieces whose boxes overlap may still pass one
    above the other, without a common point.
    """
    boxes = _boxes_of_pieces(terrain)
    low, high = boxes[:, 0], boxes[:, 1]
    overlaps = np.ones((len(boxes), len(boxes)), dtype=bool)
    for k in range(3):
        overlaps &= low[:, None, k] < high[None, :, k]
    overlaps &= overlaps.T
    np.fill_diagonal(overlaps, val=False)
    return int(overlaps.any(axis=1).sum())


def overlap_warnings(terrain: Terrain, pieces: int) -> Iterator[str]:
    """Yield a sentence for the user if pieces of the terrain overlap.

    pieces : number of components of the fault report; a terrain of one piece is not searched
    """
    count = pieces_that_overlap(terrain) if pieces > 1 else 0
    if count:
        yield (
            f"{count:,} pieces of the terrain have no common edge and overlap: where two pieces pass through each "
            "other, a rock that slides may go on below one of them and be counted there, or end as left_terrain or "
            "unresolved_contact; merge them into one surface"
        )


def _boxes_of_pieces(terrain: Terrain) -> Boxes:
    """Return the boxes (P, 2, 3) m, low and high corner, of the pieces; at most MOST_COMPARED, the widest."""
    a, b, c = terrain.triangles.T
    piece = components(len(terrain.vertices), np.concatenate([a, b]), np.concatenate([b, c]))
    used = np.unique(terrain.triangles)
    owners, number = np.unique(piece[used], return_inverse=True)
    low, high = np.full((len(owners), 3), np.inf), np.full((len(owners), 3), -np.inf)
    np.minimum.at(low, number, terrain.vertices[used])
    np.maximum.at(high, number, terrain.vertices[used])
    boxes = np.stack([low, high], axis=1)
    widest = np.argsort(-np.ptp(boxes[:, :, :2], axis=1).max(axis=1), kind="stable")
    return np.asarray(boxes[widest[:MOST_COMPARED]])
