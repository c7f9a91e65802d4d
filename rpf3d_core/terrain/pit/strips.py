"""Fill the strip between two neighbouring lines of points with triangles.

The lines may differ in their point counts.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray

IndexArray = NDArray[np.int64]


class StripLines(NamedTuple):
    """The lines of points on one side (left or right) of all strips, one line per strip.

    An entry is a point on a line; all lines together have A entries.

    strip : (A,) number of the strip, ascending; key : (A,) place along the line, ascending within a strip
    point : (A,) number of the point in the mesh
    """

    strip: IndexArray
    key: FloatArray
    point: IndexArray


def strip_triangles(right: StripLines, left: StripLines) -> tuple[IndexArray, IndexArray]:
    """Return triangles (T, 3) that fill strips between a right and a left line of points, and the origin of each (T,).

    The triangles are counter-clockwise seen from above. The points of both lines are visited in the order of their
    keys. Each point except the first of a line makes one triangle: with the previous point on its line and with the
    point last visited on the other line. Points of equal key are visited together, so an edge joins them. Both lines of
    a strip must begin at the same key.

    The origin is the entry of the point that made the triangle: an index into `right`, or the number of entries of
    `right` plus an index into `left`.
    """
    strip, key = np.concatenate([right.strip, left.strip]), np.concatenate([right.key, left.key])
    span = 2.0 * float(np.abs(key).max()) + 1.0
    # A stable sort visits right points before left points of equal key, and is fast: it merges two sorted runs.
    order = np.argsort(strip * span + key, kind="stable")
    on_right = order < len(right.point)
    last_right = np.cumsum(on_right) - 1
    last_left = np.cumsum(~on_right) - 1
    begins = np.concatenate([starts(right.strip), starts(left.strip)])[order]
    entry, on_right = order[~begins], on_right[~begins]
    at_right, at_left = last_right[~begins], last_left[~begins]
    triangles = np.empty((len(entry), 3), dtype=np.int64)
    triangles[:, 0] = right.point[np.where(on_right, at_right - 1, at_right)]
    triangles[:, 1] = np.where(on_right, right.point[at_right], left.point[at_left])
    triangles[:, 2] = left.point[np.where(on_right, at_left, at_left - 1)]
    return triangles, entry


def starts(strip: IndexArray) -> NDArray[np.bool_]:
    """Return flags (A,): true for each entry that is the first of its strip; such an entry makes no triangle.

    strip : (A,) number of the strip of each entry, ascending
    """
    first = np.ones(len(strip), dtype=bool)
    first[1:] = strip[1:] != strip[:-1]
    return first
