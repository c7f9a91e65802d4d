"""Slabs: for each cell a plane that all its facets lie below, for cells of several sizes.

A slab is a plane of unit normal n, n_z >= 0, at the largest height h of the cell's facets along n, measured from the
origin: n . p <= h for all points p of the facets. Along an arc n . x is concave, because gravity only bends the arc
downwards. So an arc above the slab at both ends of a stretch is above the slab in between, and meets no facet of the
cell there. A slab leans with the ground, so an arc that follows a steep face stays above most slabs.

Cells of level 0 are the buckets. A cell of each higher level covers 4 by 4 cells of the level below. Where no ground
is near, a flight crosses one large cell instead of many small cells.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.detection.bucket_grid import Grid, bands, span_of
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.jit.memory import Memory, Share, fresh, one_by_one
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot

SHIFT = 2
"""A cell is 2^SHIFT cells of the level below wide."""
LEVELS = 4
"""Number of cell sizes: the widest cells are 64 buckets wide."""


class Slabs(NamedTuple):
    """Slabs of all cells of all levels.

    planes : (4 C,) n_x, n_y, n_z (-), h (m, -inf for a cell without facets), cells row by row, level by level
    first : (LEVELS,) row of the first cell of each level
    """

    planes: Any
    first: Any


def slabs_of(facets: Facets, grid: Grid, memory: Memory = fresh, share: Share = one_by_one) -> Slabs:
    """Return the slabs over the facets in the buckets of a grid."""
    sizes = [width_of(grid.nx, level) * width_of(grid.ny, level) for level in range(LEVELS)]
    first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    planes = memory("planes", 4 * int(first[-1]), np.float64).reshape(-1, 4)
    slack = REACH * facets.tolerance

    def over(begin: int, end: int) -> None:
        _clear(grid.nx, grid.ny, begin, end, planes, first)
        _sum_normals(facets.corners, facets.normals, slack, *grid, begin, end, planes)
        _lean(grid.nx, 0, grid.nx, begin, end, planes, first)
        _raise_over_facets(facets.corners, slack, *grid, begin, end, planes, first)

    share([lambda a=a, b=b: over(a, b) for a, b in bands(grid.ny)])  # type: ignore[misc]
    return Slabs(planes.reshape(-1), first[:-1])


@kernel
def width_of(count: int, level: int) -> int:
    """Return the number of cells of a level along a side of `count` buckets."""
    return ((count - 1) >> (SHIFT * level)) + 1


@kernel
def slab_row(first: Any, nx: int, level: int, i: int, j: int) -> int:
    """Return the row of the slab of a level's cell in column i and row j of that level, over nx columns of buckets."""
    row: int = first[level] + j * width_of(nx, level) + i
    return row


@loop
def _clear(nx: int, ny: int, begin: int, end: int, planes: Any, first: Any) -> None:
    """Reset the slabs of all levels over the rows of buckets from `begin` to `end`: no sum of normals and no height."""
    clear_block(nx, 0, nx, begin, end, planes, first)


@kernel
def clear_block(nx: int, left: int, right: int, begin: int, end: int, planes: Any, first: Any) -> None:
    """Reset the slabs of all levels over a block of buckets: no sum of normals and no height.

    The block has the columns from `left` to `right` - 1 and the rows from `begin` to `end` - 1.
    """
    for level in range(LEVELS):
        shift = SHIFT * level
        for j in range(begin >> shift, ((end - 1) >> shift) + 1):
            for i in range(left >> shift, ((right - 1) >> shift) + 1):
                row = slab_row(first, nx, level, i, j)
                planes[row, 0], planes[row, 1], planes[row, 2], planes[row, 3] = 0.0, 0.0, 0.0, -math.inf


