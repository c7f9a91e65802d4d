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

    The root of a node is the last node of the chain that leads from each node to the node to which it is attached. For
    each pair of connected nodes, the larger root is attached to the smaller root; then every node is attached to its
    root. Path halving at every look-up keeps paths short (Tarjan & van Leeuwen 1984, J. ACM 31:245). A
    node is always attached to a smaller node. So the last loop, in ascending order, finds each parent already attached
    to its root.

    above : (N,) node to which each node is attached, before the call the node itself; a, b : (P,) connected nodes
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
