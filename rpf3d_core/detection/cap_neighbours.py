"""Find the neighbours of each cap, so that a straight path in plan can be followed over the caps to the gap's border.

A cap is a triangle that closes a gap of the terrain, or a part of a gap.
"""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray

NO_CAP = -1
"""Number in place of a neighbour if the ground around the gap begins at this side of a cap."""


def neighbours_of(corners: FloatArray) -> NDArray[np.int32]:
    """Return the number (3 T,) of the cap beyond each side of each of T caps, or NO_CAP; side k begins at corner k.

    The number for side k of cap f is element 3 f + k.

    Two caps are neighbours if they have a side in common, in opposite directions. Two gaps that touch in a single
    vertex therefore have no neighbours in each other.

    corners : (T, 3, 3) m, counter-clockwise seen from the free side
    """
    _, number = np.unique(corners.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
    begin = number.reshape(-1, 3).astype(np.int64)
    end, count = np.roll(begin, -1, axis=1), len(number) + 1
    key, reverse = (begin * count + end).ravel(), (end * count + begin).ravel()
    order = np.argsort(key, kind="stable")
    place = np.minimum(np.searchsorted(key, reverse, sorter=order), max(len(key) - 1, 0))
    opposite = order[place]
    known = (key[opposite] == reverse) & (begin != end).ravel()
    return np.where(known, opposite // 3, NO_CAP).astype(np.int32)
