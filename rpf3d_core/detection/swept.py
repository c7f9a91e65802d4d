"""Find the contacts of a flying sphere: a locator for lumped masses searches boxes that are widened by the radius."""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import Arc
from rpf3d_core.detection.bucket_grid import CellRectangle, Grid, cell_index, cells_between
from rpf3d_core.detection.bucket_locator import BucketLocator, grid_of
from rpf3d_core.detection.contact import PreviousContact, first_contact, plain_locator, radius_of
from rpf3d_core.detection.slabs import LEVELS, SHIFT, flies_over, width_of
from rpf3d_core.detection.sphere_course import NO_TOUCH, Course, Touch, course_position, course_velocity
from rpf3d_core.detection.touching import SphereSweep, looked_at, scan
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.terrain.facet_geometry import REACH, corner
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import norm

WIDEST = 2.0
"""Largest length of a stretch of flight, divided by the width of cells (-), for which slabs of these cells are used.

A longer stretch is compared with the slabs of wider cells.
"""


class SweptStretch(NamedTuple):
    """A stretch of a sphere's flight from time `begin` to `leave` (s), on which the centre moves at most `length` (m).

    low, high : corners (3,) m of the box around the volume that the sphere passes through
    """

    begin: float
    leave: float
    length: float
    low: Vec
    high: Vec


class Swept(NamedTuple):
    """A locator for contacts of a sphere: a locator for lumped masses together with the sphere's radius (m)."""

    locator: Any
    radius: float


@radius_of.rule(Swept)
def swept_radius(locator: Swept) -> float:
    """Return the radius (m) of the sphere whose contacts the locator searches."""
    return locator.radius


@plain_locator.rule(Swept)
def swept_locator(locator: Swept) -> Any:
    """Return the locator for lumped masses that the sphere's locator uses inside."""
    return locator.locator


@model_function
def swept_contact(locator: object, facets: Facets, course: Course, end: float) -> Touch:
    """Return the first contact of a sphere in free flight up to the time `end` (s); one rule per locator.

    Without such a contact, the result is NO_TOUCH, or a contact later than `end`.

    course : motion of the sphere's centre
    """


@first_contact.rule(Swept)
def first_touch(locator: Swept, facets: Facets, arc: Arc, left: PreviousContact, end: float) -> Touch:
    """Return the first contact of a flying sphere up to the time `end` (s), as `swept_contact` does.

    left : not used, because the contact search for spheres needs no previous contact (`sphere_contact`)
    """
    down = (0.0, 0.0, -arc.gravity)
    course = Course(x=arc.x, v=arc.v, a=down, radius=locator.radius, gravity=arc.gravity)
    return swept_contact(locator.locator, facets, course, end)  # type: ignore[no-any-return]


@kernel
def stretch_end(course: Course, begin: float, length: float, end: float) -> float:
    """Return a time (s), at most `end`, up to which a sphere's centre moves at most `length` (m) after `begin` (s).

    Exception: the result is `end` if the time would not be later than `begin`, because of rounding or a length of 0.
    """
    speed, pull = norm(course_velocity(course, begin)), norm(course.a)
    pace = speed + math.sqrt(speed * speed + 2.0 * pull * length)
    leave = begin + 2.0 * length / pace if pace > 0.0 else end
    return min(leave, end) if leave > begin else end


@kernel
def box_of(course: Course, begin: float, end: float, slack: float) -> tuple[Vec, Vec]:
    """Return the box to search around a sphere's path from `begin` to `end` (s), as its low and high corner (3,) m.

    The box includes the radius of the sphere, and is widened by the slack (m).
    """
    p, q, lasts = course_position(course, begin), course_position(course, end), end - begin
    a, wide = course.a, course.radius + slack
    sag = (0.125 * lasts * lasts * abs(a[0]), 0.125 * lasts * lasts * abs(a[1]), 0.125 * lasts * lasts * abs(a[2]))
    low = (
        min(p[0], q[0]) - sag[0] - wide, min(p[1], q[1]) - sag[1] - wide, min(p[2], q[2]) - sag[2] - wide,
    )  # fmt: skip
    high = (
        max(p[0], q[0]) + sag[0] + wide, max(p[1], q[1]) + sag[1] + wide, max(p[2], q[2]) + sag[2] + wide,
    )  # fmt: skip
    return low, high


