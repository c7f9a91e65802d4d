"""Choose the vertices through which sides of the rim may run, so that each chosen vertex closes a seam of the mesh.

A pair consists of a vertex of the rim and a side of the rim close to the vertex (`near_rim.Near`). A side that runs
through vertices is cut into parts. A part closes a seam if exactly one other part of the rim has the same two vertices,
in the opposite direction: the facets on both sides of the seam then share this part. A part in the same direction
belongs to a facet on the same side, such as a second survey of the same ground. If two surfaces with a step between
them have no common vertex, parts from a vertex of one surface to a vertex of the other fit each other, but close the
step only here and there; such parts do not count.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.mesh.components import components
from rpf3d_core.terrain.mesh.near_rim import Near
from rpf3d_core.terrain.mesh.rim import Numbers, Rim

Flags = NDArray[np.bool_]


class CutSides(NamedTuple):
    """The S sides of the rim, cut at the vertices of N pairs into S + N parts.

    begin, end : (S + N,) vertices of each part; the parts of a side are consecutive
    first, last : (S + N,) flags: true for the first and for the last part of a side
    before : (N,) the part that ends at the vertex of each pair; the next part begins at this vertex
    """

    begin: Numbers
    end: Numbers
    first: Flags
    last: Flags
    before: Numbers


def closing_pairs(pairs: Near, rim: Rim, vertices: int) -> Near:
    """Return the pairs whose vertex closes a seam: at least one of the two parts that end at the vertex closes a seam.

    The other vertices of each side are left out one after another, the farthest first.

    pairs : sorted as in `Near`; rim : the rim of the mesh; vertices : number of vertices
    """
    while len(pairs.vertex):
        parts = cut_sides(pairs, rim)
        closes = _closes(parts, vertices)
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
    is_first, is_last = np.zeros(sides + count, bool), np.zeros(sides + count, bool)
    is_first[last - cuts], is_last[last] = True, True
    return CutSides(begin=begin, end=end, first=is_first, last=is_last, before=before)


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


def _closes(parts: CutSides, vertices: int) -> Flags:
    """Return flags (S + N,): true for parts that close a seam.

    Such a part has exactly one opposite part. Each end of the part was an end of at least one of the two sides before
    they were cut. Such parts with common vertices form a chain. In the chain, at least one part is a whole side on one
    side of the seam, or has an end that was an end of both sides before they were cut.

    parts : the cut sides of the rim; vertices : number of vertices
    """
    matched, opposite = _opposites(parts, vertices)
    first, last = parts.first, parts.last
    matched &= (first | last[opposite]) & (last | first[opposite])
    firm = matched & ((first & last) | (first & last[opposite]) | (last & first[opposite]))
    firm |= matched & firm[opposite]
    ends = parts.begin[matched].astype(np.int32), parts.end[matched].astype(np.int32)
    chain = components(vertices, *ends)
    is_firm = np.zeros(vertices, bool)
    is_firm[chain[parts.begin[firm]]] = True
    return np.asarray(matched & is_firm[chain[parts.begin]])


def _opposites(parts: CutSides, vertices: int) -> tuple[Flags, Numbers]:
    """Return flags (S + N,), true for parts with exactly one opposite part, and the number (S + N,) of this part.

    The flag is false if another part has the same two vertices in the same direction. The number has no meaning for a
    part without the flag.

    parts : the cut sides of the rim; vertices : number of vertices
    """
    key, reverse = parts.begin * vertices + parts.end, parts.end * vertices + parts.begin
    known, row, which, count = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    place = np.minimum(np.searchsorted(known, reverse), len(known) - 1)
    matched = (known[place] == reverse) & (count[place] == 1) & (count[which] == 1)
    return matched, row[place]
