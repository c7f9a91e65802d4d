"""Sort facets into the square cells of a grid in plan, so that a search tests only the facets near a rock.

This is the search structure of the compiled engine.

A bucket is the list of the facets over one cell of the grid. An entry is one facet in one bucket.
"""

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
"""Largest number of buckets per facet (-). A terrain that fills its bounding box has one bucket for two facets."""
FEWEST_BUCKETS = 64
"""Number of buckets that a grid may always have, even for very few facets."""
ENTRIES_PER_FACET = 16
"""Largest mean number of buckets that a facet is in; 4 is usual. A wide facet over narrow cells is in many buckets."""
SAMPLE = 100_000
"""Least number of facets in the sample from which the cell size and the extent of the grid are estimated."""
FAR = 0.005
"""Share of the facets (-) that may lie outside the box of most facets, on each side of this box."""
COARSER = 1.4
"""Least factor (-) by which the cells are made wider, each time that there are too many cells or entries."""
BAND = 64
"""Width, in buckets, of the widest cells with a slab (`slabs.py`); bands of rows begin at multiples of this width."""
MARGIN = 0.1
"""Distance by which the grid extends beyond the box of most facets, divided by the width of that box (-)."""


class Grid(NamedTuple):
    """A grid in plan of nx by ny square cells with side `cell` (m); x, y (m) is its south-west corner."""

    x: float
    y: float
    cell: float
    nx: int
    ny: int


class CellRectangle(NamedTuple):
    """A rectangle of cells of a grid: columns `left` to `right` - 1, rows `bottom` to `top` - 1."""

    left: int
    right: int
    bottom: int
    top: int


class Buckets(NamedTuple):
    """For each cell of a grid, the facets that a search must test there: for cell k, ids[starts[k] : starts[k + 1]].

    Cell k is in column i and row j of the grid, with k = j nx + i. The buckets have E entries in total.

    starts : (nx ny + 1,); ids : (E,) numbers of facets, in ascending order within a bucket until a patch is applied
    boxes : (E,) uint32, the box in plan of each facet within the cell (`plan_boxes.packed_box`)
    """

    starts: NDArray[np.int64]
    ids: NDArray[np.int32]
    boxes: NDArray[np.uint32]


def sorted_into_buckets(facets: Facets, memory: Memory = fresh, share: Share = one_by_one) -> tuple[Grid, Buckets]:
    """Return a grid over F facets and its buckets: the bucket of a cell lists all facets whose boxes touch the cell.

    A box is the bounding box of a facet in plan, widened by REACH tolerances. The outermost cells of the grid extend
    outwards without limit.

    memory : allocates the arrays; share : runs the work in parallel; neither changes the content of the arrays
    """
    grid, starts = _counted(facets, memory, share)
    np.cumsum(starts, out=starts)
    ids, boxes = memory("ids", int(starts[-1]), np.int32), memory("boxes", int(starts[-1]), np.uint32)
    cursor = memory("cursor", len(starts), np.int64)
    cursor[:] = starts
    slack = REACH * facets.tolerance
    share([lambda band=band: _fill(facets.corners, slack, grid, band, cursor, ids, boxes) for band in bands(grid)])  # type: ignore[misc]
    return grid, Buckets(starts=starts, ids=ids, boxes=boxes)


