"""Slabs: planes above all facets of a cell; a search for contacts skips each cell whose slab the arc stays above.

A slab is a plane with unit normal n, n_z >= 0, at the largest height h of the cell's facets along n, measured from the
origin: n . p <= h for all points p of the facets. Along an arc n . x is concave, because gravity only bends the arc
downwards. So an arc above the slab at both ends of a stretch is above the slab in between, and meets no facet of the
cell there. A slab is inclined like the ground, so an arc along a steep bench face stays above most slabs.

The cell sizes are numbered as levels. Cells of level 0 are the buckets. A cell of a higher level covers 4 by 4 cells of
the next lower level. Where no ground is near, the search for contacts skips one large cell instead of many small cells.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.detection.bucket_grid import CellRectangle, Grid, bands, cells_under, common
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.jit.memory import Memory, Share, fresh, one_by_one
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot

SHIFT = 2
"""Cells become wider by a factor of 2^SHIFT from one level (cell size) to the next."""
LEVELS = 4
"""Number of cell sizes: the widest cells are 64 buckets wide."""


class Slabs(NamedTuple):
    """The slabs of all C cells of a grid, for all cell sizes (levels).

    planes : (4 C,) for each cell n_x, n_y, n_z (-) and h (m, -inf for a cell without facets); cells row by row, one
        level after another
    first : (LEVELS,) number of the first cell of each level
    """

    planes: Any
    first: Any


class SlabTable(NamedTuple):
    """The slabs of all C cells of a grid as rows of a table, while they are computed.

    planes : (C, 4), for each cell n_x, n_y, n_z (-) and h (m); first : (LEVELS,) number of the first cell of each level
    columns : number of columns of buckets
    """

    planes: Any
    first: Any
    columns: int


def slabs_of(facets: Facets, grid: Grid, memory: Memory = fresh, share: Share = one_by_one) -> Slabs:
    """Return the slabs of all cells of a grid, at all levels (cell sizes).

    memory : allocates the array of the planes; share : runs the work in parallel
    """
    sizes = [width_of(grid.nx, level) * width_of(grid.ny, level) for level in range(LEVELS)]
    first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    slabs = Slabs(memory("planes", 4 * int(first[-1]), np.float64), first[:-1])
    table, slack = slab_table(slabs, grid.nx), REACH * facets.tolerance

    def over(band: CellRectangle) -> None:
        _clear(table, band)
        _sum_normals(facets.corners, facets.normals, slack, grid, band, table.planes)
        _lean(table, band)
        _raise_over_facets(facets.corners, slack, grid, band, table)

    share([lambda band=band: over(band) for band in bands(grid)])  # type: ignore[misc]
    return slabs


def slab_table(slabs: Slabs, columns: int) -> SlabTable:
    """Return the slabs as a table with a row per cell, in the same memory, to compute or update them.

    columns : number of columns of buckets
    """
    return SlabTable(planes=slabs.planes.reshape(-1, 4), first=slabs.first, columns=columns)


@kernel
def width_of(count: int, level: int) -> int:
    """Return how many cells of a level (cell size) are needed along a side of the grid that is `count` buckets long."""
    return ((count - 1) >> (SHIFT * level)) + 1


@kernel
def slab_row(table: SlabTable, level: int, i: int, j: int) -> int:
    """Return the table row of the slab for the cell in column i and row j of a level (cell size)."""
    row: int = table.first[level] + j * width_of(table.columns, level) + i
    return row


@kernel
def cells_of(block: CellRectangle, level: int) -> CellRectangle:
    """Return the cells of a level (cell size) that a rectangle of buckets touches."""
    shift = SHIFT * level
    return CellRectangle(
        left=block.left >> shift, right=((block.right - 1) >> shift) + 1,
        bottom=block.bottom >> shift, top=((block.top - 1) >> shift) + 1,
    )  # fmt: skip


@loop
def _clear(table: SlabTable, block: CellRectangle) -> None:
    """Set the slabs over a rectangle of buckets to the initial values, as `clear_block` does, in a compiled loop."""
    clear_block(table, block)


@kernel
def clear_block(table: SlabTable, block: CellRectangle) -> None:
    """Set the slabs over a rectangle of buckets to the initial values, at all levels (cell sizes).

    The initial values are a normal of zero and a height of -inf.

    table : the slabs, changed; block : the rectangle
    """
    planes = table.planes
    for level in range(LEVELS):
        cells = cells_of(block, level)
        for j in range(cells.bottom, cells.top):
            for i in range(cells.left, cells.right):
                row = slab_row(table, level, i, j)
                planes[row, 0], planes[row, 1], planes[row, 2], planes[row, 3] = 0.0, 0.0, 0.0, -math.inf


@loop
def _sum_normals(corners: Any, normals: Any, slack: float, grid: Grid, band: CellRectangle, planes: Any) -> None:
    """Add up the normals of the facets in each bucket of a band of rows; the sum gives the direction of the slab.

    The loop runs over facets and not over buckets, to read memory in order.

    corners, normals : (F, 9) m (3 corners each) and (F, 3), of all facets; slack : m by which each facet is widened
    band : the rows, from `bands`; planes : (C, 4) as in `SlabTable`, changed
    """
    for f in range(corners.shape[0]):
        cells = common(cells_under(corners, f, slack, grid), band)
        for j in range(cells.bottom, cells.top):
            for i in range(cells.left, cells.right):
                add_normal(normals, f, planes, j * grid.nx + i)


@kernel
def add_normal(normals: Any, f: int, planes: Any, row: int) -> None:
    """Add the unit normal of facet f to the sum of normals of one bucket.

    This sum, scaled to length 1, becomes the normal of the bucket's slab (`lean_upwards`).

    normals : (F, 3), of all facets; row : row of the bucket in `planes`
    planes : (C, 4), one row for each bucket, changed: columns 0 to 2 hold the sums
    """
    for axis in range(3):
        planes[row, axis] += normals[f, axis]


@loop
def _lean(table: SlabTable, block: CellRectangle) -> None:
    """Compute the unit normals of the slabs over a rectangle of buckets, as `lean_upwards` does, in a compiled loop."""
    lean_upwards(table, block)


@kernel
def lean_upwards(table: SlabTable, block: CellRectangle) -> None:
    """Compute the unit normals of the slabs over a rectangle of buckets, at all levels (cell sizes).

    Before the call, the slab of each bucket has the sum of the normals of its facets (`add_normal`). The sum of a wider
    cell is the sum of its buckets. Where the normals cancel out, or their sum points downwards, the slab is horizontal.

    table : the slabs, changed; block : the rectangle, of whole cells of each level
    """
    planes = table.planes
    for j in range(block.bottom, block.top):
        for i in range(block.left, block.right):
            for level in range(1, LEVELS):
                row = slab_row(table, level, i >> (SHIFT * level), j >> (SHIFT * level))
                for axis in range(3):
                    planes[row, axis] += planes[j * table.columns + i, axis]
    for level in range(LEVELS):
        cells = cells_of(block, level)
        for j in range(cells.bottom, cells.top):
            for i in range(cells.left, cells.right):
                _lean_one(planes, slab_row(table, level, i, j))


@kernel
def _lean_one(planes: Any, row: int) -> None:
    """Scale the normal of one slab to length 1; make the normal vertical if it is too short or points downwards.

    planes : (C, 4) as in `SlabTable`; row : of the slab in `planes`
    """
    x, y, z = planes[row, 0], planes[row, 1], planes[row, 2]
    length = math.sqrt(x * x + y * y + z * z)
    if z >= 0.0 and length > 0.5:
        planes[row, 0], planes[row, 1], planes[row, 2] = x / length, y / length, z / length
    else:
        planes[row, 0], planes[row, 1], planes[row, 2] = 0.0, 0.0, 1.0


@loop
def _raise_over_facets(corners: Any, slack: float, grid: Grid, band: CellRectangle, table: SlabTable) -> None:
    """Raise the slabs over a band of rows of buckets, at all levels, so that every facet lies below its slabs.

    corners : (F, 9) m (3 corners each), of all facets; slack : m, by which each facet is widened
    table : the slabs, changed
    """
    for f in range(corners.shape[0]):
        under = common(cells_under(corners, f, slack, grid), band)
        if under.bottom >= under.top:
            continue
        for level in range(LEVELS):
            cells = cells_of(under, level)
            for j in range(cells.bottom, cells.top):
                for i in range(cells.left, cells.right):
                    raise_over(corners, f, table.planes, slab_row(table, level, i, j))


@kernel
def raise_over(corners: Any, f: int, planes: Any, row: int) -> None:
    """Raise one slab so that facet f lies below it: none of the facet's corners is above the slab.

    planes : (C, 4), as in `SlabTable`; row : row of the slab
    """
    x, y, z, high = planes[row, 0], planes[row, 1], planes[row, 2], planes[row, 3]
    for c in range(3):
        high = max(high, x * corners[f, 3 * c] + y * corners[f, 3 * c + 1] + z * corners[f, 3 * c + 2])
    planes[row, 3] = high


@kernel
def flies_over(slabs: Slabs, level: int, k: int, p: Vec, q: Vec, slack: float) -> bool:
    """Return True if an arc from p to q (m) stays above the slab of a cell by more than the slack (m).

    The arc then meets no facet of the cell.

    level : cell size; k : number of the cell within its level

    The slack covers the rounding of both heights and of the borders of cells.
    """
    at = np.uintp(4 * (slabs.first[level] + k))  # unsigned: never an index from the end of the array
    n = slabs.planes[at], slabs.planes[at + np.uintp(1)], slabs.planes[at + np.uintp(2)]
    return bool(min(dot(n, p), dot(n, q)) > slabs.planes[at + np.uintp(3)] + slack)
