"""A grid of points cut into triangles."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import IntArray


def grid_triangles(there: NDArray[np.bool_], rows_run_south: bool = False) -> IntArray:
    """Two triangles (F, 3) for each square of four neighbouring points, all cut along the same diagonal.

    there : (H, W) whether a point exists; points are numbered row by row, those that exist only
    rows_run_south : whether later rows lie south of earlier ones, columns running east; the facets then still look up

    A square with a point missing is a hole. The diagonal runs from each point to that of the next row and column.
    """
    number = np.full(there.shape, -1, np.int32)
    number[there] = np.arange(np.count_nonzero(there), dtype=np.int32)
    beside, below = number[:-1, 1:], number[1:, :-1]
    second, fourth = (below, beside) if rows_run_south else (beside, below)
    first, opposite = number[:-1, :-1], number[1:, 1:]
    squares = np.stack([first, second, opposite, first, opposite, fourth], axis=-1).reshape(-1, 2, 3)
    full = squares.min(axis=(1, 2)) >= 0
    return np.ascontiguousarray(squares[full].reshape(-1, 3))
