"""Connected components of a graph given as pairs."""

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.int32]


def components(count: int, a: Index, b: Index) -> Index:
    """The smallest node that each node is connected to.

    Every round hangs the larger root of each remaining pair under the smaller and flattens the trees, which halves the
    number of roots at least; the answer does not depend on the order of the pairs. After Shiloach & Vishkin 1982,
    J. Algorithms 3:57.

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
    root: Index = np.arange(count, dtype=np.int32)
    while len(a):
        root[np.maximum(a, b)] = np.minimum(a, b)
        root = _flattened(root)
        a, b = root[a], root[b]
        apart = a != b
        a, b = a[apart], b[apart]
    return root


def _flattened(root: Index) -> Index:
    while True:
        above = root[root]
        if not (above != root).any():
            return root
        root = above
