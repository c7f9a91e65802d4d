"""Fill the strip between two neighbouring lines of points with triangles.

The lines may differ in their point counts.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray

IndexArray = NDArray[np.int64]


class StripLines(NamedTuple):
    """The lines of points on one side of all strips, one line per strip.

    strip : (A,) number of the strip, ascending; key : (A,) place along the line, ascending within a strip
    point : (A,) index of the point
    """

    strip: IndexArray
    key: FloatArray
    point: IndexArray


def strip_triangles(right: StripLines, left: StripLines) -> tuple[IndexArray, IndexArray]:
    """Return triangles that fill the strips between neighbouring lines of points, a right and a left line each.

    Each point except the first of a line makes one triangle: with the previous point on its line and with the point
    last passed on the other line. Points of equal key are passed together, so an edge joins them. The two lines of a
    strip begin at the same key.

    Returns triangles (T, 3), counter-clockwise seen from above, and the entry (T,) whose point made the triangle: an
    index into the right lines or, minus the number of right entries, into the left lines.
    """
    strip, key = np.concatenate([right.strip, left.strip]), np.concatenate([right.key, left.key])
    span = 2.0 * float(np.abs(key).max()) + 1.0
    # A stable sort passes right before left where keys are equal, and only merges two sorted runs.
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
    """Return true for entries that are the first of their strip, which make no triangle."""
    first = np.ones(len(strip), dtype=bool)
    first[1:] = strip[1:] != strip[:-1]
    return first
