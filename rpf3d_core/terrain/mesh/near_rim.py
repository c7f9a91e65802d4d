"""Find the vertices of a mesh's rim that lie close to a side of the rim, between the ends of the side."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.rim import Numbers, Rim

WIDEST = 0.05
"""Largest distance (m) at which a vertex is close to a side; a wider gap is a hole or a step of the terrain."""


class Near(NamedTuple):
    """Pairs of a vertex and a side of the rim that are close to each other, sorted by the side and along the side.

    vertex, side : (N,) numbers of the vertex, and of the side in the rim
    gap : (N,) m, distance of the vertex from the side; share : (N,) place of the nearest point on the side, 0 to 1
    length : (N,) m, of the side
    """

    vertex: Numbers
    side: Numbers
    gap: FloatArray
    share: FloatArray
    length: FloatArray

    def of(self, which: NDArray[np.bool_] | Numbers) -> "Near":
        """Return some of the pairs; which : (N,) flags, or rows (M,)."""
        return Near(
            vertex=self.vertex[which],
            side=self.side[which],
            gap=self.gap[which],
            share=self.share[which],
            length=self.length[which],
        )


def joined_pairs(parts: Sequence[Near]) -> Near:
    """Return the pairs of several records as one record, in this order; parts : at least one record."""
    return Near(
        vertex=np.concatenate([part.vertex for part in parts]),
        side=np.concatenate([part.side for part in parts]),
        gap=np.concatenate([part.gap for part in parts]),
        share=np.concatenate([part.share for part in parts]),
        length=np.concatenate([part.length for part in parts]),
    )


def near_rim(vertices: FloatArray, rim: Rim, searched: Numbers | None = None) -> Near:
    """Return all pairs of a vertex of the rim and a side of the rim that are at most WIDEST (m) apart.

    The distance may be 0. Left out are pairs for which the nearest point of the side is one of its ends, or the vertex
    is a corner of the side's facet.

    vertices : (V, 3) m; rim : the rim of the mesh; searched : (N,) the sides to search; None to search all sides
    """
    on_rim = np.unique(np.concatenate([rim.begin, rim.end]))
    some = np.arange(len(rim.begin)) if searched is None else searched
    begin, end, third = rim.begin[some], rim.end[some], rim.third[some]
    ends = vertices[np.stack([begin, end], axis=1)]
    points = shapely.points(vertices[on_rim, :2])
    index = shapely.STRtree(shapely.linestrings(ends[:, :, :2]))
    near, side = index.query(points, predicate="dwithin", distance=WIDEST)
    vertex = on_rim[near]
    other = (vertex != begin[side]) & (vertex != end[side]) & (vertex != third[side])
    vertex, side = vertex[other], side[other]
    gap, share, length = _distances(vertices[vertex], ends[side])
    pairs = Near(vertex=vertex, side=some[side], gap=gap, share=share, length=length)
    pairs = pairs.of((share > 0.0) & (share < 1.0) & (gap <= WIDEST))
    return pairs.of(np.lexsort((pairs.share, pairs.side)))


def _distances(points: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distances (N,) m of points from sides, the places (N,) of the nearest points, and side lengths (N,) m.

    A place is a share of the side; it is outside 0 to 1 if the nearest point of the side's line is not on the side.

    points : (N, 3) m; ends : (N, 2, 3) m, both ends of each side
    """
    along, offset = ends[:, 1] - ends[:, 0], points - ends[:, 0]
    squared = (along * along).sum(axis=1)
    share = (along * offset).sum(axis=1) / np.where(squared > 0.0, squared, 1.0)
    gap = np.linalg.norm(offset - share[:, None] * along, axis=1)
    return gap, share, np.sqrt(squared)
