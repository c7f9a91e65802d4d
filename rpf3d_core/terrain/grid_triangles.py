"""Cut the squares of a grid of points into triangles, for terrains from rasters and gridded surveys."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import IntArray


def grid_triangles(there: NDArray[np.bool_], rows_run_south: bool = False) -> IntArray:
    """Return two triangles (F, 3) for each square of four neighbouring points; all squares have the same diagonal.

    there : (H, W) true where a point exists; the triangles (F, 3) number only the existing points, row by row, from 0
    rows_run_south : true if later rows lie south of earlier rows, with columns running east; facets then still face up

    A square with a missing point is a hole. The diagonal runs from each point to the point of the next row and column.
    """
    number = np.full(there.shape, -1, np.int32)
    number[there] = np.arange(np.count_nonzero(there), dtype=np.int32)
    beside, below = number[:-1, 1:], number[1:, :-1]
    second, fourth = (below, beside) if rows_run_south else (beside, below)
    first, opposite = number[:-1, :-1], number[1:, 1:]
    squares = np.stack([first, second, opposite, first, opposite, fourth], axis=-1).reshape(-1, 2, 3)
    full = squares.min(axis=(1, 2)) >= 0
    return np.ascontiguousarray(squares[full].reshape(-1, 3))
