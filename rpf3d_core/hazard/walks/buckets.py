"""Walk a track over facets bucket by bucket, on any terrain: overhangs, holes, one terrain above another.

The facet under a rock is the facet straight below it in plan. On a bench face as steep as 70 degrees a raster shows
little; the facets show where the rock flew. A vertical facet has no area in plan: only an impact is a visit to it.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import position
from rpf3d_core.detection.bucket_locator import grid_of
from rpf3d_core.detection.plan_boxes import overlap
from rpf3d_core.detection.stretch import probe_of
from rpf3d_core.hazard.walks.ground import WalkedTerrain
from rpf3d_core.hazard.walks.over_facet import VERTICAL, largest_height, under
from rpf3d_core.hazard.walks.tracks import Track, leaving_time, next_square, pace_of, square_at, time_at, top_speed2
from rpf3d_core.hazard.walks.visits import Visits, note_height, note_track_energy, visit_for, visited
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.simulation.parabola import ground_below
from rpf3d_core.terrain.facet_geometry import REACH, stored_normal

OVERLAP = 1e-9
"""Share of the duration of a part of a track by which two facets may seem to overlap because of rounding."""
ROOM = 4096
"""Most facets under a part of a track over one bucket: a bucket of survey terrain has a dozen."""


class Spans(NamedTuple):
    """Scratch: the facets under a part of a track.

    facet : (M,); times : (M, 3) begin and end over each facet (s into the track), and largest height above it (m)
    cuts : (2 M,) begins and ends in order
    """

    facet: Any
    times: Any
    cuts: Any


def empty_spans() -> Spans:
    """Return room for the facets under a part of a track."""
    return Spans(np.empty(ROOM, dtype=np.int64), np.empty((ROOM, 3)), np.empty(2 * ROOM))


@kernel
def walk_buckets(
    ground: WalkedTerrain, spans: Spans, squares: Visits, facets: Visits, zones: Visits, track: Track, mass: float,
    begin: float,
) -> None:  # fmt: skip
    """Visit every facet that the track passes over from `begin` (s) on, and its zone; record heights in the squares."""
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
    ground: WalkedTerrain, spans: Spans, squares: Visits, facets: Visits, zones: Visits, track: Track, mass: float,
    i: int, j: int, begin: float, leave: float,
) -> None:  # fmt: skip
    """Visit the facets under the part of the track that lies over the bucket in column i and row j."""
    used = _spans_over(ground, spans, track, i, j, begin, leave)
    if _overlapping(spans, used, OVERLAP * (leave - begin)):
        _visit_what_is_below(ground, spans, used, squares, facets, zones, track, mass)
        return
    for s in range(used):
        low, high, height = spans.times[s, 0], spans.times[s, 1], spans.times[s, 2]
        _visit_span(ground, squares, facets, zones, track, mass, spans.facet[s], low, high, height)


@kernel
def _visit_what_is_below(
    ground: WalkedTerrain,
    spans: Spans,
    used: int,
    squares: Visits,
    facets: Visits,
    zones: Visits,
    track: Track,
    mass: float,
) -> None:
    """Visit only the facets straight below, where facets overlap in plan: overhang, two terrains, track on an edge.

    The facet straight below changes only where a facet begins or ends: between these times one query is enough.
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
    """Sort the times at which spans begin and end into `cuts`; return their number."""
    for s in range(2 * used):
        time, k = spans.times[s // 2, s % 2], s
        while k > 0 and spans.cuts[k - 1] > time:
            spans.cuts[k] = spans.cuts[k - 1]
            k -= 1
        spans.cuts[k] = time
    return 2 * used


@kernel
def _overlapping(spans: Spans, used: int, slack: float) -> bool:
    """True if two of the spans overlap by more than `slack` (s)."""
    for s in range(used):
        for r in range(s):
            if min(spans.times[s, 1], spans.times[r, 1]) - max(spans.times[s, 0], spans.times[r, 0]) > slack:
                return True
    return False


@kernel
def _visit_span(
    ground: WalkedTerrain, squares: Visits, facets: Visits, zones: Visits, track: Track, mass: float,
    f: int, low: float, high: float, height: float,
) -> None:  # fmt: skip
    """Visit facet f and its zone between two times of a track (s), during which it is at most `height` (m) above f."""
    speed2, t, until = top_speed2(track, low, high), time_at(track, low), time_at(track, high)
    k = visit_for(facets, f, t, until, speed2, height, mass)
    note_track_energy(facets.energy2, k, track, low, high)
    k = visit_for(zones, ground.facets.zone[f], t, until, speed2, height, mass)
    note_track_energy(zones.energy2, k, track, low, high)
    _note_heights(ground, squares, track, f, low, high, height)


@kernel
def _spans_over(ground: WalkedTerrain, spans: Spans, track: Track, i: int, j: int, begin: float, leave: float) -> int:
    """Find the facets of a bucket under a part of a track, but not those above the track; return their number."""
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
def _note_heights(
    ground: WalkedTerrain, squares: Visits, track: Track, f: int, low: float, high: float, most: float
) -> None:
    """Record in the squares between two times of a track how high the rock was above facet f in each.

    most : the largest of these heights (m), which applies to a track that stays in one square
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
