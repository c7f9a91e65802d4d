"""Walk a track over what lies under it: squares of a raster, facets, zones. Exact times, no samples.

What is under a rock is what lies straight below it, in plan: on a bench face as steep as 70 degrees a raster tells
little, the facets tell where it flew. A vertical facet has no plan; only an impact is a visit to it.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import Arc, position
from rpf3d_core.compiling import kernel
from rpf3d_core.detection.bucket_locator import BucketLocator, grid_of
from rpf3d_core.detection.plan_boxes import overlap
from rpf3d_core.detection.stretch import SLOWEST, probe_of
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.tracks import Track, leaving_time, next_square, pace_of, square_at, time_at, top_speed2
from rpf3d_core.hazard.visits import Visits, note_height, note_stay, visit, visited
from rpf3d_core.simulation.march import ground_below
from rpf3d_core.terrain.facet_geometry import REACH, corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, subtract

OVERLAP = 1e-9
"""Share of a stretch of track that two facets may seem to have in common by rounding."""
VERTICAL = 1e-7
"""Cosine of the angle to the vertical below which a facet has no plan: 20 m of wall would be 2 um wide there, and the
height above its plane nothing but rounding."""
ROOM = 4096
"""Facets under one stretch of track at most: a bucket of survey terrain has a dozen."""


class Ground(NamedTuple):
    """What a track is walked over: the terrain with its buckets, and the raster of the maps."""

    facets: Facets
    locator: BucketLocator
    raster: Raster


class Spans(NamedTuple):
    """Scratch: facets under a stretch of track.

    facet : (M,); times : (M, 3) from when to when it is over each (s into the track), and how high above it at most (m)
    cuts : (2 M,) these times in order
    """

    facet: Any
    times: Any
    cuts: Any


def empty_spans() -> Spans:
    """Room for the facets under a stretch of track."""
    return Spans(np.empty(ROOM, dtype=np.int64), np.empty((ROOM, 3)), np.empty(2 * ROOM))


@kernel
def walk_raster(raster: Raster, visits: Visits, track: Track, mass: float) -> None:
    """Visit every square that the track crosses; one that it touches at a corner only is not visited."""
    x, v = track.arc.x, track.arc.v
    i = square_at(x[0], raster.x, raster.cell, raster.nx)
    j = square_at(x[1], raster.y, raster.cell, raster.ny)
    begin, pace_x, pace_y, here = 0.0, pace_of(v[0]), pace_of(v[1]), True
    while True:
        leave_i = leaving_time(i, raster.nx, raster.x, raster.cell, x[0], pace_x)
        leave_j = leaving_time(j, raster.ny, raster.y, raster.cell, x[1], pace_y)
        leave = min(leave_i, leave_j, track.duration)
        if leave > begin or here:
            t = time_at(track, begin)
            k = visit(visits, j * raster.nx + i, t, mass)
            note_stay(visits, k, t, time_at(track, max(begin, leave)), top_speed2(track, begin, leave))
        if leave >= track.duration:
            return
        begin, here = max(begin, leave), False
        i, j = next_square(i, j, leave_i, leave_j, v)


@kernel
def walk_facets(
    ground: Ground, spans: Spans, squares: Visits, facets: Visits, zones: Visits, track: Track, mass: float
) -> None:
    """Visit every facet that the track passes over, and its zone; tell the squares how high above it the rock was."""
    locator, x, v = ground.locator, track.arc.x, track.arc.v
    i = square_at(x[0], locator.x, locator.cell, locator.nx)
    j = square_at(x[1], locator.y, locator.cell, locator.ny)
    begin, pace_x, pace_y = 0.0, pace_of(v[0]), pace_of(v[1])
    while True:
        leave_i = leaving_time(i, locator.nx, locator.x, locator.cell, x[0], pace_x)
        leave_j = leaving_time(j, locator.ny, locator.y, locator.cell, x[1], pace_y)
        leave = min(leave_i, leave_j, track.duration)
        if leave > begin:
            _visit_bucket(ground, spans, squares, facets, zones, track, mass, i, j, begin, leave)
        if leave >= track.duration:
            return
        begin = max(begin, leave)
        i, j = next_square(i, j, leave_i, leave_j, v)


@kernel
def _visit_bucket(
    ground: Ground, spans: Spans, squares: Visits, facets: Visits, zones: Visits, track: Track, mass: float,
    i: int, j: int, begin: float, leave: float,
) -> None:  # fmt: skip
    """Visit the facets under the stretch of track that lies over the bucket in column i and row j."""
    used = _spans_over(ground, spans, track, i, j, begin, leave)
    if _overlapping(spans, used, OVERLAP * (leave - begin)):
        _visit_what_is_below(ground, spans, used, squares, facets, zones, track, mass)
        return
    for s in range(used):
        low, high, height = spans.times[s, 0], spans.times[s, 1], spans.times[s, 2]
        _visit_span(ground, squares, facets, zones, track, mass, spans.facet[s], low, high, height)


@kernel
def _visit_what_is_below(
    ground: Ground, spans: Spans, used: int, squares: Visits, facets: Visits, zones: Visits, track: Track, mass: float
) -> None:
    """Where facets overlap in plan (an overhang, two terrains, a track on an edge) only what is straight below counts.

    That changes only where one of them begins or ends: in between it is asked once.
    """
    cuts = _sorted_cuts(spans, used)
    for c in range(cuts - 1):
        low, high = spans.cuts[c], spans.cuts[c + 1]
        if high > low:
            f = ground_below(ground.locator, ground.facets, position(track.arc, 0.5 * (low + high)))[1].facet
            if f >= 0 and abs(stored_normal(ground.facets, f)[2]) > VERTICAL:
                height = largest_height(ground.facets, f, track.arc, low, high)
                _visit_span(ground, squares, facets, zones, track, mass, f, low, high, height)


@kernel
def _sorted_cuts(spans: Spans, used: int) -> int:
    """Put the times at which spans begin and end in order; how many."""
    for s in range(2 * used):
        time, k = spans.times[s // 2, s % 2], s
        while k > 0 and spans.cuts[k - 1] > time:
            spans.cuts[k] = spans.cuts[k - 1]
            k -= 1
        spans.cuts[k] = time
    return 2 * used


@kernel
def _overlapping(spans: Spans, used: int, slack: float) -> bool:
    """Whether two of the spans have more than `slack` (s) in common."""
    for s in range(used):
        for r in range(s):
            if min(spans.times[s, 1], spans.times[r, 1]) - max(spans.times[s, 0], spans.times[r, 0]) > slack:
                return True
    return False


@kernel
def _visit_span(
    ground: Ground, squares: Visits, facets: Visits, zones: Visits, track: Track, mass: float,
    f: int, low: float, high: float, height: float,
) -> None:  # fmt: skip
    """Visit facet f and its zone between two times of a track (s), in which it is `height` (m) above f at most."""
    speed2, t, until = top_speed2(track, low, high), time_at(track, low), time_at(track, high)
    k = visit(facets, f, t, mass)
    note_stay(facets, k, t, until, speed2)
    note_height(facets, k, height)
    k = visit(zones, ground.facets.zone[f], t, mass)
    note_stay(zones, k, t, until, speed2)
    note_height(zones, k, height)
    _note_heights(ground, squares, track, f, low, high, height)


@kernel
def _spans_over(
    ground: Ground, spans: Spans, track: Track, i: int, j: int, begin: float, leave: float
) -> int:
    """Find the facets of a bucket that lie under a stretch of track, and are not above it as a roof is; how many."""
    locator, facets, arc = ground.locator, ground.facets, track.arc
    bucket = j * locator.nx + i
    probe = probe_of(grid_of(locator), i, j, position(arc, begin), position(arc, leave))
    used = 0
    for entry in range(locator.starts[bucket], locator.starts[bucket + 1]):
        if not overlap(locator.boxes[np.uintp(entry)], probe):
            continue
        f: Any = np.int64(locator.ids[np.uintp(entry)])
        low, high = under(facets, f, arc, begin, leave)
        if high <= low or used == len(spans.facet):
            continue
        height = largest_height(facets, f, arc, low, high)
        if height < -REACH * facets.tolerance:
            continue
        spans.facet[used], spans.times[used, 0], spans.times[used, 1], spans.times[used, 2] = f, low, high, height
        used += 1
    return used


@kernel
def under(facets: Facets, f: int, arc: Arc, begin: float, end: float) -> tuple[float, float]:
    """From when to when, between two times (s), an arc passes over facet f in plan; the end before the begin if never.

    The straight line that the arc is in plan enters and leaves a triangle through those edges whose ends lie on either
    side of it; where it does is told from the places of the two ends along and across the line.
    """
    if abs(stored_normal(facets, f)[2]) <= VERTICAL:
        return math.inf, -math.inf
    speed2 = arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1]
    if speed2 < SLOWEST:
        return (begin, end) if _holds(facets, f, arc.x) else (math.inf, -math.inf)
    a0, c0 = _along_across(facets, f, 0, arc)
    a1, c1 = _along_across(facets, f, 1, arc)
    a2, c2 = _along_across(facets, f, 2, arc)
    if min(c0, c1, c2) >= 0.0 or max(c0, c1, c2) < 0.0:
        return math.inf, -math.inf
    first = _crossing(a0, c0, a1, c1) if (c0 >= 0.0) != (c1 >= 0.0) else _crossing(a1, c1, a2, c2)
    second = _crossing(a2, c2, a0, c0) if (c2 >= 0.0) != (c0 >= 0.0) else _crossing(a1, c1, a2, c2)
    per_second = 1.0 / speed2
    return max(min(first, second) * per_second, begin), min(max(first, second) * per_second, end)


@kernel
def _along_across(facets: Facets, f: int, k: int, arc: Arc) -> tuple[float, float]:
    """Place of corner k of facet f along the line of an arc in plan and to its left, from its start (m^2/s)."""
    p = corner(facets, f, k)
    x, y = p[0] - arc.x[0], p[1] - arc.x[1]
    return x * arc.v[0] + y * arc.v[1], y * arc.v[0] - x * arc.v[1]


@kernel
def _crossing(a: float, across_a: float, b: float, across_b: float) -> float:
    """Place along the line at which it crosses an edge, from the places of its ends along and across it.

    The same whichever end comes first, so neighbours agree on where the one ends and the other begins.
    """
    if across_a < across_b:
        a, across_a, b, across_b = b, across_b, a, across_a
    return a + (b - a) * (across_a / (across_a - across_b))


@kernel
def _holds(facets: Facets, f: int, x: Vec) -> bool:
    """Whether a point lies over facet f in plan, its rim included."""
    side = math.copysign(1.0, stored_normal(facets, f)[2])
    for k in range(3):
        a, b = corner(facets, f, k), corner(facets, f, (k + 1) % 3)
        if side * ((b[0] - a[0]) * (x[1] - a[1]) - (b[1] - a[1]) * (x[0] - a[0])) < 0.0:
            return False
    return True


@kernel
def largest_height(facets: Facets, f: int, arc: Arc, low: float, high: float) -> float:
    """Largest vertical height (m) of an arc above the plane of f between two times: at one of them, or in between.

    Negative for an arc that stays below the plane.
    The height is c + b t - g t^2 / 2, so it is largest where b = g t.
    """
    n = stored_normal(facets, f)
    c = dot(n, subtract(arc.x, corner(facets, f, 0))) / n[2]
    b = dot(n, arc.v) / n[2]
    g = arc.gravity
    height = max(c + (b - 0.5 * g * low) * low, c + (b - 0.5 * g * high) * high)
    if g > 0.0 and low * g < b < high * g:
        height = max(height, c + 0.5 * b * b / g)
    return height


@kernel
def _note_heights(ground: Ground, squares: Visits, track: Track, f: int, low: float, high: float, most: float) -> None:
    """Tell the squares between two times of a track how high above facet f the rock was in each.

    most : the largest of these heights (m), which a track that stays in one square had there
    """
    raster, x, v = ground.raster, track.arc.x, track.arc.v
    i = square_at(x[0] + v[0] * low, raster.x, raster.cell, raster.nx)
    j = square_at(x[1] + v[1] * low, raster.y, raster.cell, raster.ny)
    begin, pace_x, pace_y = low, pace_of(v[0]), pace_of(v[1])
    while True:
        leave_i = leaving_time(i, raster.nx, raster.x, raster.cell, x[0], pace_x)
        leave_j = leaving_time(j, raster.ny, raster.y, raster.cell, x[1], pace_y)
        leave = min(leave_i, leave_j, high)
        k = visited(squares, j * raster.nx + i)
        if k >= 0 and leave >= begin:
            whole = begin == low and leave == high
            note_height(squares, k, most if whole else largest_height(ground.facets, f, track.arc, begin, leave))
        if leave >= high:
            return
        begin = max(begin, leave)
        i, j = next_square(i, j, leave_i, leave_j, v)
