"""Lay a hazard map over the triangles of a terrain, so that every cell that rocks reached has a colour.

A triangle has the largest value of all cells that it touches in plan, so a map may show too much but never too little.
A cell with the value FEW was reached by too few rocks for a value; the true value may be larger than all known values.
A triangle that touches FEW cells and cells with a known value is FEW if its middle is in a FEW cell, so that this cell
does not get a low value from its neighbour.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.report.run_files import HazardGrid
from rpf3d_core.terrain.frame import FloatArray

CAPTION = "Each facet of a hazard map shows the largest value of the cells that it touches."
"""Sentence for captions of pictures with a draped map."""
FEW_CAPTION = (
    f"A facet of the map of p95 energy is blue-grey, without a value, if fewer than {FEWEST_ROCKS} rocks reached the "
    "cell under its middle."
)
"""Sentence for captions of pictures with a draped map that has triangles with the value FEW."""
FEW = 0.0
"""Value of a cell, and of a triangle, that rocks reached, but too few rocks for a value."""
FINEST_PART, COARSER, FINEST, MOST_DRAPED = 0.5, 2.0**0.5, 0.5, 80_000
"""Settings for cutting the triangles of a draped map.

FINEST_PART : edge in plan, as a share (-) of a cell's side, down to which triangles are cut
FINEST : smallest such edge (m)
COARSER : factor (-) between two successive limits for the longest edge
MOST_DRAPED : largest number of triangles that cuts may add
"""
STATED = 2.0
"""Largest edge of a triangle in plan, as a multiple (-) of a cell's side, above which a caption states the edge."""
TOUCHING = 1e-6
"""Overlap of a triangle and a cell, as a share (-) of a cell, that does not count: it is rounding."""
AT_ONCE = 1_000_000
"""Largest number of pairs of a triangle and a cell that are compared together, to limit memory."""
IntArray = NDArray[np.int64]


