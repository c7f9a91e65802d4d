"""Candidates from a grid of buckets over the plan: in plan a parabola is a straight line, so walk its cells.

The broad phase of the compiled engine. Each bucket knows the heights between which its facets lie; an arc that
passes above or below them skips it.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.arc import Arc
from rpf3d_core.compiling import kernel, loop
from rpf3d_core.detection.contact import NO_CONTACT, Contact, Left, earlier_contact, first_contact
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


class BucketLocator(NamedTuple):
    """Buckets of nx by ny square cells; those at the rim reach outwards without end, so every place is in one.

    x, y, cell, nx, ny : as of a `Grid`; starts : (nx ny + 1,) first entry of each bucket in `ids`
    low, high : (nx ny,) heights between which a bucket's facets lie (m)
    """

    x: float
    y: float
    cell: float
    nx: int
    ny: int
    starts: Any
    ids: Any
    low: Any
    high: Any


def bucket_locator(facets: Facets) -> BucketLocator:
    """Sort F facets into buckets; a facet stands in every bucket that its box in plan touches."""
    grid, starts = _counted(facets)
    np.cumsum(starts, out=starts)
    ids = np.empty(starts[-1], dtype=np.int32)
    low, high = np.full(grid.nx * grid.ny, np.inf), np.full(grid.nx * grid.ny, -np.inf)
    _fill(facets.corners, REACH * facets.tolerance, *grid, starts[:-1].copy(), ids, low, high)
    return BucketLocator(*grid, starts, ids, low, high)


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
def _index(value: float, origin: float, cell: float, count: int) -> int:
    """The cell that a coordinate lies in, clamped to the grid."""
    return min(max(math.floor((value - origin) / cell), 0), count - 1)


@kernel
def _span(a: float, b: float, c: float, slack: float, origin: float, cell: float, count: int) -> tuple[int, int]:
    """First and last cell that three coordinates span, widened by the slack."""
    return (
        _index(min(a, b, c) - slack, origin, cell, count),
        _index(max(a, b, c) + slack, origin, cell, count),
    )


@loop
def _count(
    corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, most: int, starts: Any
) -> bool:
    """Count the entries of bucket k into starts[k + 1]; False, and no further, if all together are more than most."""
    entries = 0
    for f in range(corners.shape[0]):
        i0, i1 = _span(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        j0, j1 = _span(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
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
    cursor: Any, ids: Any, low: Any, high: Any,
) -> None:  # fmt: skip
    """Write the entries, in order of facet, and the heights of each bucket."""
    for f in range(corners.shape[0]):
        i0, i1 = _span(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        j0, j1 = _span(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                k = j * nx + i
                ids[cursor[k]] = f
                cursor[k] += 1
                low[k] = min(low[k], corners[f, 2], corners[f, 5], corners[f, 8])
                high[k] = max(high[k], corners[f, 2], corners[f, 5], corners[f, 8])


@kernel
def _boundary_time(index: int, count: int, origin: float, cell: float, x: float, v: float) -> float:
    """When a coordinate that moves at v leaves cell `index` (s); inf if it stands still or moves out at the rim."""
    if v > 0.0 and index < count - 1:
        return (origin + (index + 1) * cell - x) / v
    if v < 0.0 and index > 0:
        return (origin + index * cell - x) / v
    return math.inf


@kernel
def _passes(locator: BucketLocator, k: int, arc: Arc, begin: float, end: float, slack: float) -> bool:
    """Whether the arc stays above or below everything in bucket k between two times."""
    z0 = arc.x[2] + (arc.v[2] - 0.5 * arc.gravity * begin) * begin
    z1 = arc.x[2] + (arc.v[2] - 0.5 * arc.gravity * end) * end
    if min(z0, z1) > locator.high[k] + slack:
        return True
    apex = arc.v[2] / arc.gravity
    top = max(z0, z1)
    if begin < apex < end:
        top = arc.x[2] + 0.5 * arc.v[2] * apex
    return bool(top < locator.low[k] - slack)


@first_contact.rule(BucketLocator)
def first_contact_in_buckets(locator: BucketLocator, facets: Facets, arc: Arc, left: Left, end: float) -> Contact:
    """Walk the cells under the arc; stop as soon as the best contact lies within what was walked."""
    i = _index(arc.x[0], locator.x, locator.cell, locator.nx)
    j = _index(arc.x[1], locator.y, locator.cell, locator.ny)
    step_i = 1 if arc.v[0] > 0.0 else -1
    step_j = 1 if arc.v[1] > 0.0 else -1
    best, begin = NO_CONTACT, 0.0
    slack = REACH * facets.tolerance
    while 0 <= i < locator.nx and 0 <= j < locator.ny:
        leave_i = _boundary_time(i, locator.nx, locator.x, locator.cell, arc.x[0], arc.v[0])
        leave_j = _boundary_time(j, locator.ny, locator.y, locator.cell, arc.x[1], arc.v[1])
        leave = min(leave_i, leave_j, end)
        k = j * locator.nx + i
        if not _passes(locator, k, arc, begin, leave, slack):
            for entry in range(locator.starts[k], locator.starts[k + 1]):
                f: Any = np.int64(locator.ids[entry])  # a contact's facet has 64 bits, whatever the index has
                best = earlier_contact(facets, f, arc, left, best)
        if best.t <= leave or leave >= end:
            break
        begin = leave
        if leave_i <= leave_j:
            i += step_i
        else:
            j += step_j
    return best
