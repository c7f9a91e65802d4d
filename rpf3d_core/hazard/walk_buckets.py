"""Walk a track over facets bucket by bucket, whatever the terrain: overhangs, holes, one terrain above another.

What is under a rock is what lies straight below it, in plan: on a bench face as steep as 70 degrees a raster tells
little, the facets tell where it flew. A vertical facet has no plan; only an impact is a visit to it.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import position
from rpf3d_core.compiling import kernel
from rpf3d_core.detection.bucket_locator import grid_of
from rpf3d_core.detection.plan_boxes import overlap
from rpf3d_core.detection.stretch import probe_of
from rpf3d_core.hazard.ground import Ground
from rpf3d_core.hazard.over_facet import VERTICAL, largest_height, under
from rpf3d_core.hazard.tracks import Track, leaving_time, next_square, pace_of, square_at, time_at, top_speed2
from rpf3d_core.hazard.visits import Visits, note_height, note_track_energy, visit_for, visited
from rpf3d_core.simulation.parabola import ground_below
from rpf3d_core.terrain.facet_geometry import REACH, stored_normal

OVERLAP = 1e-9
"""Share of a stretch of track that two facets may seem to have in common by rounding."""
ROOM = 4096
"""Facets under one stretch of track at most: a bucket of survey terrain has a dozen."""


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
def walk_buckets(
    ground: Ground, spans: Spans, squares: Visits, facets: Visits, zones: Visits, track: Track, mass: float,
    begin: float,
) -> None:  # fmt: skip
    """Visit every facet that the track passes over from `begin` (s) on, and its zone; tell the squares its height."""
    locator, x, v = ground.locator, track.arc.x, track.arc.v
    i = square_at(x[0] + v[0] * begin, locator.x, locator.cell, locator.nx)
    j = square_at(x[1] + v[1] * begin, locator.y, locator.cell, locator.ny)
    pace_x, pace_y = pace_of(v[0]), pace_of(v[1])
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
    k = visit_for(facets, f, t, until, speed2, height, mass)
    note_track_energy(facets.energy2, k, track, low, high)
    k = visit_for(zones, ground.facets.zone[f], t, until, speed2, height, mass)
    note_track_energy(zones.energy2, k, track, low, high)
    _note_heights(ground, squares, track, f, low, high, height)


@kernel
def _spans_over(ground: Ground, spans: Spans, track: Track, i: int, j: int, begin: float, leave: float) -> int:
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
