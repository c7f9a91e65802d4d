"""Follow a path over facets by searching square by square, on any terrain, also with overhangs and holes.

This is slower than `along_sheet`. A bucket is a square of the search structure, with the list of facets in it. A rock
visits the facet straight below it. A vertical facet has no area in plan, so it is visited only by impacts. Maps of
facets show where rocks pass a steep bench face; on a raster in plan, such a face is very narrow.
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
"""Share (-) of the time over a bucket for which two facets may seem to overlap because of rounding."""


@kernel
def walk_buckets(walk: Walk, begin: float) -> None:
    """Record a visit to every facet, and its zone, that a track passes over from `begin` (s) on.

    The rock's largest heights above the facets are recorded in the map cells, too.
    """
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
    """Record visits to the facets below the part of a track over one bucket (search square), in column i and row j.

    begin, leave : times (s) at which the track enters and leaves the bucket
    """
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
    """Record visits where facets of a bucket overlap in plan: at each time, only to the facet straight below the rock.

    Facets overlap at an overhang, if one terrain lies above another, or if the track runs along an edge. The facet
    straight below changes only where the track enters or leaves a facet: between two such times, one query is enough.

    used : number of facets in `Walk.scratch.spans`
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
    """Write the times at which the track enters and leaves facets to `spans.cuts`, ascending; return their number.

    used : number of facets in `spans`
    """
    for s in range(2 * used):
        time, k = spans.times[s // 2, s % 2], s
        while k > 0 and spans.cuts[k - 1] > time:
            spans.cuts[k] = spans.cuts[k - 1]
            k -= 1
        spans.cuts[k] = time
    return 2 * used


@kernel
def _overlapping(spans: Spans, used: int, slack: float) -> bool:
    """Return True if a track is over two facets of `spans` at once for more than `slack` (s).

    used : number of facets in `spans`
    """
    for s in range(used):
        for r in range(s):
            if min(spans.times[s, 1], spans.times[r, 1]) - max(spans.times[s, 0], spans.times[r, 0]) > slack:
                return True
    return False


@kernel
def _visit_span(walk: Walk, f: int, low: float, high: float, height: float) -> None:
    """Record a visit to facet f, and its zone, between two times of a track (s), and the height in map cells.

    low, high : the two times; height : largest height (m) above facet f between the two times
    """
    visit_facet(walk, f, low, high, height)
    _note_heights(walk.ground, walk.scratch.squares, walk.track, f, low, high, height)


@kernel
def _spans_over(ground: WalkedTerrain, spans: Spans, track: Track, i: int, j: int, begin: float, leave: float) -> int:
    """Write each facet below a track over one bucket (search square) to `spans`, with times and largest height.

    Return the number of facets written. A facet is not written if it lies above the track, or if `spans` is full.

    i, j : column and row of the bucket; begin, leave : times (s) at which the track enters and leaves the bucket
    """
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
    """Record the rock's largest height above facet f in each map cell that its track crosses from `low` to `high` (s).

    Only cells that the rock has visited are changed.

    most : the largest of these heights (m), which is already known; it is recorded if the track crosses only one cell
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