def draped_facets(grid: HazardGrid, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a hazard map on the terrain: corners (M, 3, 3) m and values (M,) of triangles.

    The triangles are those that touch a cell with a value, cut into smaller triangles.

    The longest edges are cut first, until no edge is longer than half a cell or FINEST (0.5 m), whichever is longer.
    The cutting ends earlier if cuts would add more than MOST_DRAPED triangles in total. The triangles of the terrain do
    not count towards this number, because most of them may need no cut.

    A triangle has the largest value of the cells that it touches, or FEW.

    corners : (N, 3, 3) m, the triangles of the terrain, local frame
    """
    fine = corners[_near_values(grid, corners)]
    most, finest = len(fine) + MOST_DRAPED, max(FINEST_PART * grid.cell, FINEST)
    longest = longest_edge(fine)
    while longest > finest:
        longest = max(longest / COARSER, finest)
        finer = _cut(grid, fine, longest, most)
        if finer is None:
            break
        fine = finer
    values = touched_values(grid, fine)
    known = ~np.isnan(values)
    return fine[known], values[known]


def caption_of(maps: Iterable[tuple[FloatArray, float]], few: bool) -> str:
    """Return the sentences for captions of a picture with draped maps: CAPTION, FEW_CAPTION, the size of large facets.

    maps : for each map its triangles (N, 3, 3) m and the side (m) of its cells; few : True if a triangle is FEW
    """
    about = f"{CAPTION} {FEW_CAPTION}" if few else CAPTION
    sizes = [longest for corners, cell in maps if (longest := longest_edge(corners)) > STATED * cell]
    return f"{about} The edges of these facets are up to {max(sizes):.2g} m long." if sizes else about


def longest_edge(corners: FloatArray) -> float:
    """Return the length in plan (m) of the longest edge of triangles (N, 3, 3) m; 0 without a triangle."""
    return float(_edges(corners).max(initial=0.0))


def touched_values(grid: HazardGrid, corners: FloatArray) -> FloatArray:
    """Return the value (N,) of triangles (N, 3, 3) m: the largest value of the cells that each touches, or FEW.

    A triangle that touches only FEW cells is FEW, and so is a triangle whose middle is in a FEW cell. The result is NaN
    for a triangle that touches no cell with a value.
    """
    few = grid.values == FEW
    known = largest_touched(grid._replace(values=np.where(few, np.nan, grid.values)), corners)
    if not few.any():
        return known
    any_few = largest_touched(grid._replace(values=np.where(few, FEW, np.nan)), corners)
    middle = grid.at(corners[:, :, :2].mean(axis=1))
    return np.asarray(np.where(np.isnan(known) | (middle == FEW), any_few, known))


def largest_touched(grid: HazardGrid, corners: FloatArray) -> FloatArray:
    """Return the largest value (N,) of the cells that each triangle (N, 3, 3) m touches in plan; NaN without a value.

    A vertical triangle is a line in plan. On the border of two cells, such a triangle touches both cells.
    """
    plan = (corners[:, :, :2] - (grid.x, grid.y)) / (grid.dx, grid.dy)  # in cells: a cell is a unit square
    low, high = _touched_range(plan)
    shape = np.array(grid.values.shape[::-1])
    first = np.clip(np.floor(low), 0, shape).astype(np.int64)
    size = np.maximum(np.clip(np.ceil(high), 0, shape).astype(np.int64) - first, 0)
    found = np.full(len(plan), -np.inf)
    count = size.prod(axis=1)
    for some in np.split(np.arange(len(plan)), np.flatnonzero(np.diff(np.cumsum(count) // AT_ONCE)) + 1):
        triangle = np.repeat(some, count[some])
        number = np.arange(len(triangle)) - np.repeat(np.cumsum(count[some]) - count[some], count[some])
        column, row = (first[triangle] + np.stack([number % size[triangle, 0], number // size[triangle, 0]], axis=1)).T
        values = grid.values[row, column]
        known = ~np.isnan(values)
        triangle, column, row, values = triangle[known], column[known], row[known], values[known]
        touched = _touch(plan[triangle], np.stack([column, row], axis=1) + 0.5)
        np.maximum.at(found, triangle[touched], values[touched])
    return np.where(np.isinf(found), np.nan, found)


def _touch(plan: FloatArray, middle: FloatArray) -> NDArray[np.bool_]:
    """Return flags (K,) for K pairs of a triangle and a cell: True if the triangle touches the cell in plan.

    The box around each triangle is known to touch the cell of the pair. Method: separating axes, here the normals of
    the triangle's edges.

    plan : (K, 3, 2) corners of the triangles; middle : (K, 2) middles of the cells; the unit is the side of a cell
    """
    touched = np.ones(len(plan), dtype=bool)
    for corner in range(3):
        edge = plan[:, corner - 2] - plan[:, corner]
        normal = np.stack([-edge[:, 1], edge[:, 0]], axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        low, high = _touched_range((plan * normal[:, None]).sum(axis=2, keepdims=True))
        at, half = (middle * normal).sum(axis=1), 0.5 * np.abs(normal).sum(axis=1)
        touched &= (at + half > low[:, 0]) & (at - half < high[:, 0])
    return touched


def _touched_range(plan: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest coordinate (N, A) of triangles on A axes, moved by TOUCHING.

    Both are moved inward, so that a triangle next to a cell does not touch the cell because of rounding. If a triangle
    is only a point on an axis, both are moved outward, so that the triangle touches the cells on both sides.

    plan : (N, 3, A) corners on the axes; the unit is the side of a cell, as in the result
    """
    low, high = plan.min(axis=1), plan.max(axis=1)
    inward = np.where(high - low > 2.0 * TOUCHING, TOUCHING, -TOUCHING)
    return low + inward, high - inward


def _cut(grid: HazardGrid, corners: FloatArray, longest: float, most: int) -> FloatArray | None:
    """Cut triangles (N, 3, 3) m into triangles (M, 3, 3) m whose edges in plan are at most `longest` (m) long.

    Parts of a cut triangle whose box in plan touches no cell with a value are left out.

    most : largest number M of triangles; the result is None if there are more
    """
    while (coarse := (_edges(corners) > longest).any(axis=1)).any():
        smaller = _halved(corners[coarse])
        corners = np.concatenate([corners[~coarse], smaller[_near_values(grid, smaller)]])
        if len(corners) > most:
            return None
    return corners


def _near_values(grid: HazardGrid, corners: FloatArray) -> NDArray[np.bool_]:
    """Return flags (N,): True for a triangle (N, 3, 3) m whose box in plan touches a cell with a value."""
    known = np.pad(np.cumsum(np.cumsum(~np.isnan(grid.values), axis=0), axis=1), ((1, 0), (1, 0)))
    rows, columns = grid.values.shape
    column = (corners[:, :, 0] - grid.x) / grid.dx
    row = (corners[:, :, 1] - grid.y) / grid.dy
    left, right = _cells(column, columns)
    first, last = _cells(row, rows)
    count = known[last, right] - known[first, right] - known[last, left] + known[first, left]
    return np.asarray(count > 0)


def _cells(places: FloatArray, number: int) -> tuple[IntArray, IntArray]:
    """Return the first cell (N,) that each triangle touches on an axis, and the cell (N,) after the last such cell.

    places : (N, 3) corners on this axis, the unit is the side of a cell; number : number of cells on this axis
    """
    first = np.floor(places.min(axis=1) - TOUCHING)
    after = np.floor(places.max(axis=1) + TOUCHING) + 1.0
    return np.clip(first, 0, number).astype(np.int64), np.clip(after, 0, number).astype(np.int64)


def _edges(corners: FloatArray) -> FloatArray:
    """Return the lengths in plan (N, 3) m of the edges of triangles; edge i goes from corner i to the next corner."""
    return np.asarray(np.linalg.norm((np.roll(corners, -1, axis=1) - corners)[:, :, :2], axis=2))


def _halved(corners: FloatArray) -> FloatArray:
    """Return two triangles (2 N, 3, 3) for each triangle (N, 3, 3), cut at the middle of its longest edge in plan.

    Long thin triangles then need few cuts. Four parts of the same shape as the triangle would be just as thin.
    """
    order = (np.argmax(_edges(corners), axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(corners, order[:, :, None], axis=1), 1, 0)
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack(part, axis=1) for part in ((a, middle, c), (middle, b, c))])
