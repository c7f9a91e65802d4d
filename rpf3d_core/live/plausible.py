"""Refuse a survey with a shape that no ground has: heights that mean "no data", and grids that fold back.

On such a survey, rocks would stop in a pit or between layers that do not exist, and would seem to reach nothing.
"""

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray

Indices = NDArray[np.integer[Any]]

TALLEST_FACE = 50.0
"""Largest height (m) of one facet that is steeper than STEEP, unless the user sets another height."""
STEEP = 80.0
"""Slope (degrees) above which the height of a facet is limited."""
FOLD = 1.0
"""Largest distance in plan (m) by which a grid may fold back, as below a small overhang."""


def check_heights(terrain: Terrain, corners: FloatArray, normals: FloatArray, tallest: float) -> None:
    """Raise TerrainError if a facet steeper than STEEP (80 degrees) is taller than `tallest` (m).

    Such facets arise next to a height that means "no data".

    corners : (F, 9) m; normals : (F, 3), unit vectors, or 0 for a facet without an area
    """
    steep = np.flatnonzero(np.abs(normals[:, 2]) < math.cos(math.radians(STEEP)))
    steep = steep[normals[steep].any(axis=1)]
    heights = corners[steep][:, 2::3]
    tall = np.ptp(heights, axis=1) > tallest
    if not tall.any():
        return
    at = steep[int(np.argmax(np.ptp(heights, axis=1)))]
    places = terrain.frame.points_to_input(corners[at].reshape(3, 3))
    (x, y, _), low, high = places.mean(axis=0), places[:, 2].min(), places[:, 2].max()
    raise TerrainError(
        f"{int(tall.sum()):,} facets are steeper than {STEEP:g} degrees and taller than {tallest:g} m; the tallest is "
        f"at ({x:.1f}, {y:.1f}), from height {low:.1f} to {high:.1f} m: if a height stands for a missing point, "
        "publish NaN or leave the point out; if the face is real, set tallest_face to a larger height"
    )


def check_no_fold(terrain: Terrain, normals: FloatArray, points: FloatArray) -> None:
    """Raise TerrainError if a grid folds back over itself in plan by more than FOLD (1 m).

    A place under a fold has several heights.

    terrain : made from the grid; normals : (F, 3), of its facets
    points : (H, W, 3) m, the grid, with NaN where a point is missing
    """
    down = np.flatnonzero(normals[:, 2] < 0.0)
    if not len(down):
        return
    there, columns = np.flatnonzero(~np.isnan(points).any(axis=-1)), points.shape[1]
    corner_row, corner_column = np.divmod(there[terrain.triangles[down]], columns)
    squares = np.unique(corner_row.min(axis=1) * columns + corner_column.min(axis=1))
    row, column = np.divmod(squares, columns)
    depth = np.maximum(_depth(points, row, column), _depth(points.swapaxes(0, 1), column, row))
    if depth.max() > FOLD:
        x, y, _ = points[row[int(depth.argmax())], column[int(depth.argmax())]]
        raise TerrainError(
            f"the grid folds back over itself in plan at {int((depth > FOLD).sum()):,} squares, by up to "
            f"{depth.max():.1f} m at ({x:.1f}, {y:.1f}): publish one scan whose rows run in the same direction, or "
            "publish the ground as scattered points or as a mesh; if one point is an outlier, write NaN there"
        )


def _depth(points: FloatArray, row: Indices, column: Indices) -> FloatArray:
    """Return the distances (N,) m by which a grid folds back along its columns at N given squares; 0 for no fold.

    Given squares in successive rows of one column form a run. A run folds back if, at one of its squares, the grid
    changes its direction: the step from row to row is opposite to the step before or after. Each square of such a run
    gets the length in plan of the whole run.

    points : (H, W, 3) m, the grid; row, column : (N,) indices of the first corner of each given square
    """
    last, step_back, is_back = points.shape[0] - 1, np.zeros(len(row)), np.zeros(len(row), dtype=bool)
    for side in (0, 1):
        place = [points[np.clip(row + k, 0, last), column + side, :2] for k in (-1, 0, 1, 2)]
        before, step, after = (b - a for a, b in pairwise(place))
        # A missing point is NaN, and the comparison with it False.
        is_back |= ((before * step).sum(axis=1) < 0.0) | ((after * step).sum(axis=1) < 0.0)
        step_back = np.maximum(step_back, np.hypot(step[:, 0], step[:, 1]))
    order = np.lexsort((row, column))
    begins = np.flatnonzero((np.diff(row[order], prepend=-2) != 1) | (np.diff(column[order], prepend=-2) != 0))
    lengths = np.add.reduceat(step_back[order], begins)
    depth, run = np.empty(len(row)), np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(row))))
    depth[order] = np.where(np.logical_or.reduceat(is_back[order], begins), lengths, 0.0)[run]
    return depth
