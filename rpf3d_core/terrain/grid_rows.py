"""Make a mesh from a survey given as a grid of points, row by row; the mesh needs no welding or repair.

Four neighbouring points make a square of two triangles; all squares are cut along the same diagonal, as in
`grid_triangles.py`. A square with a missing point at a corner is left out, and so is a triangle with a side that is
longer in plan than a given length. Both leave a hole. Rows may run in any direction: if most of the area in plan would
face down, all facets are turned over.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.jit.memory import Memory, Share, fresh, halves, one_by_one
from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Vec

NO_SQUARE = "the grid has no square of four points without a hole; the terrain needs at least one"
TOO_LONG = "every triangle of the grid has a side longer than allowed in plan (longest_edge)"
NOT_FINITE = "the terrain has a vertex that is NaN or infinite; every coordinate must be a finite number"


class Mesh(NamedTuple):
    """A triangle mesh in a local frame, made from a survey.

    vertices : (V, 3) m, in the local frame; triangles : (F, 3) vertex numbers
    origin : m, origin of the local frame, in the coordinates of the survey
    """

    vertices: FloatArray
    triangles: IntArray
    origin: tuple[float, float, float]


class NumberedGrid(NamedTuple):
    """A grid of points in H rows and W columns, with the vertex number of each point: input of the loops over squares.

    number : (H, W) vertex number of each point, -1 for a missing point; vertices : (V, 3) m, in the local frame
    longest : m, longest allowed side of a triangle in plan; inf for no limit
    """

    number: Any
    vertices: Any
    longest: float


def grid_mesh(
    points: FloatArray, memory: Memory = fresh, share: Share = one_by_one,
    origin: tuple[float, float, float] | None = None, longest_edge: float | None = None,
) -> Mesh:  # fmt: skip
    """Return the mesh of a survey given as a grid of points (H, W, 3) m in rows and columns.

    A point with a NaN coordinate is missing.

    memory : allocates the arrays of the mesh; share : runs functions, possibly in parallel (both: `jit.memory`)
    origin : origin of the local frame (m); None for the middle of the points' box, in whole metres
    longest_edge : m, longest allowed side of a triangle in plan; triangles with longer sides are left out. None for no
        limit, for example for the grid of a scanner, whose points are far apart at a great distance

    Raises TerrainError if no square has four points, if every triangle has too long a side, or if a point is infinite.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    rows, columns = points.shape[:2]
    some, boxes = np.zeros(rows, np.int64), np.empty((2, 2, 3))
    _in_halves(share, rows, lambda half, a, b: _count_points(points, a, b, some, boxes[half]))
    if rows < 2 or columns < 2 or not some.any():
        raise TerrainError(NO_SQUARE)
    middle = origin_of(boxes)
    origin = middle if origin is None else origin
    before = np.concatenate([[0], np.cumsum(some)])
    vertices = memory("vertices", 3 * int(before[-1]), np.float64).reshape(-1, 3)
    number = memory("number", rows * columns, np.int32).reshape(rows, columns)
    _in_halves(share, rows, lambda half, a, b: _place(points, a, b, origin, before, vertices, number))
    grid = NumberedGrid(number, vertices, longest=math.inf if longest_edge is None else float(longest_edge))
    kept, plan, whole = np.zeros(rows - 1, np.int64), np.zeros(rows - 1), np.zeros(rows - 1, np.int64)
    _in_halves(share, rows - 1, lambda half, a, b: _count(grid, a, b, whole, kept, plan))
    first = np.concatenate([[0], np.cumsum(kept)])
    if first[-1] == 0:
        raise TerrainError(TOO_LONG if whole.any() else NO_SQUARE)
    triangles = memory("triangles", 3 * int(first[-1]), np.int32).reshape(-1, 3)
    turned = bool(plan.sum() < 0.0)
    _in_halves(share, rows - 1, lambda half, a, b: _cut(grid, a, b, turned, first, triangles))
    return Mesh(vertices=vertices, triangles=triangles, origin=origin)


def origin_of(boxes: FloatArray) -> tuple[float, float, float]:
    """Return the origin of the local frame (m): the middle of the box around all boxes, in whole metres.

    boxes : (N, 2, 3) m, the lowest and the highest corner of each box; each box is around some of the points. A box
        without points has the lowest corner +inf and the highest corner -inf, and does not count.

    Raises TerrainError if the box around all boxes is not finite.
    """
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise TerrainError(NOT_FINITE)
    x, y, z = np.round(0.5 * (low + high)).tolist()
    return x, y, z


def _in_halves(share: Share, count: int, work: Callable[[int, int, int], Any]) -> None:
    share([lambda k=k, a=a, b=b: work(k, a, b) for k, (a, b) in enumerate(halves(count))])  # type: ignore[misc]


