"""The compiled engine's search for contacts: visit the cells of a bucket grid under an arc, a straight line in plan.

This is the broad phase. Where the arc stays above the slab of a cell, the search skips the whole cell, and tries wider
cells (`slabs.py`). Where the arc does not stay above the slab of a bucket, the search tests the facets of this bucket
that the arc may touch (`stretch.py`).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import Arc, position
from rpf3d_core.detection.bucket_grid import Grid, cell_index, sorted_into_buckets
from rpf3d_core.detection.contact import NO_CONTACT, Contact, PreviousContact, first_contact
from rpf3d_core.detection.narrow_phase import earlier_of
from rpf3d_core.detection.plan_boxes import overlap
from rpf3d_core.detection.search import notices_falls
from rpf3d_core.detection.slabs import LEVELS, SHIFT, Slabs, flies_over, slabs_of, width_of
from rpf3d_core.detection.stretch import SLOWEST, out_of_reach, stretch_of
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.jit.memory import Memory, Share, fresh, one_by_one
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets

CLEAR = 3
"""Number of cells that a search skips in a row before it tries wider cells: most flights end after a few cells."""


class BucketLocator(NamedTuple):
    """The bucket grid of a terrain as one record that compiled code can read; the outermost cells extend without limit.

    x, y : m, south-west corner of the grid; cell : m, side of a cell; nx, ny : numbers of columns and rows
    starts, ids, boxes : the facets of each cell, as in `Buckets`; slabs : slabs of the cells
    """

    x: float
    y: float
    cell: float
    nx: int
    ny: int
    starts: Any
    ids: Any
    boxes: Any
    slabs: Slabs


class Crossing(NamedTuple):
    """The part of an arc over one cell of the grid (column i, row j): from time `begin` to time `leave` (s)."""

    i: int
    j: int
    begin: float
    leave: float


def bucket_locator(facets: Facets, memory: Memory = fresh, share: Share = one_by_one) -> BucketLocator:
    """Return the locator of the compiled engine for F facets, which finds the facets that a rock may meet.

    memory : allocates the arrays; share : runs the work in parallel; neither changes the content of the arrays
    """
    grid, buckets = sorted_into_buckets(facets, memory, share)
    return BucketLocator(
        x=grid.x, y=grid.y, cell=grid.cell, nx=grid.nx, ny=grid.ny, starts=buckets.starts, ids=buckets.ids,
        boxes=buckets.boxes, slabs=slabs_of(facets, grid, memory, share),
    )  # fmt: skip


@kernel
def grid_of(locator: BucketLocator) -> Grid:
    """Return the grid of a locator, for functions that need only the grid."""
    return Grid(x=locator.x, y=locator.y, cell=locator.cell, nx=locator.nx, ny=locator.ny)


@first_contact.rule(BucketLocator)
def first_contact_in_buckets(
    locator: BucketLocator, facets: Facets, arc: Arc, left: PreviousContact, end: float
) -> Contact:
    """Return the earliest contact of an arc, from a search of the cells under the arc, one cell after another.

    The search ends when the earliest contact found so far lies in a cell that has been searched, or when all cells
    under the arc up to the time `end` have been searched.

    left : the contact from which the rock starts; end : s, later contacts need not be found

    The facet that the rock has just left is tested first: if the rock falls back onto this facet, the search is short.
    """
    best = earlier_of(left, facets, left.facet, arc, NO_CONTACT) if left.facet >= 0 else NO_CONTACT
    i = cell_index(arc.x[0], locator.x, locator.cell, locator.nx)
    j = cell_index(arc.x[1], locator.y, locator.cell, locator.ny)
    pace_x, pace_y = _pace(arc.v[0]), _pace(arc.v[1])
    begin, p, level, clear = 0.0, arc.x, 0, 0
    while 0 <= i < locator.nx and 0 <= j < locator.ny:
        column, row = i >> (SHIFT * level), j >> (SHIFT * level)
        columns, rows = width_of(locator.nx, level), width_of(locator.ny, level)
        leave_x = _leave_time(column, columns, level, locator.x, locator.cell, arc.x[0], pace_x)
        leave_y = _leave_time(row, rows, level, locator.y, locator.cell, arc.x[1], pace_y)
        leave = min(leave_x, leave_y, end)
        q = position(arc, leave)
        if flies_over(locator.slabs, level, row * columns + column, p, q, REACH * facets.tolerance):
            clear += 1
        elif level > 0:
            level, clear = level - 1, 0
            continue
        else:
            crossing = Crossing(i=i, j=j, begin=begin, leave=leave)
            best, clear = _earliest_in_bucket(locator, facets, arc, left, crossing, best), 0
        if best.t <= leave or leave >= end:
            break
        begin, p = leave, q
        if leave_x <= leave_y:
            i, j = _beyond(column, level, pace_x), _still_in(row, level, q[1], locator.y, locator.cell, locator.ny)
        else:
            i, j = _still_in(column, level, q[0], locator.x, locator.cell, locator.nx), _beyond(row, level, pace_y)
        if clear >= CLEAR and level < LEVELS - 1:
            level, clear = level + 1, 1
    return best


@notices_falls.rule(BucketLocator)
def checks_falls(locator: BucketLocator) -> bool:
    """Return True: with this locator, a rock that would leave the terrain is checked for a fall through the ground."""
    return True


@kernel
def _pace(v: float) -> float:
    """Return 1 / v (s/m), the time that an arc takes per metre along an axis; negative for a negative velocity v (m/s).

    The result is inf, for a positive or negative v, if |v| is too small for the arc to leave a cell.
    """
    return 1.0 / v if abs(v) > SLOWEST else math.inf


@kernel
def _leave_time(index: int, count: int, level: int, origin: float, cell: float, x: float, pace: float) -> float:
    """Return the time (s) when an arc leaves cell number `index` along one axis; inf if it never leaves the cell.

    The arc never leaves an outermost cell outwards, because the outermost cells extend without limit.

    level : cell size, 0 for the buckets (`slabs.py`); count : number of cells of this size along the axis
    origin, cell : start of the grid along the axis, and side of a bucket (m)
    x, pace : start of the arc (m), and inverse of its velocity along the axis (s/m), from `_pace`
    """
    if pace == math.inf or index == (count - 1 if pace > 0.0 else 0):
        return math.inf
    edge = (index + 1 if pace > 0.0 else index) << (SHIFT * level)
    return (origin + edge * cell - x) * pace


@kernel
def _beyond(index: int, level: int, pace: float) -> int:
    """Return the column or row of the bucket that an arc enters when it leaves cell number `index` along an axis.

    level : size of cell `index` (`slabs.py`); pace : s/m along the axis, whose sign is the direction of the arc
    """
    return (index + 1) << (SHIFT * level) if pace > 0.0 else (index << (SHIFT * level)) - 1


@kernel
def _still_in(index: int, level: int, x: float, origin: float, cell: float, count: int) -> int:
    """Return the column or row of the bucket that contains coordinate x (m), limited to the buckets in cell `index`.

    Without this limit, rounding could give a bucket of a neighbouring cell.

    level : size of cell `index` (`slabs.py`)
    origin, cell, count : of the grid along this axis: start (m), side of a bucket (m) and number of buckets
    """
    if level == 0:
        return index
    first, behind = index << (SHIFT * level), (index + 1) << (SHIFT * level)
    return min(max(cell_index(x, origin, cell, count), first), behind - 1)


@kernel
def _earliest_in_bucket(
    locator: BucketLocator, facets: Facets, arc: Arc, left: PreviousContact, crossing: Crossing, best: Contact
) -> Contact:
    """Return the earliest of `best` and the contacts of an arc with the facets of one bucket.

    left : the contact from which the rock starts; its facet is not tested here, because the caller has tested it
    crossing : the part of the arc over the bucket; best : earliest contact found so far
    """
    k = crossing.j * locator.nx + crossing.i
    entry, stop = locator.starts[k], locator.starts[k + 1]
    until = min(crossing.leave, best.t)
    stretch = stretch_of(grid_of(locator), crossing.i, crossing.j, arc, crossing.begin, until)
    while True:
        entry = _next_overlapping(locator.boxes, entry, stop, stretch.probe)
        if entry >= stop:
            return best
        f: Any = np.int64(np.uint32(locator.ids[np.uintp(entry)]))  # a contact stores its facet in 64 bits
        entry += 1
        if f == left.facet or out_of_reach(facets, f, stretch):
            continue
        best = earlier_of(left, facets, f, arc, best)
        if best.t < until:
            until = best.t
            stretch = stretch_of(grid_of(locator), crossing.i, crossing.j, arc, crossing.begin, until)


@kernel
def _next_overlapping(boxes: Any, entry: int, stop: int, probe: int) -> int:
    """Return the next entry of a bucket with a facet whose box in plan overlaps the box of the arc; `stop` for none.

    An entry is one facet in one bucket.

    boxes : the packed box in plan of the facet of each entry (`plan_boxes.packed_box`)
    entry, stop : number of the first entry to test, and the number after the last entry of the bucket
    probe : the packed box of the arc over the bucket (`plan_boxes.packed_probe`)

    The code reads `boxes` with an unsigned index, so that compiled code need not handle negative indices.
    """
    while entry < stop and not overlap(boxes[np.uintp(entry)], probe):
        entry += 1
    return entry
