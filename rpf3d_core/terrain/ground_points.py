"""Choose the points of the ground from a cloud: by class, and the lowest point of each cell of a square grid in plan.

The chosen points keep their places, so thinning moves no point of a slope.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.frame import FloatArray

Ids = NDArray[np.int64]

GROUND = 2
"""Class of ground in LAS files (ASPRS LAS 1.4, table 17)."""
NOISE = (7, 18)
"""Classes of low and high noise in LAS files (ASPRS LAS 1.4, table 17)."""
POINTS_PER_CELL = 4.0
"""Mean number of points in a cell of the default size; about 2 % of the cells of an even cloud are then empty."""
ROUNDS = 4
"""Number of steps in which the default cell size is found; each step corrects the size for cells without points."""
SAMPLE = 250_000
"""Largest number of points from which the default cell size is found."""
MOST_LINES = 10
"""Largest product of the numbers of different x and different y, divided by the number of points, for a grid (-).

Points that do not form a grid have far more different coordinates.
"""
EVEN = 1e-3
"""Largest deviation of a grid's columns and rows from even spacing, in spacings (-)."""
MOST_CELLS = 2**31
"""Number of columns, or of rows, of cells from which a grid is refused."""


class Cells(NamedTuple):
    """The chosen points, one for each cell with points, ordered by row and column.

    point : (K,) index of the chosen point in the array of points; held : (K,) count of all points in the cell
    row, column : (K,) row and column of the cell; size : side of a cell (m)
    """

    point: Ids
    held: Ids
    row: Ids
    column: Ids
    size: float


def ground_class(classes: NDArray[np.uint8], wanted: tuple[int, ...] = ()) -> NDArray[np.bool_]:
    """Return flags (N,): true for the points of a cloud that are ground.

    classes : (N,) LAS class of each point
    wanted : classes that count as ground; () for the class ground or, if no point has this class, for all points that
        are not noise
    """
    if wanted:
        return np.asarray(np.isin(classes, wanted))
    ground = classes == GROUND
    return np.asarray(ground if ground.any() else ~np.isin(classes, NOISE))


def default_cell(points: FloatArray) -> float:
    """Return the default side (m) of cells for points (N, 3) m.

    The side is the spacing of the points if they form a grid. Otherwise it is a side that gives POINTS_PER_CELL points
    in a cell on average, rounded to two digits.

    Raises
    ------
    TerrainError
        The points lie on one line along the x or y axis.
    """
    if spacing := _grid_spacing(points):
        return spacing
    width, depth = np.ptp(points[:, :2], axis=0).tolist()
    if width <= 0.0 or depth <= 0.0:
        raise TerrainError("the points of the cloud lie on one line in plan; a terrain needs an area")
    every = -(-len(points) // SAMPLE)
    sample = points[::every]
    size = float(np.sqrt(POINTS_PER_CELL * width * depth / len(sample)))
    for _ in range(ROUNDS):
        size *= float(np.sqrt(POINTS_PER_CELL * _different(_keys(sample, size)[0]) / len(sample)))
    return float(f"{size / np.sqrt(every):.2g}")


def _different(values: NDArray[Any]) -> int:
    """Return the number of different values in an array (N,)."""
    return int(np.count_nonzero(np.diff(np.sort(values)))) + 1


def lowest_in_cells(points: FloatArray, size: float) -> Cells:
    """Return the lowest of the points (N, 3) m in each cell of a square grid in plan; of equally low points, the first.

    size : side of a cell (m)

    Raises
    ------
    TerrainError
        The cells are too small for the extent of the points.
    """
    key, columns = _keys(points, size)
    order = np.lexsort((points[:, 2], key))
    sorted_key = key[order]
    begin = np.flatnonzero(np.concatenate([[True], sorted_key[1:] != sorted_key[:-1]]))
    row, column = np.divmod(sorted_key[begin], columns)
    count = np.diff(np.concatenate([begin, [len(key)]]))
    return Cells(point=order[begin], held=count, row=row, column=column, size=size)


def _keys(points: FloatArray, size: float) -> tuple[Ids, int]:
    """Return the number (N,) of the cell of each point, counted row by row, and the number of columns.

    points : (N, 3) m; size : side of a cell (m)

    Raises TerrainError if the number of columns or of rows would reach MOST_CELLS, or if `size` is not above 0.
    """
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    columns, rows = ((high - low) / size + 2.0).tolist()
    if not (size > 0.0 and columns < MOST_CELLS and rows < MOST_CELLS):
        raise TerrainError(f"cells of {size:g} m are too small for a cloud of {columns:.3g} x {rows:.3g} such cells")
    # With the 0.5, the points of a grid whose spacing is the cell size lie at the centres of the cells.
    column, row = np.floor((points[:, :2] - low) / size + 0.5).astype(np.int64).T
    return row * int(columns) + column, int(columns)


def _grid_spacing(points: FloatArray) -> float:
    """Return the spacing (m) of points that form a grid of squares along the axes; 0.0 if the points are not a grid."""
    every = points[:: -(-len(points) // SAMPLE)]
    if _different(every[:, 0]) * _different(every[:, 1]) > MOST_LINES * len(points):
        return 0.0
    steps = []
    for axis in (0, 1):
        lines = np.unique(points[:, axis])
        if len(lines) < 3:
            return 0.0
        steps.append(np.diff(lines))
    if (len(steps[0]) + 1) * (len(steps[1]) + 1) > MOST_LINES * len(points):
        return 0.0
    spacing = float(np.median(steps[0]))
    even = all(np.abs(step / spacing - np.round(step / spacing)).max() < EVEN and step.min() > 0.5 * spacing
               for step in steps)  # fmt: skip
    return spacing if even else 0.0
