"""What lies under the arc, cell by cell: planes that all facets of a cell lie below, for cells of several sizes.

A slab is a plane of unit normal n, n_z >= 0, and the largest height h of the cell's facets above it through the
origin: n . p <= h for all their points p. Along an arc n . x is concave, for gravity only ever bends it downwards; so
an arc that is above the slab at both ends of a stretch is above it in between, and meets no facet of the cell there.
A slab that leans with the ground leaves an arc that follows a steep face out of reach of most of it.

Level 0 are the buckets themselves; a cell of each level is 4 by 4 of those of the level below. Where nothing is near,
a flight crosses one large cell instead of many small ones.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.compiling import kernel, loop
from rpf3d_core.detection.bucket_grid import Grid, span_of
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot

SHIFT = 2
"""A coarse cell is 2^SHIFT cells of the level below wide."""
LEVELS = 4
"""Sizes of cells: the widest are 64 buckets wide."""


class Slabs(NamedTuple):
    """Slabs of all cells of all levels.

    planes : (4 C,) n_x, n_y, n_z (-), h (m, -inf for a cell without facets), cells row by row, level by level
    first : (LEVELS,) row of the first cell of each level
    """

    planes: Any
    first: Any


def slabs_of(facets: Facets, grid: Grid) -> Slabs:
    """The slabs over the facets that stand in the buckets of a grid."""
    sizes = [width_of(grid.nx, level) * width_of(grid.ny, level) for level in range(LEVELS)]
    first = np.concatenate([[0], np.cumsum(sizes)])
    planes = np.zeros((first[-1], 4))
    planes[:, 3] = -np.inf
    slabs = Slabs(planes.reshape(-1), first[:-1])
    slack = REACH * facets.tolerance
    _sum_normals(facets.corners, facets.normals, slack, *grid, planes)
    _sum_over_levels(grid.nx, grid.ny, planes, first)
    _lean_upwards(planes)
    _raise_over_facets(facets.corners, slack, *grid, planes, first)
    return slabs


@kernel
def width_of(count: int, level: int) -> int:
    """Cells of a level along a side of so many buckets."""
    return ((count - 1) >> (SHIFT * level)) + 1


@kernel
def slab_row(first: Any, nx: int, level: int, i: int, j: int) -> int:
    """Row of the slab of a level's cell in column i and row j of that level, over nx columns of buckets."""
    row: int = first[level] + j * width_of(nx, level) + i
    return row


@loop
def _sum_normals(
    corners: Any, normals: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, planes: Any
) -> None:
    """Add up the normals of the facets in each bucket. Facet by facet: what is looked at lies side by side then."""
    for f in range(corners.shape[0]):
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                for axis in range(3):
                    planes[j * nx + i, axis] += normals[f, axis]


@loop
def _sum_over_levels(nx: int, ny: int, planes: Any, first: Any) -> None:
    """Add up the sums of the buckets in each cell of the levels above them."""
    for j in range(ny):
        for i in range(nx):
            k = j * nx + i
            for level in range(1, LEVELS):
                row = slab_row(first, nx, level, i >> (SHIFT * level), j >> (SHIFT * level))
                for axis in range(3):
                    planes[row, axis] += planes[k, axis]


def _lean_upwards(planes: Any) -> None:
    """Scale sums of unit normals to length 1; where they cancel out, or point downwards, the slab is level."""
    length = np.sqrt((planes[:, :3] ** 2).sum(axis=1))
    level = (planes[:, 2] < 0.0) | ~(length > 0.5)
    planes[:, :3] /= np.where(level, 1.0, length)[:, None]
    planes[level, :3] = (0.0, 0.0, 1.0)


@loop
def _raise_over_facets(
    corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, planes: Any, first: Any
) -> None:
    """Raise the slab of each cell, at all levels, above the corners of its facets."""
    for f in range(corners.shape[0]):
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        for level in range(LEVELS):
            shift = SHIFT * level
            for j in range(j0 >> shift, (j1 >> shift) + 1):
                for i in range(i0 >> shift, (i1 >> shift) + 1):
                    _raise_over(corners, f, planes, slab_row(first, nx, level, i, j))


@kernel
def _raise_over(corners: Any, f: int, planes: Any, row: int) -> None:
    """Raise one slab above the corners of one facet."""
    x, y, z, high = planes[row, 0], planes[row, 1], planes[row, 2], planes[row, 3]
    for c in range(3):
        high = max(high, x * corners[f, 3 * c] + y * corners[f, 3 * c + 1] + z * corners[f, 3 * c + 2])
    planes[row, 3] = high


@kernel
def flies_over(slabs: Slabs, level: int, k: int, p: Vec, q: Vec, slack: float) -> bool:
    """Whether an arc from p to q (m) stays above the slab of a level's cell k by more than the slack (m).

    The slack covers rounding: of both heights, and of where cells end.
    """
    at = np.uintp(4 * (slabs.first[level] + k))  # unsigned: it never counts from the end of the array
    n = slabs.planes[at], slabs.planes[at + np.uintp(1)], slabs.planes[at + np.uintp(2)]
    return bool(min(dot(n, p), dot(n, q)) > slabs.planes[at + np.uintp(3)] + slack)
