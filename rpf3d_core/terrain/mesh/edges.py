"""Find the edges of a triangle mesh, the facets at each edge, and the direction of the edge in each facet."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import loop
from rpf3d_core.terrain.mesh.ordering import sort_keys

Index = NDArray[np.int32]
Flags = NDArray[np.bool_]


class Edges(NamedTuple):
    """The edges of a mesh, each with its uses. A use is one side of a facet; the uses of an edge are consecutive.

    low, high : (E,) the vertices of each edge, low < high
    start : (E,) first use of each edge; uses : (E,) number of uses
    facet : (U,) the facet of each use
    down : (U,) true if the side of the facet goes from vertex `high` to vertex `low`

    A facet with two corners on one vertex has no uses: its two neighbours share an edge as if the facet did not exist.
    """

    low: Index
    high: Index
    start: Index
    uses: Index
    facet: Index
    down: Flags


def edges_of(triangles: Index, vertices: int) -> Edges:
    """Return the edges of F triangles (F, 3), sorted by their vertices, to repair and check the mesh.

    vertices : number of vertices
    """
    triangles = np.ascontiguousarray(triangles, dtype=np.int32)
    reach, keys = _reach(triangles).bit_length(), np.empty(3 * len(triangles), np.int64)
    _write_side_keys(triangles, vertices, reach, keys)
    keys, side = sort_keys(keys, vertices.bit_length() + reach + 1)
    used = int(np.searchsorted(keys, vertices << (reach + 1)))
    low, high, start, uses, facet = (np.empty(used, np.int32) for _ in range(5))
    edges = Edges(low=low, high=high, start=start, uses=uses, facet=facet, down=np.empty(used, np.bool_))
    count = _cut_into_edges(keys, side, reach, len(triangles), edges)
    return edges._replace(low=low[:count], high=high[:count], start=start[:count], uses=uses[:count])


def collapsed(triangles: Index) -> Flags:
    """Return flags (F,): true for facets with two corners on the same vertex: they have no area and no edges."""
    a, b, c = triangles.T
    return np.asarray((a == b) | (b == c) | (c == a))


def shared_by_two(edges: Edges) -> tuple[Index, Index, Flags]:
    """Return both facets (P,), (P,) at each edge of exactly two facets, and flags (P,): true if the windings agree."""
    first = edges.start[edges.uses == 2]
    agree = edges.down[first] != edges.down[first + 1]
    return edges.facet[first], edges.facet[first + 1], agree


def facets_on_borders(edges: Edges) -> Index:
    """Return the facets (B,) at edges with one facet or more than two: a component with such an edge is not closed.

    A facet with several such edges occurs several times.
    """
    return np.asarray(edges.facet[np.repeat(edges.uses != 2, edges.uses)])


@loop
def _reach(triangles: Any) -> int:
    """Return the largest difference between two vertex numbers of a facet, to pack the ends of a side into few bits.

    triangles : (F, 3) vertex numbers
    """
    reach = 0
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        reach = max(reach, max(a, b, c) - min(a, b, c))
    return int(reach)


@loop
def _write_side_keys(triangles: Any, vertices: int, reach: int, keys: Any) -> None:
    """Write a key for each side of a facet into keys (3 F,); sorting the keys brings the sides of an edge together.

    The key of side k of facet f is at index k F + f. A key packs the lower vertex, the difference to the higher vertex
    and the direction. Sides of collapsed facets get the largest key, so they are sorted to the end.

    triangles : (F, 3); vertices : number of vertices; reach : number of bits for the difference of two vertices
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
def _cut_into_edges(keys: Any, side: Any, reach: int, facets: int, edges: Edges) -> int:
    """Write the edges of a mesh and their uses into `edges`, from the sorted keys of the sides; return the edge count.

    keys : (3 F,) sorted keys of the sides of facets (`_write_side_keys`); side : (3 F,) the index of each key
        before sorting, which is k F + f for side k of facet f
    facets : number of facets; edges : arrays with space for one edge per use
    reach : number of bits for the difference of the two vertex numbers of a side, as in `_write_side_keys`
    """
    count = 0
    for use in range(len(edges.facet)):
        edge = keys[use] >> 1
        if use == 0 or edge != keys[use - 1] >> 1:
            edges.low[count] = edge >> reach
            edges.high[count] = edges.low[count] + (edge & ((1 << reach) - 1))
            edges.start[count] = use
            edges.uses[count] = 0
            count += 1
        edges.uses[count - 1] += 1
        edges.facet[use] = side[use] - facets * (0 if side[use] < facets else 1 if side[use] < 2 * facets else 2)
        edges.down[use] = keys[use] & 1 == 1
    return count
