"""Follow a path from facet to facet across shared sides, where no facet lies above another (a sheet).

This is faster than `buckets`, which works on any terrain. A track is a part of a path that is straight in plan. Each
corner of a facet lies to the left or right of the track's line in plan; a corner on the line counts as left. So the
line enters each facet through exactly one side and leaves the facet through exactly one other side. Two neighbouring
facets find equal bits for the crossing of their shared side, however thin the facets are.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import Arc
from rpf3d_core.detection.bucket_grid import cell_index
from rpf3d_core.detection.stretch import SLOWEST
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.ground import WalkedTerrain
from rpf3d_core.hazard.walks.over_facet import above_plane, along_across, crossing, largest_above
from rpf3d_core.hazard.walks.sheet import NOTHING, facet_beyond, is_alone
from rpf3d_core.hazard.walks.tracks import Track, leaving_time, next_square, pace_of, square_at
from rpf3d_core.hazard.walks.visits import Visits, note_height, visited
from rpf3d_core.hazard.walks.walk import Walk, visit_facet
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import REACH

NOWHERE = -1
"""Value in place of a facet's number: the path cannot be followed over the sheet from here."""


class FacetCrossing(NamedTuple):
    """How the line of a track crosses facet number f: the line leaves the facet through side k, the exit.

    al, cl : position of the exit's left corner along and across the line (`over_facet.along_across`), m^2/s
    ar, cr : position of the exit's right corner along and across the line, m^2/s
    """

    f: int
    k: int
    al: float
    cl: float
    ar: float
    cr: float


NO_CROSSING = FacetCrossing(f=NOWHERE, k=0, al=0.0, cl=0.0, ar=0.0, cr=0.0)
"""Value for no crossing of any facet."""


class Cursor(NamedTuple):
    """A map cell that lies below a track, and when the track leaves the cell.

    i, j : column and row of the cell
    leave_i, leave_j : times (s since the start of the track) at which the track leaves this column and this row
    visit : index of the rock's visit to the cell, -1 for none
    """

    i: int
    j: int
    leave_i: float
    leave_j: float
    visit: int


@kernel
def walk_sheet(walk: Walk, at: int) -> tuple[int, float]:
    """Record a visit to every facet, and its zone, that a track passes over; record the rock's height in map cells.

    at : the facet over which the track may begin, NOWHERE if unknown
    Returns the facet over which the track ends, and the time (s) until which the track was followed. If the track
    reaches a place where the terrain is not a sheet, or leaves the terrain, the facet is NOWHERE.
    """
    ground, track = walk.ground, walk.track
    arc = track.arc
    speed2, walked = arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1], 0.0
    passed = _crossing_from(ground, arc, at) if speed2 >= SLOWEST else NO_CROSSING
    if passed.f == NOWHERE:
        return NOWHERE, walked
    cursor = _cursor_at(ground.raster, walk.scratch.squares, track)
    for _ in range(len(ground.facets.zone)):  # a line crosses a facet only once
        leave = crossing(passed.al, passed.cl, passed.ar, passed.cr) / speed2
        until = min(leave, track.duration)
        if until > walked:
            cursor = _pass_over(walk, passed.f, walked, until, cursor)
            walked = until
        if leave >= track.duration:
            return passed.f, walked
        passed = _crossing_beyond(ground, arc, passed)
        if passed.f == NOWHERE:
            return NOWHERE, walked
    return NOWHERE, walked


@kernel
def _crossing_from(ground: WalkedTerrain, arc: Arc, at: int) -> FacetCrossing:
    """Return how an arc crosses the facet over which it begins; NO_CROSSING if no such facet is found.

    at : the facet that is tested first, NOWHERE for none; then the facets of the bucket are tested
    """
    passed = _crossing_over(ground, arc, at) if at != NOWHERE else NO_CROSSING
    locator = ground.locator
    i = cell_index(arc.x[0], locator.x, locator.cell, locator.nx)
    j = cell_index(arc.x[1], locator.y, locator.cell, locator.ny)
    entry, stop = locator.starts[j * locator.nx + i], locator.starts[j * locator.nx + i + 1]
    while passed.f == NOWHERE and entry < stop:
        f: Any = np.int64(locator.ids[np.uintp(entry)])
        passed = _crossing_over(ground, arc, f)
        entry += 1
    return passed


