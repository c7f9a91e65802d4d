"""Obstacles sorted into the square cells of a grid in plan, and the search for the first obstacle on an arc.

In plan an arc is a straight line, so the search tests only the obstacles in the cells that the arc crosses. Each kind
of obstacle has a rule in `time_to` and a field `cells`.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import Arc
from rpf3d_core.effects.hooks import NO_MEETING, Meeting
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.terrain.frame import FloatArray

CELLS_PER_OBSTACLE = 2.0
"""Approximate largest number of cells of a grid per obstacle (-), which limits the memory."""
FEWEST_CELLS = 16
"""Number of cells that a grid may always have, even with few obstacles."""
SLOWEST = 1e-9
"""Speed (m/s) along a horizontal axis below which an arc counts as staying in one row or column of cells."""


class ObstacleCells(NamedTuple):
    """The obstacles of one kind (trees or panel segments), sorted into a grid of nx by ny square cells in plan.

    x, y : south-west corner of the grid (m); cell : side of a cell (m)
    starts, ids : (nx ny + 1,) and (M,), the indices of the obstacles in cell k = j nx + i are
        ids[starts[k] : starts[k + 1]]. An obstacle is in each cell that its box touches
    """

    x: float
    y: float
    cell: float
    nx: int
    ny: int
    starts: Any
    ids: Any


def cells_of(low: FloatArray, high: FloatArray) -> ObstacleCells:
    """Return the grid in plan that contains N obstacles, N >= 0, sorted into its cells.

    low, high : (N, 2) m, corners of the box of each obstacle in plan
    """
    if not len(low):
        return ObstacleCells(
            x=0.0, y=0.0, cell=1.0, nx=0, ny=0, starts=np.zeros(1, dtype=np.int64), ids=np.empty(0, dtype=np.int64)
        )
    begin, end = low.min(axis=0), high.max(axis=0)
    most = max(CELLS_PER_OBSTACLE * len(low), FEWEST_CELLS)
    width, depth = (end - begin).tolist()
    cell = max(math.sqrt(width * depth / most), max(width, depth) / most, float(np.median(high - low))) or 1.0
    nx, ny = int(width / cell) + 1, int(depth / cell) + 1
    first = _cell_indices(low, begin, cell, nx, ny)
    span = _cell_indices(high, begin, cell, nx, ny) - first + 1
    ids = np.repeat(np.arange(len(low)), span.prod(axis=1))
    within = np.arange(len(ids)) - np.repeat(np.cumsum(span.prod(axis=1)) - span.prod(axis=1), span.prod(axis=1))
    column, row = first[ids, 0] + within % span[ids, 0], first[ids, 1] + within // span[ids, 0]
    place = row * nx + column
    order = np.argsort(place, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(place, minlength=nx * ny))])
    return ObstacleCells(
        x=float(begin[0]),
        y=float(begin[1]),
        cell=cell,
        nx=nx,
        ny=ny,
        starts=starts.astype(np.int64),
        ids=ids[order].astype(np.int64),
    )


def _cell_indices(points: FloatArray, begin: FloatArray, cell: float, nx: int, ny: int) -> np.ndarray:
    """Return column and row (N, 2) of the cells that contain points (N, 2) m; outside the grid, of the nearest cells.

    begin : (2,) m, corner of the grid; cell : side of a cell (m)
    nx, ny : numbers of columns and rows of the grid
    """
    return np.clip(np.floor((points - begin) / cell).astype(np.int64), 0, [nx - 1, ny - 1])


@model_function
def time_to(obstacles: object, k: int, arc: Arc, passed: int, until: float, rock: RockContext) -> float:
    """Return the time (s), 0 to `until`, at which a rock on an arc meets obstacle k; inf if never.

    There is one rule for each kind of obstacle.

    obstacles : all obstacles of one kind; k : index of the obstacle within this kind
    passed : index of the obstacle of this kind that the rock met last and has passed; below 0 for none
    until : s, later meetings do not count
    """


@kernel
def first_in_cells(
    obstacles: Any, arc: Arc, passed: int, until: float, instant: float, rock: RockContext
) -> Meeting:  # fmt: skip
    """Return the first obstacle of one kind that a rock on an arc meets up to the time `until` (s), or NO_MEETING.

    `Meeting.number` is the index of the obstacle within this kind. Meetings within `instant` (s) count as simultaneous;
    of these, the meeting with the smallest index is returned.

    obstacles : all obstacles of the kind, such as `Forest`; the field `cells` has the grid in which they are sorted
    passed : index of the obstacle of this kind that the rock met last; below 0 for none
    """
    cells, best = obstacles.cells, NO_MEETING
    if not _comes_near(cells, arc, until):
        return best
    i, j = index_of(arc.x[0], cells.x, cells.cell, cells.nx), index_of(arc.x[1], cells.y, cells.cell, cells.ny)
    while True:
        leave_i = leaves_at(i, cells.nx, cells.x, cells.cell, arc.x[0], arc.v[0])
        leave_j = leaves_at(j, cells.ny, cells.y, cells.cell, arc.x[1], arc.v[1])
        leave = min(leave_i, leave_j)
        place = j * cells.nx + i
        for entry in range(cells.starts[place], cells.starts[place + 1]):
            k = cells.ids[entry]
            t = time_to(obstacles, k, arc, passed, until, rock)
            if t < best.t - instant or (t <= best.t + instant and t < math.inf and k < best.number):
                best = Meeting(t, k)
        if leave >= until or best.t < leave:
            return best
        if leave_i <= leave_j:
            i += 1 if arc.v[0] > 0.0 else -1
        else:
            j += 1 if arc.v[1] > 0.0 else -1


@kernel
def _comes_near(cells: ObstacleCells, arc: Arc, until: float) -> bool:
    """Return True if an arc may meet an obstacle: the arc's box in plan up to `until` (s) touches the grid of cells."""
    if cells.nx == 0:
        return False
    end_x, end_y = arc.x[0] + arc.v[0] * until, arc.x[1] + arc.v[1] * until
    beside = max(arc.x[0], end_x) < cells.x or min(arc.x[0], end_x) > cells.x + cells.nx * cells.cell
    return not (beside or max(arc.x[1], end_y) < cells.y or min(arc.x[1], end_y) > cells.y + cells.ny * cells.cell)


@kernel
def index_of(value: float, origin: float, cell: float, count: int) -> int:
    """Return the row or column of the cell that contains a coordinate (m); outside the grid, of the nearest cell.

    origin : coordinate of the grid's corner (m); cell : side of a cell (m); count : number of rows or columns
    """
    return min(max(math.floor((value - origin) / cell), 0), count - 1)


@kernel
def leaves_at(index: int, count: int, origin: float, cell: float, x: float, v: float) -> float:
    """Return the time (s) at which an arc leaves row or column number `index` of a grid; inf if never.

    The outermost rows and columns extend without end.

    origin, cell, count : as in `index_of`
    x, v : at the start of the arc, the coordinate (m) and the velocity (m/s) along the axis that `index` counts
    """
    if abs(v) <= SLOWEST or index == (count - 1 if v > 0.0 else 0):
        return math.inf
    return (origin + (index + 1 if v > 0.0 else index) * cell - x) / v
