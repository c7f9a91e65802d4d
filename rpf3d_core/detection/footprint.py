"""Find the facets of the ground that a new survey (a patch) touches in plan, and their neighbours.

The buckets of the ground limit each search to a few facets.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.bucket_grid import CellRectangle, Grid, cell_index, cells_under, common
from rpf3d_core.detection.bucket_locator import BucketLocator, grid_of
from rpf3d_core.detection.bucket_patch import Entries, cell_in
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.terrain.frame import FloatArray

STAYS, GOES = 0, 2
"""Marks of facets: kept, or removed by the patch."""
_SEEN = 1
"""Mark of a facet that the patch touches, before the facet is listed and marked GOES."""


class Footprint(NamedTuple):
    """The area of a patch in plan, widened by a slack (m): the facets of the ground that touch this area are replaced.

    corners : (S, 9) m (3 corners each), of the facets of the patch; block : rectangle of cells around the patch
    entries : the facets of the patch, listed by the cells of `block`
    """

    corners: FloatArray
    block: CellRectangle
    entries: Entries
    slack: float


def touched(
    corners: FloatArray, locator: BucketLocator, footprint: Footprint, marks: NDArray[np.uint8]
) -> NDArray[np.int32]:
    """Return the facets (N,) of the ground that a patch replaces, in ascending order, and mark them GOES.

    These are the facets that touch the area of the patch in plan.

    corners : (F, 9) m (3 corners each), of the ground; marks : (F,) all STAYS before the call
    """
    found = np.empty(_mark(corners, locator, footprint, marks), np.int32)
    _collect(locator, footprint.block, marks, found)
    found.sort()
    return found


def beside_what_stays(
    edges: NDArray[np.int64], vertices: FloatArray, triangles: Any, locator: BucketLocator, marks: NDArray[np.uint8]
) -> NDArray[np.bool_]:
    """Return (E,) True for each edge of the ground that belongs to at least one facet that stays (mark STAYS).

    edges : (E, 2) pairs of vertices; vertices : (V, 3) m; triangles : (F, 3); marks : (F,) of the facets
    """
    out = np.zeros(len(edges), np.bool_)
    _beside(edges, vertices, triangles, locator, marks, out)
    return out


def used_by_what_stays(
    some: NDArray[np.int64], vertices: FloatArray, triangles: Any, locator: BucketLocator, marks: NDArray[np.uint8]
) -> NDArray[np.bool_]:
    """Return (N,) True for each vertex of the ground that belongs to a facet that stays (mark STAYS).

    some : (N,) numbers of vertices; vertices : (V, 3) m; triangles : (F, 3); marks : (F,) of the facets
    """
    out = np.zeros(len(some), np.bool_)
    _used(some, vertices, triangles, locator, marks, out)
    return out


def near_patch(thin: FloatArray, locator: BucketLocator, footprint: Footprint) -> NDArray[np.bool_]:
    """Return (N,) True for each of N triangles that touches the area of a patch in plan.

    thin : (N, 9) m, three corners of each triangle, which may have no area in plan
    """
    out = np.zeros(len(thin), np.bool_)
    _near(thin, grid_of(locator), footprint, out)
    return out


def over_what_goes(
    points: FloatArray, corners: FloatArray, locator: BucketLocator, marks: NDArray[np.uint8]
) -> NDArray[np.bool_]:
    """Return (N,) True for each point (N, 2) m that lies, in plan, in a facet marked GOES, which the patch removes.

    corners : (F, 9) m (3 corners each), of the ground; marks : (F,) of the facets
    """
    out = np.zeros(len(points), np.bool_)
    _over(points, corners, locator, marks, out)
    return out


@loop
def _mark(corners: Any, locator: BucketLocator, footprint: Footprint, marks: Any) -> int:
    """Mark as _SEEN the facets of the ground that touch a facet of the patch; return the number of these facets.

    corners : (F, 9) m (3 corners each), of the ground
    marks : (F,) STAYS, GOES or _SEEN for each facet of the ground, changed
    """
    count, block = 0, footprint.block
    for j in range(block.bottom, block.top):
        for i in range(block.left, block.right):
            k, c = j * locator.nx + i, cell_in(block, i, j)
            for entry in range(locator.starts[k], locator.starts[k + 1]):
                f = locator.ids[entry]
                if marks[f] == STAYS and _any_touches(corners, f, footprint, c):
                    marks[f] = _SEEN
                    count += 1
    return count


@loop
def _collect(locator: BucketLocator, block: CellRectangle, marks: Any, found: Any) -> None:
    """Write the facets marked _SEEN into `found`, and mark them GOES: the patch removes them.

    block : rectangle of cells around the patch; found : (N,) receives the facets' numbers
    marks : (F,) STAYS, GOES or _SEEN for each facet of the ground, changed
    """
    count = 0
    for j in range(block.bottom, block.top):
        for i in range(block.left, block.right):
            k = j * locator.nx + i
            for entry in range(locator.starts[k], locator.starts[k + 1]):
                f = locator.ids[entry]
                if marks[f] == _SEEN:
                    marks[f] = GOES
                    found[count] = f
                    count += 1


@loop
def _near(thin: Any, grid: Grid, footprint: Footprint, out: Any) -> None:
    """Write True into `out` for each triangle that touches the patch.

    thin : (N, 9) m, three corners of each triangle; out : (N,), changed
    """
    block = footprint.block
    for f in range(len(thin)):
        cells = common(cells_under(thin, f, footprint.slack, grid), block)
        for j in range(cells.bottom, cells.top):
            for i in range(cells.left, cells.right):
                if not out[f] and _any_touches(thin, f, footprint, cell_in(block, i, j)):
                    out[f] = True


@loop
def _beside(edges: Any, vertices: Any, triangles: Any, locator: BucketLocator, marks: Any, out: Any) -> None:
    """Write True into `out` for each edge that belongs to a facet marked STAYS.

    edges : (E, 2) vertices; vertices : (V, 3) m and triangles : (F, 3), of the ground
    marks : (F,) STAYS or GOES for each facet; out : (E,), changed
    """
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        k = _bucket_at(locator, vertices[a, 0], vertices[a, 1])
        for entry in range(locator.starts[k], locator.starts[k + 1]):
            f = locator.ids[entry]
            if marks[f] == STAYS and _has(triangles, f, a) and _has(triangles, f, b):
                out[e] = True


@loop
def _used(some: Any, vertices: Any, triangles: Any, locator: BucketLocator, marks: Any, out: Any) -> None:
    """Write True into `out` for each vertex that belongs to a facet marked STAYS.

    some : (N,) vertices; vertices : (V, 3) m and triangles : (F, 3), of the ground
    marks : (F,) STAYS or GOES for each facet; out : (N,), changed
    """
    for n in range(len(some)):
        v = some[n]
        k = _bucket_at(locator, vertices[v, 0], vertices[v, 1])
        for entry in range(locator.starts[k], locator.starts[k + 1]):
            f = locator.ids[entry]
            if marks[f] == STAYS and _has(triangles, f, v):
                out[n] = True


@loop
def _over(points: Any, corners: Any, locator: BucketLocator, marks: Any, out: Any) -> None:
    """Write True into `out` for each point that lies, in plan, in a facet marked GOES.

    points : (N, 2) m; corners : (F, 9) m (3 corners each), of the ground
    marks : (F,) STAYS or GOES for each facet; out : (N,), changed
    """
    for n in range(len(points)):
        px, py = points[n, 0], points[n, 1]
        k = _bucket_at(locator, px, py)
        for entry in range(locator.starts[k], locator.starts[k + 1]):
            f = locator.ids[entry]
            if marks[f] == GOES and _holds(corners, f, px, py):
                out[n] = True


@kernel
def _bucket_at(locator: BucketLocator, x: float, y: float) -> int:
    """Return the number of the bucket that contains a point x, y (m) in plan."""
    row = cell_index(y, locator.y, locator.cell, locator.ny)
    return row * locator.nx + cell_index(x, locator.x, locator.cell, locator.nx)


@kernel
def _has(triangles: Any, f: int, v: int) -> bool:
    """Return True if vertex v is a corner of facet f; triangles : (F, 3) vertices of the facets."""
    return bool(triangles[f, 0] == v or triangles[f, 1] == v or triangles[f, 2] == v)


@kernel
def _holds(corners: Any, f: int, px: float, py: float) -> bool:
    """Return True if a point lies in facet f in plan, edges included; the winding of the facet does not matter.

    corners : (F, 9) m (3 corners each); px, py : m, the point
    """
    left, right = False, False
    for k in range(3):
        ax, ay = corners[f, 3 * k], corners[f, 3 * k + 1]
        bx, by = corners[f, 3 * ((k + 1) % 3)], corners[f, 3 * ((k + 1) % 3) + 1]
        side = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
        left, right = left or side > 0.0, right or side < 0.0
    return not (left and right)


@kernel
def _any_touches(corners: Any, f: int, footprint: Footprint, c: int) -> bool:
    """Return True if facet f touches, in plan, a facet of the patch that has an entry in cell c.

    corners : (F, 9) m (3 corners each), of the ground; c : number of the cell within the rectangle `footprint.block`
    """
    come = footprint.entries
    for entry in range(come.starts[c], come.starts[c + 1]):
        if _touch(corners, f, footprint.corners, come.ids[entry], footprint.slack):
            return True
    return False


@kernel
def _touch(one: Any, f: int, other: Any, g: int, slack: float) -> bool:
    """Return True if triangles f and g are within the slack (m) of each other in plan.

    one, other : (N, 9) m (3 corners each), arrays with the corners of f and of g

    The triangles are farther apart if a side of f or g, or a gap between their boxes along x or y, separates them. The
    boxes are needed for a triangle without area in plan: its sides do not show a gap beyond its ends.
    """
    for axis in range(2):
        if min(one[f, axis], one[f, 3 + axis], one[f, 6 + axis]) \
                > max(other[g, axis], other[g, 3 + axis], other[g, 6 + axis]) + slack \
                or max(one[f, axis], one[f, 3 + axis], one[f, 6 + axis]) \
                < min(other[g, axis], other[g, 3 + axis], other[g, 6 + axis]) - slack:  # fmt: skip
            return False
    return not (_parts(one, f, other, g, slack) or _parts(other, g, one, f, slack))


@kernel
def _parts(one: Any, f: int, other: Any, g: int, slack: float) -> bool:
    """Return True if one side of triangle f separates the triangles f and g in plan, by more than the slack (m).

    one, other : (S, 9) m (3 corners each), arrays of corners that contain triangle f and triangle g
    """
    for k in range(3):
        ax, ay = one[f, 3 * k], one[f, 3 * k + 1]
        ux, uy = one[f, 3 * ((k + 1) % 3)] - ax, one[f, 3 * ((k + 1) % 3) + 1] - ay
        own = ux * (one[f, 3 * ((k + 2) % 3) + 1] - ay) - uy * (one[f, 3 * ((k + 2) % 3)] - ax)
        low, high = math.inf, -math.inf
        for m in range(3):
            away = ux * (other[g, 3 * m + 1] - ay) - uy * (other[g, 3 * m] - ax)
            low, high = min(low, away), max(high, away)
        room = slack * (abs(ux) + abs(uy))
        if low > max(own, 0.0) + room or high < min(own, 0.0) - room:
            return True
    return False
