"""Follow a path over facets by searching square by square, on any terrain: the slow way, for overhangs and holes.

A bucket is a square of the search structure, with the list of facets in it. The facet under a rock is the facet
straight below it in plan. On a bench face as steep as 70 degrees a raster shows little; the facets show where the rock
flew. A vertical facet has no area in plan: only an impact is a visit to it.
"""

from typing import Any

import numpy as np

from rpf3d_core.arc import position
from rpf3d_core.detection.bucket_locator import grid_of
from rpf3d_core.detection.plan_boxes import overlap
from rpf3d_core.detection.stretch import probe_of
from rpf3d_core.hazard.walks.ground import WalkedTerrain
from rpf3d_core.hazard.walks.over_facet import VERTICAL, largest_height, under
from rpf3d_core.hazard.walks.tracks import Track, leaving_time, next_square, pace_of, square_at
from rpf3d_core.hazard.walks.visits import Visits, note_height, visited
from rpf3d_core.hazard.walks.walk import Spans, Walk, visit_facet
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.simulation.parabola import ground_below
from rpf3d_core.terrain.facet_geometry import REACH, stored_normal

OVERLAP = 1e-9
"""Share of a part's duration (-) by which two facets may seem to overlap because of rounding."""


@kernel
def walk_buckets(walk: Walk, begin: float) -> None:
    """Record a visit to every facet, and its zone, that a track passes over from `begin` (s) on, and the heights."""
    ground, track = walk.ground, walk.track
    locator, x, v = ground.locator, track.arc.x, track.arc.v
    i = square_at(x[0] + v[0] * begin, locator.x, locator.cell, locator.nx)
    j = square_at(x[1] + v[1] * begin, locator.y, locator.cell, locator.ny)
    pace_x, pace_y = pace_of(v[0]), pace_of(v[1])
    while True:
        leave_i = leaving_time(i, locator.nx, locator.x, locator.cell, x[0], pace_x)
        leave_j = leaving_time(j, locator.ny, locator.y, locator.cell, x[1], pace_y)
        leave = min(leave_i, leave_j, track.duration)
        if leave > begin:
            _visit_bucket(walk, i, j, begin, leave)
        if leave >= track.duration:
            return
        begin = max(begin, leave)
        i, j = next_square(i, j, leave_i, leave_j, v)


@kernel
def _visit_bucket(walk: Walk, i: int, j: int, begin: float, leave: float) -> None:
    """Record visits to the facets under the part of the track over the bucket in column i and row j."""
    spans = walk.scratch.spans
    used = _spans_over(walk.ground, spans, walk.track, i, j, begin, leave)
    if _overlapping(spans, used, OVERLAP * (leave - begin)):
        _visit_what_is_below(walk, used)
        return
    for s in range(used):
        low, high, height = spans.times[s, 0], spans.times[s, 1], spans.times[s, 2]
        _visit_span(walk, spans.facet[s], low, high, height)


@kernel
def _visit_what_is_below(walk: Walk, used: int) -> None:
    """Record visits where facets lie above each other: only to the facet straight below the track at each time.

    Facets overlap at an overhang, if one terrain lies above another, or if the track runs along an edge. The facet
    straight below changes only where a facet begins or ends: between two such times, one query is enough.
    """
    ground, track, spans = walk.ground, walk.track, walk.scratch.spans
    cuts = _sorted_cuts(spans, used)
    for c in range(cuts - 1):
        low, high = spans.cuts[c], spans.cuts[c + 1]
        if high > low:
            f = ground_below(ground.locator, ground.facets, position(track.arc, 0.5 * (low + high)))[1].facet
            if f >= 0 and abs(stored_normal(ground.facets, f)[2]) > VERTICAL:
                height = largest_height(ground.facets, f, track.arc, low, high)
                _visit_span(walk, f, low, high, height)


@kernel
def _sorted_cuts(spans: Spans, used: int) -> int:
    """Sort the times at which the track enters and leaves facets into `spans.cuts`; return their number."""
    for s in range(2 * used):
        time, k = spans.times[s // 2, s % 2], s
        while k > 0 and spans.cuts[k - 1] > time:
            spans.cuts[k] = spans.cuts[k - 1]
            k -= 1
        spans.cuts[k] = time
    return 2 * used


@kernel
def _overlapping(spans: Spans, used: int, slack: float) -> bool:
    """True if the track is over two facets at once for more than `slack` (s)."""
    for s in range(used):
        for r in range(s):
            if min(spans.times[s, 1], spans.times[r, 1]) - max(spans.times[s, 0], spans.times[r, 0]) > slack:
                return True
    return False


@kernel
def _visit_span(walk: Walk, f: int, low: float, high: float, height: float) -> None:
    """Record a visit to facet f, and its zone, between two times of a track (s), and the height in map cells.

    height : largest height (m) above facet f between the two times
    """
    visit_facet(walk, f, low, high, height)
    _note_heights(walk.ground, walk.scratch.squares, walk.track, f, low, high, height)


@kernel
def _spans_over(ground: WalkedTerrain, spans: Spans, track: Track, i: int, j: int, begin: float, leave: float) -> int:
    """Find the facets of a bucket that lie below a part of a track; return their number."""
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
    """Record in each map cell that a track crosses between two times (s) its largest height above facet f there.

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
