"""Connected components of a graph given as pairs of nodes: finds the separate parts of a mesh and chains of points."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import loop

Index = NDArray[np.int32]


def components(count: int, a: Index, b: Index) -> Index:
    """Return the connected component of each node of a graph, named by the smallest node in it.

    Parameters
    ----------
    count : int
        Number of nodes.
    a, b : (P,) int
        Pairs of connected nodes.

    Returns
    -------
    (count,) int
        For each node the smallest node of its component.
    """
    above: Index = np.arange(count, dtype=np.int32)
    _join(above, np.ascontiguousarray(a, dtype=np.int32), np.ascontiguousarray(b, dtype=np.int32))
    return above


def components_of_facets(count: int, triangles: Index) -> Index:
    """Return the connected component of each vertex of a mesh, named by the smallest vertex in it.

    The corners of a facet are connected. `components` would give the same, with copies of the corners as pairs.

    count : number of vertices; triangles : (F, 3), vertices of each facet
    """
    above: Index = np.arange(count, dtype=np.int32)
    _join_facets(above, np.ascontiguousarray(triangles, dtype=np.int32))
    return above


@loop
def _join(above: Any, a: Any, b: Any) -> None:
    """Find the components of a graph: write the smallest node of each node's component into `above` (N,).

    above : (N,) parent of each node, before the call the node itself; a, b : (P,) pairs of connected nodes
    """
    for p in range(len(a)):
        unite(above, a[p], b[p])
    name_by_roots(above)


@loop
def _join_facets(above: Any, triangles: Any) -> None:
    """Write the smallest vertex of each vertex's component into `above` (V,); the corners of a facet are connected.

    above : (V,) before the call each vertex itself; triangles : (F, 3), vertices of each facet
    """
    for f in range(len(triangles)):
        unite(above, triangles[f, 0], triangles[f, 1])
        unite(above, triangles[f, 1], triangles[f, 2])
    name_by_roots(above)


@loop
def unite(above: Any, i: Any, j: Any) -> None:
    """Join the components of two connected nodes.

    Each node has a parent, which is a smaller node or the node itself. A root is its own parent. The parents of a node,
    one after the other, lead to the root of the node. The smaller of the two roots becomes the parent of the larger
    root. Path halving at every look-up keeps paths short (Tarjan & van Leeuwen 1984, J. ACM 31:245).

    above : (N,) parent of each node; i, j : the nodes
    """
    while above[i] != i:
        above[i] = above[above[i]]
        i = above[i]
    while above[j] != j:
        above[j] = above[above[j]]
        j = above[j]
    if i < j:
        above[j] = i
    else:
        above[i] = j


@loop
def name_by_roots(above: Any) -> None:
    """Give every node its root as parent; in ascending order, so the parent of a node already has its root as parent.

    above : (N,) parent of each node
    """
    for i in range(len(above)):
        above[i] = above[above[i]]