@kernel
def _crossing_over(ground: WalkedTerrain, arc: Arc, f: int) -> FacetCrossing:
    """Return how the line of an arc crosses facet f, if the line enters the facet at or before the start of the arc.

    Returns NO_CROSSING if the line enters facet f later or never, or if other facets lie above or below facet f.
    The line may also leave facet f before the start of the arc: `walk_sheet` then follows the line to the next facets.
    """
    facets = ground.facets
    a0, c0 = along_across(facets, f, 0, arc)
    a1, c1 = along_across(facets, f, 1, arc)
    a2, c2 = along_across(facets, f, 2, arc)
    passed, entry = NO_CROSSING, np.inf
    if c0 < 0.0 <= c1:
        passed = FacetCrossing(f=f, k=0, al=a1, cl=c1, ar=a0, cr=c0)
        entry = crossing(a2, c2, a0, c0) if c2 >= 0.0 else crossing(a1, c1, a2, c2)
    elif c1 < 0.0 <= c2:
        passed = FacetCrossing(f=f, k=1, al=a2, cl=c2, ar=a1, cr=c1)
        entry = crossing(a0, c0, a1, c1) if c0 >= 0.0 else crossing(a2, c2, a0, c0)
    elif c2 < 0.0 <= c0:
        passed = FacetCrossing(f=f, k=2, al=a0, cl=c0, ar=a2, cr=c2)
        entry = crossing(a1, c1, a2, c2) if c1 >= 0.0 else crossing(a0, c0, a1, c1)
    begun = entry <= 0.0 and is_alone(ground.sheet, ground.locator, facets, f)
    return passed if begun else NO_CROSSING


@kernel
def _crossing_beyond(ground: WalkedTerrain, arc: Arc, passed: FacetCrossing) -> FacetCrossing:
    """Return how the line of a track crosses the next facet, which shares the exit of the last facet (`passed`).

    Returns NO_CROSSING if no single next facet exists, or if other facets lie above or below this facet.
    In the code, f is the next facet, and m is the side of f at the exit: side m runs from the left to the right corner
    of the exit.
    """
    f, m = facet_beyond(ground.sheet, ground.locator, ground.facets, passed.f, passed.k)
    if f == NOTHING or not is_alone(ground.sheet, ground.locator, ground.facets, f):
        return NO_CROSSING
    third = m - 1 if m > 0 else 2
    a, c = along_across(ground.facets, f, third, arc)
    if c >= 0.0:
        return FacetCrossing(f=f, k=m + 1 if m < 2 else 0, al=a, cl=c, ar=passed.ar, cr=passed.cr)
    return FacetCrossing(f=f, k=third, al=passed.al, cl=passed.cl, ar=a, cr=c)


@kernel
def _pass_over(walk: Walk, f: int, low: float, high: float, cursor: Cursor) -> Cursor:
    """Record a visit to facet f, and its zone, from `low` to `high` (s), and return the cursor at the last map cell.

    The rock's largest height above f is recorded in each map cell on the way. A rock below f does not visit f.
    """
    ground, squares, track = walk.ground, walk.scratch.squares, walk.track
    c, b = above_plane(ground.facets, f, track.arc)
    gravity, begin, most = track.arc.gravity, low, -np.inf
    while True:
        leave = min(cursor.leave_i, cursor.leave_j)
        end = min(leave, high)
        if end >= begin:
            height = largest_above(c, b, gravity, begin, end)
            note_height(squares, cursor.visit, height)
            most, begin = max(most, height), end
        if leave >= high:
            break
        cursor = _next_cursor(ground.raster, squares, track, cursor)
    if most >= -REACH * ground.facets.tolerance:
        visit_facet(walk, f, low, high, most)
    return cursor


@kernel
def _cursor_at(raster: Raster, squares: Visits, track: Track) -> Cursor:
    """Return the `Cursor` at the map cell over which a track begins; squares : visits to map cells."""
    x, v = track.arc.x, track.arc.v
    i = square_at(x[0], raster.x, raster.cell, raster.nx)
    j = square_at(x[1], raster.y, raster.cell, raster.ny)
    return _cursor(raster, squares, track, i, j, pace_of(v[0]), pace_of(v[1]))


@kernel
def _next_cursor(raster: Raster, squares: Visits, track: Track, cursor: Cursor) -> Cursor:
    """Return the `Cursor` at the map cell that a track reaches next; squares : visits to map cells."""
    v = track.arc.v
    i, j = next_square(cursor.i, cursor.j, cursor.leave_i, cursor.leave_j, v)
    return _cursor(raster, squares, track, i, j, pace_of(v[0]), pace_of(v[1]))


@kernel
def _cursor(raster: Raster, squares: Visits, track: Track, i: int, j: int, pace_x: float, pace_y: float) -> Cursor:
    """Return the `Cursor` at the map cell in column i and row j; pace_x, pace_y : s/m along x and y, from `pace_of`."""
    x = track.arc.x
    leave_i = leaving_time(i, raster.nx, raster.x, raster.cell, x[0], pace_x)
    leave_j = leaving_time(j, raster.ny, raster.y, raster.cell, x[1], pace_y)
    return Cursor(i=i, j=j, leave_i=leave_i, leave_j=leave_j, visit=visited(squares, j * raster.nx + i))