@loop
def _count_points(points: Any, begin: int, end: int, some: Any, box: Any) -> None:
    """Count the points in each row of the grid from `begin` to `end` - 1, and find the box around these points.

    Points with a NaN coordinate do not count.

    points : (H, W, 3) m; some : (H,), all 0 before the call; receives the number of points of each row
    box : (2, 3) m, receives the lowest and the highest corner; +inf and -inf if there are no points
    """
    for axis in range(3):
        box[0, axis], box[1, axis] = np.inf, -np.inf
    for r in range(begin, end):
        for c in range(points.shape[1]):
            x, y, z = points[r, c, 0], points[r, c, 1], points[r, c, 2]
            if x == x and y == y and z == z:
                some[r] += 1
                box[0, 0], box[1, 0] = min(box[0, 0], x), max(box[1, 0], x)
                box[0, 1], box[1, 1] = min(box[0, 1], y), max(box[1, 1], y)
                box[0, 2], box[1, 2] = min(box[0, 2], z), max(box[1, 2], z)


@loop
def _place(points: Any, begin: int, end: int, origin: Vec, before: Any, vertices: Any, number: Any) -> None:
    """Write the points of the rows from `begin` to `end` - 1 as vertices relative to the origin, and number them.

    points : (H, W, 3) m, missing if a coordinate is NaN; origin : m
    before : (H + 1,) for each row, the number of points in all earlier rows; vertices : (V, 3) m, receives the points
    number : (H, W) receives the vertex number of each point, -1 for a missing point
    """
    x0, y0, z0 = origin
    for r in range(begin, end):
        n = before[r]
        for c in range(points.shape[1]):
            x, y, z = points[r, c, 0], points[r, c, 1], points[r, c, 2]
            number[r, c] = -1
            if x == x and y == y and z == z:
                vertices[n, 0], vertices[n, 1], vertices[n, 2] = x - x0, y - y0, z - z0
                number[r, c] = n
                n += 1


@kernel
def _is_short(vertices: Any, a: int, b: int, c: int, longest: float) -> bool:
    """Return True if no side in plan of the triangle with the vertices a, b, c is longer than `longest` (m).

    a, b, c : numbers of the vertices; vertices : (V, 3) m
    """
    if longest == np.inf:
        return True
    most = 0.0
    for p, q in ((a, b), (b, c), (c, a)):
        x, y = vertices[q, 0] - vertices[p, 0], vertices[q, 1] - vertices[p, 1]
        most = max(most, x * x + y * y)
    return most <= longest * longest


@loop
def _count(grid: NumberedGrid, begin: int, end: int, whole: Any, kept: Any, plan: Any) -> None:
    """Write, for each row of squares, the number of squares, the number of kept triangles, and twice the area in plan.

    A square counts if it has four points; a triangle is kept if no side in plan is longer than `grid.longest`. A square
    with at least one kept triangle adds its whole area, which is positive if the square faces up. Only the rows of
    squares from `begin` to `end` - 1 are counted.

    whole, kept : (H - 1,), receive the numbers of squares and of kept triangles; plan : (H - 1,), receives twice the
        areas, m^2; all 0 before the call
    """
    number, vertices, longest = grid.number, grid.vertices, grid.longest
    for r in range(begin, end):
        for c in range(number.shape[1] - 1):
            a, b, d, e = number[r, c], number[r, c + 1], number[r + 1, c], number[r + 1, c + 1]
            if min(a, b, d, e) < 0:
                continue
            whole[r] += 1
            count = int(_is_short(vertices, a, b, e, longest)) + int(_is_short(vertices, a, e, d, longest))
            kept[r] += count
            if count:
                plan[r] += (vertices[e, 0] - vertices[a, 0]) * (vertices[d, 1] - vertices[b, 1]) \
                    - (vertices[e, 1] - vertices[a, 1]) * (vertices[d, 0] - vertices[b, 0])  # fmt: skip


@loop
def _cut(grid: NumberedGrid, begin: int, end: int, turned: bool, first: Any, triangles: Any) -> None:
    """Write the kept triangles of each square with four points, for the rows of squares from `begin` to `end` - 1.

    A triangle is kept if no side in plan is longer than `grid.longest`.

    turned : true to reverse the winding of all triangles, so that they face the other side
    first : (H,) for each row of squares, the number of triangles in all earlier rows
    triangles : (F, 3), receives the triangles
    """
    number, vertices, longest = grid.number, grid.vertices, grid.longest
    one, two = (2, 1) if turned else (1, 2)
    for r in range(begin, end):
        f = first[r]
        for c in range(number.shape[1] - 1):
            a, b, d, e = number[r, c], number[r, c + 1], number[r + 1, c], number[r + 1, c + 1]
            if min(a, b, d, e) < 0:
                continue
            if _is_short(vertices, a, b, e, longest):
                triangles[f, 0], triangles[f, one], triangles[f, two] = a, b, e
                f += 1
            if _is_short(vertices, a, e, d, longest):
                triangles[f, 0], triangles[f, one], triangles[f, two] = a, e, d
                f += 1