@loop
def _sum_normals(
    corners: Any, normals: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, begin: int, end: int,
    planes: Any,
) -> None:  # fmt: skip
    """Add up the normals of the facets in each bucket of the rows from `begin` to `end`.

    The loop goes facet by facet, so that it reads memory in order.
    """
    for f in range(corners.shape[0]):
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        j0, j1 = max(j0, begin), min(j1, end - 1)
        if j0 > j1:
            continue
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                add_normal(normals, f, planes, j * nx + i)


@kernel
def add_normal(normals: Any, f: int, planes: Any, row: int) -> None:
    """Add the normal of facet f to the sum of one bucket."""
    for axis in range(3):
        planes[row, axis] += normals[f, axis]


@loop
def _lean(nx: int, left: int, right: int, begin: int, end: int, planes: Any, first: Any) -> None:
    """Turn the sums of normals over a block of buckets into unit normals of slabs, at all levels."""
    lean_upwards(nx, left, right, begin, end, planes, first)


@kernel
def lean_upwards(nx: int, left: int, right: int, begin: int, end: int, planes: Any, first: Any) -> None:
    """Add up the sums of a block's buckets over the levels, and scale all sums to length 1.

    Where the normals cancel out, or their sum points downwards, the slab is level.
    """
    for j in range(begin, end):
        for i in range(left, right):
            for level in range(1, LEVELS):
                row = slab_row(first, nx, level, i >> (SHIFT * level), j >> (SHIFT * level))
                for axis in range(3):
                    planes[row, axis] += planes[j * nx + i, axis]
    for level in range(LEVELS):
        shift = SHIFT * level
        for j in range(begin >> shift, ((end - 1) >> shift) + 1):
            for i in range(left >> shift, ((right - 1) >> shift) + 1):
                _lean_one(planes, slab_row(first, nx, level, i, j))


@kernel
def _lean_one(planes: Any, row: int) -> None:
    """Scale the normal of one slab to length 1; make it vertical if it is too short or points downwards."""
    x, y, z = planes[row, 0], planes[row, 1], planes[row, 2]
    length = math.sqrt(x * x + y * y + z * z)
    if z >= 0.0 and length > 0.5:
        planes[row, 0], planes[row, 1], planes[row, 2] = x / length, y / length, z / length
    else:
        planes[row, 0], planes[row, 1], planes[row, 2] = 0.0, 0.0, 1.0


@loop
def _raise_over_facets(
    corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, begin: int, end: int,
    planes: Any, first: Any,
) -> None:  # fmt: skip
    """Raise the slabs of all levels, over rows of buckets from `begin` to `end`, above the corners of their facets."""
    for f in range(corners.shape[0]):
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        j0, j1 = max(j0, begin), min(j1, end - 1)
        if j0 > j1:
            continue
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        for level in range(LEVELS):
            shift = SHIFT * level
            for j in range(j0 >> shift, (j1 >> shift) + 1):
                for i in range(i0 >> shift, (i1 >> shift) + 1):
                    raise_over(corners, f, planes, slab_row(first, nx, level, i, j))


@kernel
def raise_over(corners: Any, f: int, planes: Any, row: int) -> None:
    """Raise one slab above the corners of facet f."""
    x, y, z, high = planes[row, 0], planes[row, 1], planes[row, 2], planes[row, 3]
    for c in range(3):
        high = max(high, x * corners[f, 3 * c] + y * corners[f, 3 * c + 1] + z * corners[f, 3 * c + 2])
    planes[row, 3] = high


@kernel
def flies_over(slabs: Slabs, level: int, k: int, p: Vec, q: Vec, slack: float) -> bool:
    """True if an arc from p to q (m) stays above the slab of a level's cell k by more than the slack (m).

    The slack covers rounding of both heights and of the borders of cells.
    """
    at = np.uintp(4 * (slabs.first[level] + k))  # unsigned: never an index from the end of the array
    n = slabs.planes[at], slabs.planes[at + np.uintp(1)], slabs.planes[at + np.uintp(2)]
    return bool(min(dot(n, p), dot(n, q)) > slabs.planes[at + np.uintp(3)] + slack)
