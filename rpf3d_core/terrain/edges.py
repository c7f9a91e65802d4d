"""The edges of a triangle mesh: which facets meet at each, and in which direction each runs through it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.ordering import sort_keys

Index = NDArray[np.int32]
Flags = NDArray[np.bool_]


class Edges(NamedTuple):
    """Edges of a mesh, each with its run of uses; a use is one facet's side.

    low, high : (E,) the vertices of each edge, low < high
    start : (E,) first use of each edge; uses : (E,) their number
    facet : (U,) the facet of each use
    down : (U,) whether the facet runs from high to low
    A facet with two corners on one vertex has no sides here: its neighbours meet as if it were not there.
    """

    low: Index
    high: Index
    start: Index
    uses: Index
    facet: Index
    down: Flags


def edges_of(triangles: Index, vertices: int) -> Edges:
    """The edges of F triangles (F, 3) over a number of vertices, sorted by their vertices."""
    keys, reach = _side_keys(triangles, vertices)
    keys, side = sort_keys(keys, vertices.bit_length() + reach + 1)
    used = int(np.searchsorted(keys, vertices << (reach + 1)))
    keys, side = keys[:used], side[:used]
    down = (keys & 1).astype(bool)
    keys >>= 1
    begins = np.ones(used, bool)
    begins[1:] = keys[1:] != keys[:-1]
    start = np.flatnonzero(begins).astype(np.int32)
    edge = keys[start]
    low = (edge >> reach).astype(np.int32)
    return Edges(
        low=low,
        high=low + (edge & ((1 << reach) - 1)).astype(np.int32),
        start=start,
        uses=np.diff(start, append=np.int32(used)),
        facet=_facet_of_side(side, len(triangles)),
        down=down,
    )


def collapsed(triangles: Index) -> Flags:
    """(F,) whether two corners of a facet are the same vertex."""
    a, b, c = triangles.T
    return np.asarray((a == b) | (b == c) | (c == a))


def shared_by_two(edges: Edges) -> tuple[Index, Index, Flags]:
    """Facets (P,), (P,) on the two sides of each manifold edge, and whether their windings agree there."""
    first = edges.start[edges.uses == 2]
    agree = edges.down[first] != edges.down[first + 1]
    return edges.facet[first], edges.facet[first + 1], agree


def facets_on_borders(edges: Edges) -> Index:
    """The facets (B,) of all uses of edges that have not exactly two: boundaries and non-manifold edges."""
    return np.asarray(edges.facet[np.repeat(edges.uses != 2, edges.uses)])


def _side_keys(triangles: Index, vertices: int) -> tuple[NDArray[np.int64], int]:
    """(3 F,) a number for each side, k F + f for side k of facet f, and the bits that the reach of an edge takes.

    It packs the lower vertex, the reach to the higher one and the direction, so that sorting brings the uses of an
    edge together; sides of collapsed facets come last.
    """
    corners = np.ascontiguousarray(triangles.T, dtype=np.int64)
    ends = np.roll(corners, -1, axis=0)
    low = np.minimum(corners, ends)
    between = np.abs(ends - corners)
    reach = int(between.max()).bit_length()
    out = collapsed(triangles)
    low[:, out] = vertices
    between[:, out] = 0
    low <<= reach
    low += between
    low <<= 1
    low += corners > ends
    low[:, out] &= ~np.int64(1)
    return low.ravel(), reach


def _facet_of_side(side: Index, facets: int) -> Index:
    """The facet of each side k F + f, without a slow division."""
    facet: Index = side - (side >= facets) * np.int32(facets)
    return np.asarray(facet - (facet >= facets) * np.int32(facets))
