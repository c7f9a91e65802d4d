"""Choose the vertices through which sides of the rim may run, so that each of them closes a seam of the mesh.

A side that runs through vertices is cut into parts. A part closes a seam if exactly one other part of the rim has the
same two vertices, in the opposite direction: the facets on both sides of the seam then share this part. A part in the
same direction belongs to a facet on the same side, such as a second survey of the same ground.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.mesh.near_rim import Near
from rpf3d_core.terrain.mesh.rim import Numbers, Rim

Flags = NDArray[np.bool_]


class CutSides(NamedTuple):
    """The sides of the rim, cut at vertices.

    begin, end : (S + N,) vertices of each part; the parts of a side are consecutive
    before : (N,) the part that ends at the vertex of each pair; the next part begins at this vertex
    """

    begin: Numbers
    end: Numbers
    before: Numbers


def closing_pairs(pairs: Near, rim: Rim, vertices: int) -> Near:
    """Return the pairs of which the vertex is an end of at least one part of the side that closes a seam.

    Of each side, the vertices that close nothing are left out one after another, the farthest first.

    pairs : sorted as in `Near`; rim : the rim of the mesh; vertices : number of vertices
    """
    while len(pairs.vertex):
        parts = cut_sides(pairs, rim)
        closes = _is_matched(parts, vertices)
        idle = ~(closes[parts.before] | closes[parts.before + 1])
        if not idle.any():
            break
        pairs = pairs.of(~farthest(pairs.side, np.where(idle, pairs.gap, -1.0), idle))
    return pairs


def cut_sides(pairs: Near, rim: Rim) -> CutSides:
    """Return the sides of the rim, cut at the vertices of the pairs.

    pairs : sorted as in `Near`; rim : the rim of the mesh
    """
    sides, count = len(rim.begin), len(pairs.vertex)
    cuts = np.bincount(pairs.side, minlength=sides)
    last = np.arange(sides) + np.cumsum(cuts)
    before = pairs.side + np.arange(count)
    begin, end = np.empty(sides + count, np.int64), np.empty(sides + count, np.int64)
    begin[last - cuts], end[last] = rim.begin, rim.end
    begin[before + 1], end[before] = pairs.vertex, pairs.vertex
    return CutSides(begin=begin, end=end, before=before)


def farthest(group: Numbers, gap: NDArray[np.float64], some: Flags) -> Flags:
    """Return flags (N,): true for the pair of each group that has the largest gap, among some of the pairs.

    group : (N,) number of the group of each pair; gap : (N,) m; some : (N,) flags of the pairs that are compared
    """
    rows = np.flatnonzero(some)
    rows = rows[np.lexsort((-gap[rows], group[rows]))]
    first = np.ones(len(rows), bool)
    first[1:] = group[rows[1:]] != group[rows[:-1]]
    found = np.zeros(len(group), bool)
    found[rows[first]] = True
    return found


def _is_matched(parts: CutSides, vertices: int) -> Flags:
    """Return flags (N,): true for parts with exactly one opposite part, and no other part in the same direction.

    parts : the cut sides of the rim; vertices : number of vertices
    """
    key, opposite = parts.begin * vertices + parts.end, parts.end * vertices + parts.begin
    known, which, count = np.unique(key, return_inverse=True, return_counts=True)
    place = np.minimum(np.searchsorted(known, opposite), len(known) - 1)
    return np.asarray((known[place] == opposite) & (count[place] == 1) & (count[which] == 1))