def bands(grid: Grid) -> list[CellRectangle]:
    """Return the rows of a grid in one or two bands that two threads can process without writing to the same cell."""
    middle = (grid.ny // 2 + BAND // 2) // BAND * BAND
    rows = [(0, middle), (middle, grid.ny)] if 0 < middle < grid.ny else [(0, grid.ny)]
    return [CellRectangle(left=0, right=grid.nx, bottom=bottom, top=top) for bottom, top in rows]


def _counted(facets: Facets, memory: Memory, share: Share) -> tuple[Grid, NDArray[np.int64]]:
    """Return the grid for a terrain, and an array (cells + 1,) with the number of facets in bucket k at index k + 1.

    The side of a cell is the median width of the facets. The grid covers the whole terrain. If it would then have too
    many cells, the grid covers most facets only, and the outermost buckets contain the few distant facets. Cells become
    wider if there are still too many cells, or if the facets have too many entries.

    memory : allocates the array; share : runs the work in parallel
    """
    low, high = _plan_boxes(facets)
    cell = max(float(np.median((high - low).max(axis=1))), 8.0 * REACH * facets.tolerance) or 1.0
    most = max(BUCKETS_PER_FACET * len(facets.zone), FEWEST_BUCKETS)
    # Facets of a raster may end at a line between cells; the slack keeps these facets out of the cells beyond the line.
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
    """Write the number of facets in each bucket k into starts[k + 1]; return False if their sum is too large.

    The sum, which is the number of entries of all buckets, may be at most ENTRIES_PER_FACET times the number of facets.

    starts : (cells + 1,), all 0 before the call; share : runs the work in parallel
    """
    slack, most = REACH * facets.tolerance, ENTRIES_PER_FACET * len(facets.zone)
    counts = share([lambda band=band: _count(facets.corners, slack, grid, band, most, starts) for band in bands(grid)])  # type: ignore[misc]
    return sum(counts) <= most


def _plan_boxes(facets: Facets) -> tuple[FloatArray, FloatArray]:
    """Return the boxes in plan of every n-th facet, S facets in all: their low and high corners (S, 2) m.

    The cell size of the grid follows from these boxes.
    """
    step = max(len(facets.zone) // SAMPLE, 1)
    plan = np.asarray(facets.corners)[::step].reshape(-1, 3, 3)[..., :2]
    return plan.min(axis=1), plan.max(axis=1)


def _cells(low: FloatArray, high: FloatArray, cell: float) -> Grid:
    """Return the grid of cells with side `cell` (m) that covers a box in plan.

    low, high : (2,) m, corners of the box
    """
    nx, ny = (int(width / cell) + 1 for width in (high - low).tolist())
    return Grid(x=float(low[0]), y=float(low[1]), cell=cell, nx=nx, ny=ny)


def _buckets(grid: Grid) -> int:
    """Return the number of buckets of a grid: one for each cell."""
    return grid.nx * grid.ny


@kernel
def cell_index(value: float, origin: float, cell: float, count: int) -> int:
    """Return the number of the cell that contains a coordinate (m) along one axis; outside the grid, the nearest cell.

    value : m, the coordinate
    origin, cell, count : of the grid along this axis: its start (m), the side of a cell (m) and the number of cells
    """
    return min(max(math.floor((value - origin) / cell), 0), count - 1)


@kernel
def cells_under(corners: Any, f: int, slack: float, grid: Grid) -> CellRectangle:
    """Return the cells that the box of facet f touches in plan; the facet lies over no other cell.

    corners : (F, 9) m (3 corners each), of all facets; slack : m, by which the box is widened on all sides
    """
    low_x, high_x = min(corners[f, 0], corners[f, 3], corners[f, 6]), max(corners[f, 0], corners[f, 3], corners[f, 6])
    low_y, high_y = min(corners[f, 1], corners[f, 4], corners[f, 7]), max(corners[f, 1], corners[f, 4], corners[f, 7])
    return cells_between(grid, low_x - slack, low_y - slack, high_x + slack, high_y + slack)


@kernel
def cells_between(grid: Grid, low_x: float, low_y: float, high_x: float, high_y: float) -> CellRectangle:
    """Return the cells that a box in plan (m) touches; at least one cell, as the outermost cells extend without limit.

    low_x, low_y, high_x, high_y : m, the sides of the box
    """
    return CellRectangle(
        left=cell_index(low_x, grid.x, grid.cell, grid.nx),
        right=cell_index(high_x, grid.x, grid.cell, grid.nx) + 1,
        bottom=cell_index(low_y, grid.y, grid.cell, grid.ny),
        top=cell_index(high_y, grid.y, grid.cell, grid.ny) + 1,
    )


@kernel
def common(a: CellRectangle, b: CellRectangle) -> CellRectangle:
    """Return the cells that two rectangles of cells have in common, to limit work to a band or a patch.

    If they have no cell in common, the result has no rows or no columns (top <= bottom or right <= left).
    """
    return CellRectangle(
        left=max(a.left, b.left), right=min(a.right, b.right), bottom=max(a.bottom, b.bottom), top=min(a.top, b.top)
    )


@loop
def _count(corners: Any, slack: float, grid: Grid, band: CellRectangle, most: int, starts: Any) -> int:
    """Add the number of facets in each bucket k of a band of rows to starts[k + 1]; return the sum of these numbers.

    The function stops as soon as the sum exceeds `most`.

    corners : (F, 9) m (3 corners each); slack : m by which each facet is widened; band : the rows, from `bands`
    most : largest allowed sum; starts : (cells + 1,), changed
    """
    entries = 0
    for f in range(corners.shape[0]):
        cells = common(cells_under(corners, f, slack, grid), band)
        if cells.bottom >= cells.top:
            continue
        entries += (cells.right - cells.left) * (cells.top - cells.bottom)
        if entries > most:
            return entries
        for j in range(cells.bottom, cells.top):
            for i in range(cells.left, cells.right):
                starts[j * grid.nx + i + 1] += 1
    return entries


@loop
def _fill(corners: Any, slack: float, grid: Grid, band: CellRectangle, cursor: Any, ids: Any, boxes: Any) -> None:
    """Write the facets in each bucket of a band of rows, in ascending order.

    cursor : (cells + 1,) for each bucket, the index in `ids` of its next entry; changed
    corners : (F, 9) m (3 corners each); slack : m by which each facet is widened; band : the rows, from `bands`
    ids, boxes : (E,) receive number and `box_over` of the facet of each entry, as in `Buckets`
    """
    for f in range(corners.shape[0]):
        cells = common(cells_under(corners, f, slack, grid), band)
        for j in range(cells.bottom, cells.top):
            for i in range(cells.left, cells.right):
                k = j * grid.nx + i
                ids[cursor[k]] = f
                boxes[cursor[k]] = box_over(corners, f, slack, grid, i, j)
                cursor[k] += 1


@kernel
def box_over(corners: Any, f: int, slack: float, grid: Grid, i: int, j: int) -> int:
    """Return the box in plan of facet f within one cell, packed into one integer (`plan_boxes.packed_box`).

    i, j : column and row of the cell; slack : m by which the facet is widened
    corners : (F, 9) m (3 corners each), of all facets
    """
    per_cell = 1.0 / grid.cell
    return packed_box(
        part_of(min(corners[f, 0], corners[f, 3], corners[f, 6]) - slack, grid.x, per_cell, i),
        part_of(max(corners[f, 0], corners[f, 3], corners[f, 6]) + slack, grid.x, per_cell, i),
        part_of(min(corners[f, 1], corners[f, 4], corners[f, 7]) - slack, grid.y, per_cell, j),
        part_of(max(corners[f, 1], corners[f, 4], corners[f, 7]) + slack, grid.y, per_cell, j),
    )
