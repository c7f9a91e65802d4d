"""Facets sorted into the square cells of a grid over the plan: the buckets of the compiled engine's locator."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.plan_boxes import packed_box, part_of
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.jit.memory import Memory, Share, fresh, one_by_one
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
BAND = 64
"""Rows of buckets that the widest cells of the slabs over them span."""
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

    starts : (nx ny + 1,); ids : (E,) facets; in order of number within a bucket, until a patch comes
    boxes : (E,) uint32, the part of the cell that each facet may lie over (`packed_box`)
    """

    starts: NDArray[np.int64]
    ids: NDArray[np.int32]
    boxes: NDArray[np.uint32]


def sorted_into_buckets(facets: Facets, memory: Memory = fresh, share: Share = one_by_one) -> tuple[Grid, Buckets]:
    """Sort F facets into buckets; a facet stands in every bucket that its box in plan touches.

    The boxes are widened by REACH tolerances. Cells at the rim reach outwards without end. Where the arrays come from,
    and who does the work, changes nothing in them.
    """
    grid, starts = _counted(facets, memory, share)
    np.cumsum(starts, out=starts)
    ids, boxes = memory("ids", int(starts[-1]), np.int32), memory("boxes", int(starts[-1]), np.uint32)
    cursor = memory("cursor", len(starts), np.int64)
    cursor[:] = starts
    slack = REACH * facets.tolerance
    share([lambda a=a, b=b: _fill(facets.corners, slack, *grid, a, b, cursor, ids, boxes) for a, b in bands(grid.ny)])  # type: ignore[misc]
    return grid, Buckets(starts, ids, boxes)


def bands(rows: int) -> list[tuple[int, int]]:
    """The rows of cells in two bands that share no cell of any size: first row, and the one after the last."""
    middle = (rows // 2 + BAND // 2) // BAND * BAND
    return [(a, b) for a, b in ((0, middle), (middle, rows)) if a < b] if middle < rows else [(0, rows)]


def _counted(facets: Facets, memory: Memory, share: Share) -> tuple[Grid, NDArray[np.int64]]:
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
            starts = memory("starts", _buckets(grid) + 1, np.int64)
            starts[:] = 0
            if _count_all(facets, grid, starts, share):
                return grid, starts
        cell *= max(math.sqrt(_buckets(grid) / most), COARSER)


def _count_all(facets: Facets, grid: Grid, starts: NDArray[np.int64], share: Share) -> bool:
    """Count the entries of bucket k into starts[k + 1]; False if all together are too many."""
    slack, most = REACH * facets.tolerance, ENTRIES_PER_FACET * len(facets.zone)
    rows = bands(grid.ny)
    counts = share([lambda a=a, b=b: _count(facets.corners, slack, *grid, a, b, most, starts) for a, b in rows])  # type: ignore[misc]
    return sum(counts) <= most


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
    corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, first: int, end: int, most: int,
    starts: Any,
) -> int:  # fmt: skip
    """Count the entries of bucket k into starts[k + 1], in rows of cells from `first` to `end`; return their number.

    No further than where they are more than most.
    """
    entries = 0
    for f in range(corners.shape[0]):
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        j0, j1 = max(j0, first), min(j1, end - 1)
        if j0 > j1:
            continue
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        entries += (i1 - i0 + 1) * (j1 - j0 + 1)
        if entries > most:
            return entries
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                starts[j * nx + i + 1] += 1
    return entries


@loop
def _fill(
    corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, first: int, end: int,
    cursor: Any, ids: Any, boxes: Any,
) -> None:  # fmt: skip
    """Write the entries of rows of cells from `first` to `end`, in order of facet."""
    for f in range(corners.shape[0]):
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        j0, j1 = max(j0, first), min(j1, end - 1)
        if j0 > j1:
            continue
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                k = j * nx + i
                ids[cursor[k]] = f
                boxes[cursor[k]] = box_over(corners, f, slack, x, y, 1.0 / cell, i, j)
                cursor[k] += 1


@kernel
def box_over(corners: Any, f: int, slack: float, x: float, y: float, per_cell: float, i: int, j: int) -> int:
    """The packed box of facet f, widened by the slack (m), over the cell in column i and row j."""
    return packed_box(
        part_of(min(corners[f, 0], corners[f, 3], corners[f, 6]) - slack, x, per_cell, i),
        part_of(max(corners[f, 0], corners[f, 3], corners[f, 6]) + slack, x, per_cell, i),
        part_of(min(corners[f, 1], corners[f, 4], corners[f, 7]) - slack, y, per_cell, j),
        part_of(max(corners[f, 1], corners[f, 4], corners[f, 7]) + slack, y, per_cell, j),
    )
