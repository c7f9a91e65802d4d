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


@loop
def _join(above: Any, a: Any, b: Any) -> None:
    """Find the components of a graph: write the smallest node of each node's component into `above` (N,).

    Each node has a parent, which is a smaller node or the node itself. A root is its own parent. The parents of a node,
    one after the other, lead to the root of the node. For each pair of connected nodes, the smaller of their two roots
    becomes the parent of the larger root. The last loop gives every node its root as parent. The loop runs in ascending
    order, so the parent of a node already has its root as parent. Path halving at every look-up keeps paths short
    (Tarjan & van Leeuwen 1984, J. ACM 31:245).

    above : (N,) parent of each node, before the call the node itself; a, b : (P,) pairs of connected nodes
    """
    for p in range(len(a)):
        i, j = a[p], b[p]
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
    for i in range(len(above)):
        above[i] = above[above[i]]