@swept_contact.rule(BucketLocator)
def swept_over_buckets(locator: BucketLocator, facets: Facets, course: Course, end: float) -> Touch:
    """Return the first contact of a flying sphere, searched stretch by stretch.

    While the sphere stays above all slabs, the stretches double in length.

    course : motion of the sphere's centre; end : s, finite, later contacts need not be found
    """
    base = max(locator.cell, course.radius)
    best, begin, length, slack = NO_TOUCH, 0.0, base, REACH * facets.tolerance
    while True:
        leave = stretch_end(course, begin, length, end)
        low, high = box_of(course, begin, leave, slack)
        stretch = SweptStretch(begin=begin, leave=leave, length=length, low=low, high=high)
        if _sweeps_over(locator, course, stretch, slack):
            length = 2.0 * length
        elif length > base:
            length = max(0.25 * length, base)
            continue
        else:
            best = scan(locator, facets, low, high, SphereSweep(course=course, end=end, before=leave), best)
        if best.t <= leave or not leave < end:
            return best
        begin = leave


@kernel
def _sweeps_over(locator: BucketLocator, course: Course, stretch: SweptStretch, slack: float) -> bool:
    """Return True if the sphere stays above the slabs of all cells under a stretch by more than the slack (m)."""
    level, width = 0, locator.cell
    while level < LEVELS - 1 and width * WIDEST < stretch.length:
        level, width = level + 1, width * (1 << SHIFT)
    p, q = course_position(course, stretch.begin), course_position(course, stretch.leave)
    columns, rows = width_of(locator.nx, level), width_of(locator.ny, level)
    wide = Grid(x=locator.x, y=locator.y, cell=width, nx=columns, ny=rows)
    cells = cells_between(wide, stretch.low[0], stretch.low[1], stretch.high[0], stretch.high[1])
    for j in range(cells.bottom, cells.top):
        for i in range(cells.left, cells.right):
            if not flies_over(locator.slabs, level, j * columns + i, p, q, course.radius + slack):
                return False
    return True


@scan.rule(BucketLocator)
def scan_buckets(locator: BucketLocator, facets: Facets, low: Vec, high: Vec, quest: Any, best: Touch) -> Touch:
    """Return the best result of a search among the facets in a box; each facet is tested in its first bucket only.

    quest : the search (`touching.py`); low, high : corners (3,) m of the box; best : the best result so far
    """
    cells = cells_between(grid_of(locator), low[0], low[1], high[0], high[1])
    for j in range(cells.bottom, cells.top):
        for i in range(cells.left, cells.right):
            k = j * locator.nx + i
            for entry in range(locator.starts[k], locator.starts[k + 1]):
                f: Any = np.int64(locator.ids[entry])
                if _reaches_into(facets, f, low, high) and _first_shared(locator, facets, f, cells, i, j):
                    best = looked_at(quest, facets, f, best)
    return best


@kernel
def _reaches_into(facets: Facets, f: int, low: Vec, high: Vec) -> bool:
    """Return True if the box of facet f overlaps the box between the corners `low` and `high` (3,) m."""
    a, b, c = corner(facets, f, 0), corner(facets, f, 1), corner(facets, f, 2)
    for k in range(3):  # noqa: SIM110  (all() of a generator does not compile)
        if min(a[k], b[k], c[k]) > high[k] or max(a[k], b[k], c[k]) < low[k]:
            return False
    return True


@kernel
def _first_shared(locator: BucketLocator, facets: Facets, f: int, cells: CellRectangle, i: int, j: int) -> bool:
    """Return True if a search must test facet f in the cell in column i and row j, to test each facet only once.

    A facet is tested in the first of the visited cells that its box touches.

    cells : rectangle of cells that the search visits
    """
    a, b, c = corner(facets, f, 0), corner(facets, f, 1), corner(facets, f, 2)
    column = cell_index(min(a[0], b[0], c[0]), locator.x, locator.cell, locator.nx)
    row = cell_index(min(a[1], b[1], c[1]), locator.y, locator.cell, locator.ny)
    return i == max(column, cells.left) and j == max(row, cells.bottom)
