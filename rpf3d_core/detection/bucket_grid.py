"""Facets sorted into the square cells of a grid over the plan: the buckets of the compiled engine's locator."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.compiling import kernel, loop
from rpf3d_core.detection.plan_boxes import packed_box, part_of
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.terrain.frame import FloatArray

BUCKETS_PER_FACET = 2.0
"""Buckets at most, over facets; a terrain that fills its box has about one bucket for two facets."""
FEWEST_BUCKETS = 64
"""What even a few facets may have."""
ENTRIES_PER_FACET = 16
"""Mean number of buckets that a facet may stand in: 4 is usual, a few wide facets over narrow cells stand in many."""
SAMPLE = 100_000
"""Facets at least from which their usual size, and the box of most of them, are told."""
FAR = 0.005
"""Share of the facets that the box of most of them leaves out on each side."""
COARSER = 1.4
"""By how much cells grow, at least, where there are too many (-)."""
MARGIN = 0.1
"""How far the grid reaches beyond that box, over its width (-)."""


class Grid(NamedTuple):
    """Cells of a side `cell` (m), nx by ny of them, from the corner x, y (m)."""

    x: float
    y: float
    cell: float
    nx: int
    ny: int


class Buckets(NamedTuple):
    """Entries of the facets in each cell of a grid: those of cell k are ids[starts[k] : starts[k + 1]].

    starts : (nx ny + 1,); ids : (E,) facets, in order of number within a bucket
    boxes : (E,) uint32, the part of the cell that each facet may lie over (`packed_box`)
    """

    starts: NDArray[np.int64]
    ids: NDArray[np.int32]
    boxes: NDArray[np.uint32]


def sorted_into_buckets(facets: Facets) -> tuple[Grid, Buckets]:
    """Sort F facets into buckets; a facet stands in every bucket that its box in plan touches.

    The boxes are widened by REACH tolerances. Cells at the rim reach outwards without end.
    """
    grid, starts = _counted(facets)
    np.cumsum(starts, out=starts)
    ids = np.empty(starts[-1], dtype=np.int32)
    boxes = np.empty(starts[-1], dtype=np.uint32)
    _fill(facets.corners, REACH * facets.tolerance, *grid, starts[:-1].copy(), ids, boxes)
    return grid, Buckets(starts, ids, boxes)


def _counted(facets: Facets) -> tuple[Grid, NDArray[np.int64]]:
    """The grid for some facets, and the number of entries of bucket k at k + 1.

    Cells are as wide as the median facet, over the whole terrain or, where that takes too many, over most facets: a
    stray piece far off then lies in the buckets at the rim, and the cells under the rest stay small. They are wider
    where there would still be too many, or where wide facets would stand in too many of them.
    """
    low, high = _plan_boxes(facets)
    cell = max(float(np.median((high - low).max(axis=1))), 8.0 * REACH * facets.tolerance) or 1.0
    most = max(BUCKETS_PER_FACET * len(facets.zone), FEWEST_BUCKETS)
    # The slack keeps facets that end at a line between cells, as those of a grid do, out of the cells beyond it.
    begin, end = np.array(facets.low[:2]) - 2.0 * REACH * facets.tolerance, np.array(facets.high[:2])
    if _buckets(_cells(begin, end, cell)) > most:
        first, last = np.quantile(low, FAR, axis=0), np.quantile(high, 1.0 - FAR, axis=0)
        margin = MARGIN * (last - first)
        begin, end = np.maximum(first - margin, begin), np.minimum(last + margin, end)
    while True:
        grid = _cells(begin, end, cell)
        if _buckets(grid) <= most:
            starts = np.zeros(_buckets(grid) + 1, dtype=np.int64)
            if _count(facets.corners, REACH * facets.tolerance, *grid, ENTRIES_PER_FACET * len(facets.zone), starts):
                return grid, starts
        cell *= max(math.sqrt(_buckets(grid) / most), COARSER)


def _plan_boxes(facets: Facets) -> tuple[FloatArray, FloatArray]:
    """Corners (S, 2), (S, 2) m of the boxes in plan of facets that are evenly spread over the file's order."""
    step = max(len(facets.zone) // SAMPLE, 1)
    plan = np.asarray(facets.corners)[::step].reshape(-1, 3, 3)[..., :2]
    return plan.min(axis=1), plan.max(axis=1)


def _cells(low: FloatArray, high: FloatArray, cell: float) -> Grid:
    """The grid of a cell size (m) over a box in plan."""
    nx, ny = (int(width / cell) + 1 for width in (high - low).tolist())
    return Grid(float(low[0]), float(low[1]), cell, nx, ny)


def _buckets(grid: Grid) -> int:
    return grid.nx * grid.ny


@kernel
def cell_index(value: float, origin: float, cell: float, count: int) -> int:
    """The cell that a coordinate lies in, clamped to the grid."""
    return min(max(math.floor((value - origin) / cell), 0), count - 1)


@kernel
def span_of(a: float, b: float, c: float, slack: float, origin: float, cell: float, count: int) -> tuple[int, int]:
    """First and last cell that three coordinates span, widened by the slack."""
    return (
        cell_index(min(a, b, c) - slack, origin, cell, count),
        cell_index(max(a, b, c) + slack, origin, cell, count),
    )


@loop
def _count(
    corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, most: int, starts: Any
) -> bool:
    """Count the entries of bucket k into starts[k + 1]; False, and no further, if all together are more than most."""
    entries = 0
    for f in range(corners.shape[0]):
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        entries += (i1 - i0 + 1) * (j1 - j0 + 1)
        if entries > most:
            return False
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                starts[j * nx + i + 1] += 1
    return True


@loop
def _fill(
    corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int,
    cursor: Any, ids: Any, boxes: Any,
) -> None:  # fmt: skip
    """Write the entries, in order of facet."""
    per_cell = 1.0 / cell
    for f in range(corners.shape[0]):
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        low_x = min(corners[f, 0], corners[f, 3], corners[f, 6]) - slack
        high_x = max(corners[f, 0], corners[f, 3], corners[f, 6]) + slack
        low_y = min(corners[f, 1], corners[f, 4], corners[f, 7]) - slack
        high_y = max(corners[f, 1], corners[f, 4], corners[f, 7]) + slack
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                k = j * nx + i
                entry = cursor[k]
                ids[entry] = f
                boxes[entry] = packed_box(
                    part_of(low_x, x, per_cell, i), part_of(high_x, x, per_cell, i),
                    part_of(low_y, y, per_cell, j), part_of(high_y, y, per_cell, j),
                )  # fmt: skip
                cursor[k] += 1
