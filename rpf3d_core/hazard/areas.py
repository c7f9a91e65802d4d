"""Find from when to when a rock's path lies inside areas of interest, from exact crossings instead of map cells.

A track is a part of a path that is straight in plan. The times at which a track crosses the outlines of an area,
including the outlines of holes, are computed exactly. Between two crossings, the track is either inside or outside the
area.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import position
from rpf3d_core.hazard.walks.tracks import Track, time_at, top_speed2
from rpf3d_core.hazard.walks.visits import Visits, note_stay, note_track_energy, visit
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Vec


class Areas(NamedTuple):
    """The outlines of A areas of interest with E edges in total, local frame, in the form that compiled loops read.

    edges : (E, 4) m, x and y of the start and of the end of each edge
    first : (A + 1,) index of the first edge of each area, and E at the end
    boxes : (A, 4) m, lowest x and y, highest x and y of each area
    crossings : (E,) working memory for the times (s) at which a track crosses the outlines
    """

    edges: Any
    first: Any
    boxes: Any
    crossings: Any


def areas_of(outlines: Mapping[str, Sequence[FloatArray]]) -> Areas:
    """Return areas of interest in the form that compiled loops read.

    outlines : for each area, its closed outline and the outlines of its holes, each (P, 2) m, local frame. The last
        point of an outline may repeat the first.
    """
    edges = [np.concatenate([_edges(ring) for ring in rings]) for rings in outlines.values()]
    first = np.concatenate([[0], np.cumsum([len(some) for some in edges])]).astype(np.int64)
    joined = np.concatenate(edges) if edges else np.empty((0, 4))
    boxes = [[*some[:, :2].min(axis=0), *some[:, :2].max(axis=0)] for some in edges]
    return Areas(edges=joined, first=first, boxes=np.array(boxes).reshape(-1, 4), crossings=np.empty(len(joined)))


def _edges(ring: FloatArray) -> FloatArray:
    """Return the edges (P, 4) m of a closed outline `ring` (P, 2) m: x, y of the start and x, y of the end of each."""
    return np.concatenate([ring, np.roll(ring, -1, axis=0)], axis=1)


@kernel
def contains_point(areas: Areas, a: int, x: Vec) -> bool:
    """Return True if point x (m) lies inside area number a in plan; a hole is outside the area.

    The point is inside if a ray from the point to the east crosses an odd number of edges.
    """
    inside = False
    for e in range(areas.first[a], areas.first[a + 1]):
        before = areas.edges[e, 1] > x[1]
        after = areas.edges[e, 3] > x[1]
        if before != after and crossing_time(areas, e, x, 1.0, 0.0) > 0.0:
            inside = not inside
    return inside


@kernel
def crossing_time(areas: Areas, e: int, x: Vec, v_x: float, v_y: float) -> float:
    """Return the time (s) until a point that moves in plan reaches the line through edge number e.

    The time is negative if the point has passed the line. The point must not move parallel to the line.

    x : start of the point, m; v_x, v_y : its velocity in plan, m/s
    """
    px, py = areas.edges[e, 0] - x[0], areas.edges[e, 1] - x[1]
    ex, ey = areas.edges[e, 2] - areas.edges[e, 0], areas.edges[e, 3] - areas.edges[e, 1]
    return float((px * ey - py * ex) / (v_x * ey - v_y * ex))


@kernel
def walk_areas(areas: Areas, visits: Visits, track: Track, mass: float) -> None:
    """Record a visit to each area of interest in which a part of a rock's track lies; mass : of the rock (kg).

    visits : receives the visits; `areas.crossings` is overwritten
    """
    x, v, T = track.arc.x, track.arc.v, track.duration
    end_x, end_y = x[0] + v[0] * T, x[1] + v[1] * T
    for a in range(len(areas.boxes)):
        if (
            min(x[0], end_x) <= areas.boxes[a, 2] and max(x[0], end_x) >= areas.boxes[a, 0]
            and min(x[1], end_y) <= areas.boxes[a, 3] and max(x[1], end_y) >= areas.boxes[a, 1]
        ):  # fmt: skip
            _visit_area(areas, visits, track, mass, a)


@kernel
def _visit_area(areas: Areas, visits: Visits, track: Track, mass: float, a: int) -> None:
    """Record that a rock is in area number a during each part of its track inside this area.

    The crossings with the outlines divide the track into parts. A part lies inside the area if its middle lies inside.

    mass : of the rock, kg
    """
    crossings, begin = _sorted_crossings(areas, a, track), 0.0
    for k in range(crossings + 1):
        end = areas.crossings[k] if k < crossings else track.duration
        if end > begin and contains_point(areas, a, position(track.arc, 0.5 * (begin + end))):
            t = time_at(track, begin)
            stay = visit(visits, a, t, mass)
            note_stay(visits, stay, t, time_at(track, end), top_speed2(track, begin, end))
            note_track_energy(visits.energy2, stay, track, begin, end)
        begin = end


@kernel
def _sorted_crossings(areas: Areas, a: int, track: Track) -> int:
    """Write the times (s) at which a track crosses the outlines of area number a, ascending; return their number.

    The times are written to `areas.crossings`.
    """
    x, v, used = track.arc.x, track.arc.v, 0
    for e in range(areas.first[a], areas.first[a + 1]):
        before = v[0] * (areas.edges[e, 1] - x[1]) - v[1] * (areas.edges[e, 0] - x[0]) >= 0.0
        after = v[0] * (areas.edges[e, 3] - x[1]) - v[1] * (areas.edges[e, 2] - x[0]) >= 0.0
        if before == after:
            continue
        t = crossing_time(areas, e, x, v[0], v[1])
        if not 0.0 < t < track.duration:
            continue
        k = used
        while k > 0 and areas.crossings[k - 1] > t:
            areas.crossings[k] = areas.crossings[k - 1]
            k -= 1
        areas.crossings[k] = t
        used += 1
    return used
