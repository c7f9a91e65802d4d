"""The edges of a triangle mesh: which facets meet at each, and in which direction each runs through it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.compiling import loop
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
    triangles = np.ascontiguousarray(triangles, dtype=np.int32)
    reach, keys = _reach(triangles).bit_length(), np.empty(3 * len(triangles), np.int64)
    _write_side_keys(triangles, vertices, reach, keys)
    keys, side = sort_keys(keys, vertices.bit_length() + reach + 1)
    used = int(np.searchsorted(keys, vertices << (reach + 1)))
    low, high, start, facet = (np.empty(used, np.int32) for _ in range(4))
    down = np.empty(used, np.bool_)
    count = _cut_into_edges(keys, side, used, reach, len(triangles), low, high, start, facet, down)
    start = start[:count]
    return Edges(low[:count], high[:count], start, np.diff(start, append=np.int32(used)), facet, down)


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


@loop
def _reach(triangles: Any) -> int:
    """The largest difference between two vertices of a side."""
    reach = 0
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        reach = max(reach, max(a, b, c) - min(a, b, c))
    return int(reach)


@loop
def _write_side_keys(triangles: Any, vertices: int, reach: int, keys: Any) -> None:
    """Write a number for each side (3 F,), k F + f for side k of facet f, with `reach` bits for the reach of an edge.

    It packs the lower vertex, the reach to the higher one and the direction, so that sorting brings the uses of an
    edge together; sides of collapsed facets come last.
    """
    count = len(triangles)
    for f in range(count):
        out = (
            triangles[f, 0] == triangles[f, 1]
            or triangles[f, 1] == triangles[f, 2]
            or triangles[f, 2] == triangles[f, 0]
        )
        for k in range(3):
            a, b = np.int64(triangles[f, k]), np.int64(triangles[f, (k + 1) % 3])
            key = (((min(a, b) << reach) + abs(b - a)) << 1) + (1 if a > b else 0)
            keys[k * count + f] = vertices << (reach + 1) if out else key


@loop
def _cut_into_edges(
    keys: Any, side: Any, used: int, reach: int, facets: int, low: Any, high: Any, start: Any, facet: Any, down: Any
) -> int:  # fmt: skip
    """Write the edges and their uses from sorted keys (3 F,) and the sides (3 F,) that they are of; how many edges."""
    count = 0
    for use in range(used):
        edge = keys[use] >> 1
        if use == 0 or edge != keys[use - 1] >> 1:
            low[count] = edge >> reach
            high[count] = low[count] + (edge & ((1 << reach) - 1))
            start[count] = use
            count += 1
        facet[use] = side[use] - facets * (0 if side[use] < facets else 1 if side[use] < 2 * facets else 2)
        down[use] = keys[use] & 1 == 1
    return count
