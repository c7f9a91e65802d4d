"""Examine single facets near a body: the gap, and a plane that separates body and facet for a known time.

The gap is the distance (m) between body and facet; it is negative if they overlap.

While the body stays on its side of such a plane, the body does not touch the facet. This is true for every kind of
contact: corners on facets, edges on edges, and corners of the terrain under faces of the body, on walls and overhangs,
too. So no kind of contact needs a separate search.
"""

import math
from typing import NamedTuple

from rpf3d_core.body.clearance import clear_time, reach_time
from rpf3d_core.body.contacts import put, vector
from rpf3d_core.body.distance import lowest, separation
from rpf3d_core.body.quaternions import turned, turned_back
from rpf3d_core.detection.closest import closest_point
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion, FreeFlight, in_body, motion_after, sweep_of
from rpf3d_core.simulation.bodies.room import (
    ACTIVE,
    AWAY,
    GAP,
    GUESS,
    MARK,
    NEAREST,
    NORMAL,
    OFFSET,
    UNKNOWN,
    UNTIL,
    BodyRoom,
)
from rpf3d_core.terrain.facet_geometry import corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale, subtract

FAR = 0.1
"""Smallest distance between a facet and the sphere around a body that is used as the gap, divided by the reach (-).

For a nearer facet, the gap is the exact distance between facet and body.
"""
EXACT = 0.05
"""Largest error of the gap at which contact begins, as a share (-) of the skin, the correct gap."""
FLOOR = 0.2
"""Smallest gap during a step in contact, as a share (-) of the skin; a smaller gap ends the step."""
LEAST = 1e-7
"""Shortest time (s) between two examinations of a facet."""
LEAVING = 0.9
"""Share (-) of the gap: a facet that a body leaves is examined again before the gap may fall below this share."""


class FacetMeeting(NamedTuple):
    """The first contact of a flight: its time t from the start (s), and the index k of its facet in `BodyRoom.facets`.

    If there is no contact, k is -1, and t is the time (s) up to which the search looked for a contact.
    """

    t: float
    k: int


@kernel
def facet_in_body(facets: Facets, f: int, motion: BodyMotion) -> tuple[Vec, Vec, Vec]:
    """Return the three corners (m) of facet number f in the body's axes."""
    return (
        in_body(motion, corner(facets, f, 0)),
        in_body(motion, corner(facets, f, 1)),
        in_body(motion, corner(facets, f, 2)),
    )


@kernel
def _note(room: BodyRoom, k: int, gap: float, n: Vec, offset: float) -> None:
    """Write the gap (m) between a body and nearby facet k, and the plane that separates both, into `room.planes`.

    k : index of the facet in `room.facets`; n, offset : values for the columns NORMAL (3,) and OFFSET (m)
    """
    plane = room.planes[k]
    plane[GAP], plane[OFFSET] = gap, offset
    put(plane, NORMAL, n)


@kernel
def look(body: Body, room: BodyRoom, facets: Facets, motion: BodyMotion, k: int, moved: float) -> None:
    """Examine nearby facet k: write its gap, and a plane that separates facet and body, into `room.planes`.

    k : index of the facet in `room.facets`; motion : current motion of the body; moved : its path bound, as in `Ride`
        (m)

    For a distant facet (FAR), gap and plane are computed for the sphere around the body, so the gap is a lower bound.
    If body and facet overlap, the gap is 0 or less, and the plane is the last plane that separated both
    (`_look_inside`).
    """
    f, plane = room.facets[k], room.planes[k]
    p = closest_point(facets, f, motion.x)
    away = subtract(motion.x, p)
    distance = norm(away)
    plane[MARK] = moved
    if distance > (1.0 + FAR) * body.reach:
        n = scale(1.0 / distance, away)
        _note(room, k, distance - body.reach, n, dot(n, p))
        put(plane, GUESS, in_body(motion, add(motion.x, n)))
        return
    known = plane[GAP] != UNKNOWN
    guess = vector(plane, GUESS) if known else in_body(motion, _outwards(facets, f, motion.x))
    found = separation(body.shapes.corners, body.first, body.last, body.size, facet_in_body(facets, f, motion), guess)
    if found.overlap:
        _look_inside(body, room, motion, k, in_body(motion, _outwards(facets, f, motion.x)))
        return
    n = turned(motion.q, found.normal)
    _note(room, k, found.distance, n, dot(n, add(motion.x, turned(motion.q, found.on_facet))))
    put(plane, GUESS, found.normal)
    put(plane, NEAREST, found.on_body)


@kernel
def stays_above(body: Body, room: BodyRoom, motion: BodyMotion, k: int, level: float, moved: float) -> bool:
    """Return True if the stored separating plane of nearby facet k proves that the body is more than `level` (m) away.

    If so, store the distance of the body from the plane, and `moved`, in `room.planes[k]`. This distance is a lower
    bound of the distance of the body from the facet.

    k : index of the facet in `room.facets`; motion : current motion of the body
    level : m, a distance from the facet; moved : path bound of the body, as in `Ride` (m)
    """
    plane = room.planes[k]
    n = vector(plane, NORMAL)
    up, corners = turned_back(motion.q, n), body.shapes.corners
    deep = lowest(corners, body.first, body.last, up)
    height = dot(n, motion.x) - plane[OFFSET] + body.size * (
        up[0] * corners[deep, 0] + up[1] * corners[deep, 1] + up[2] * corners[deep, 2]
    )
    if not height > level:
        return False
    plane[GAP], plane[MARK] = height, moved
    return True


@kernel
def _outwards(facets: Facets, f: int, x: Vec) -> Vec:
    """Return the point at a distance of 1 m from x (3,) m in the direction of the normal of facet f."""
    return add(x, stored_normal(facets, f))


@kernel
def _look_inside(body: Body, room: BodyRoom, motion: BodyMotion, k: int, outwards: Vec) -> None:
    """Write the gap and the plane of nearby facet k, which the body overlaps, into `room.planes`.

    The gap is minus the depth (m) of the body behind the last plane that separated the body from the facet. If there is
    no such plane yet, the plane has the facet's normal and touches the body, and the gap is 0.

    k : index of the facet in `room.facets`; outwards : (3,) normal of the facet, in the body's axes
    """
    plane = room.planes[k]
    known = plane[GAP] != UNKNOWN
    n = vector(plane, NORMAL) if known else turned(motion.q, outwards)
    local = in_body(motion, add(motion.x, n))
    lowest, nearest = math.inf, motion.x
    corners, size = body.shapes.corners, body.size
    for i in range(body.first, body.last):
        arm = (size * corners[i, 0], size * corners[i, 1], size * corners[i, 2])
        if dot(local, arm) < lowest:
            lowest, nearest = dot(local, arm), arm
    height = dot(n, motion.x) + lowest
    _note(room, k, min(height - plane[OFFSET], 0.0) if known else 0.0, n, plane[OFFSET] if known else height)
    put(plane, GUESS, local)
    put(plane, NEAREST, nearest)


@kernel
def clear_of(
    body: Body, room: BodyRoom, flight: FreeFlight, motion: BodyMotion, k: int, bounds: tuple[float, float]
) -> float:  # fmt: skip
    """Return a time (s) for which the body certainly stays more than a distance away from facet k's separating plane.

    k : index of the facet in `room.facets`; flight : free flight of the body
    motion : motion of the body when the facet was examined last; the time counts from this motion
    bounds : the distance (m), and the time (s) of interest: the result is inf if the body stays away for longer
    """
    level, most = bounds
    plane = room.planes[k]
    n, offset = vector(plane, NORMAL), plane[OFFSET] + level
    return clear_time(room.arms, body.last - body.first, sweep_of(flight, motion), (n, offset), most)


@kernel
def sphere_clear(body: Body, room: BodyRoom, flight: FreeFlight, motion: BodyMotion, k: int) -> float:
    """Return a time (s) for which the sphere around the body stays clear of the separating plane of nearby facet k.

    Clear means farther away than the skin. The result is 0 if the sphere is not clear now, and infinite if the sphere
    stays clear.

    k : index of the facet in `room.facets`; motion : motion of the body now; the time counts from this motion
    """
    plane = room.planes[k]
    n = vector(plane, NORMAL)
    height = dot(n, motion.x) - plane[OFFSET] - body.reach - body.skin
    return reach_time(height, dot(n, motion.v), flight.gravity * n[2]) if height > 0.0 else 0.0


@kernel
def travelled(body: Body, flight: FreeFlight, t: float) -> float:
    """Return a length (m) that no point of the body exceeds on its path in the first t seconds of a flight."""
    return t * (norm(flight.start.v) + 0.5 * flight.gravity * t + flight.spin * body.reach)


@kernel
def _approaches(room: BodyRoom, motion: BodyMotion, k: int) -> bool:
    """Return True if the body's point nearest to facet k does not move away from facet k, or if the body overlaps it.

    k : index of the facet in `room.facets`; motion : current motion of the body
    """
    plane = room.planes[k]
    turning = cross(motion.w, vector(plane, NEAREST))
    rate = dot(vector(plane, NORMAL), motion.v) + dot(vector(plane, GUESS), turning)
    return plane[GAP] <= 0.0 or rate <= 0.0


@routine
def first_meeting(
    body: Body, room: BodyRoom, facets: Facets, flight: FreeFlight, horizon: float, moved: float
) -> FacetMeeting:
    """Return the first contact of a flight with the nearby facets (`room.facets`) before the time `horizon` (s).

    Contact begins when the gap has fallen to the body's skin (the distance at which contact begins), within EXACT times
    the skin. A nearer body that moves away is not in contact, unless it overlaps the facet. Without contact, the index
    is -1. Each examination of a facet gives a time up to which the facet need not be examined again. The facet with the
    earliest of these times is examined next.

    moved : path bound of the body at the start, as in `Ride` (m)
    """
    planes, motion, at = room.planes, flight.start, 0.0
    count = room.count[0]
    for k in range(count):
        planes[k, UNTIL] = 0.0
    while True:
        k, t = -1, horizon
        for i in range(count):
            if planes[i, UNTIL] < t:
                k, t = i, planes[i, UNTIL]
        if k < 0:
            return FacetMeeting(horizon, -1)
        if t != at:
            motion, at = motion_after(flight, t), t
        look(body, room, facets, motion, k, moved + travelled(body, flight, t))
        gap = planes[k, GAP]
        wait = sphere_clear(body, room, flight, motion, k)
        if not wait >= horizon - t:
            if gap <= body.skin * (1.0 + EXACT) and _approaches(room, motion, k):
                return FacetMeeting(t, k)
            level = body.skin if gap > body.skin * (1.0 + EXACT) else LEAVING * gap
            wait = max(wait, clear_of(body, room, flight, motion, k, (level, horizon - t)))
        planes[k, UNTIL] = t + max(wait, LEAST)


@kernel
def clear_until(body: Body, room: BodyRoom, facets: Facets, flight: FreeFlight, h: float, moved: float) -> float:
    """Return the time (s), at most h, for which no gap falls below its limit during a step in contact.

    The limit for a facet without contact is the skin. The limit for a facet in contact is the smaller of FLOOR times
    the skin and half of the gap at the start.

    flight : the step; moved : path bound of the body at the start, as in `Ride` (m)
    """
    end, path = h, travelled(body, flight, h)
    for k in range(room.count[0]):
        plane = room.planes[k]
        if plane[GAP] - abs(moved - plane[MARK]) - path <= body.skin:
            end = _clear_of_facet(body, room, facets, flight, FacetMeeting(end, k), moved)
    return end


@kernel
def _clear_of_facet(
    body: Body, room: BodyRoom, facets: Facets, flight: FreeFlight, most: FacetMeeting, moved: float
) -> float:
    """Return the time (s), at most `most.t`, for which the gap of nearby facet `most.k` stays above its limit.

    The limit is as in `clear_until`.

    flight : the step; most : a time (s), and the index of the facet in `room.facets`
    moved : path bound of the body at the start, as in `Ride` (m)
    """
    k, t, motion = most.k, 0.0, flight.start
    plane = room.planes[k]
    if plane[MARK] != moved:
        look(body, room, facets, motion, k, moved)
    level = body.skin
    if plane[ACTIVE] != AWAY:
        level = min(FLOOR * body.skin, 0.5 * plane[GAP])
    while True:
        t += max(clear_of(body, room, flight, motion, k, (level, most.t - t)), LEAST)
        if t >= most.t:
            return most.t
        motion = motion_after(flight, t)
        look(body, room, facets, motion, k, moved + travelled(body, flight, t))
        if plane[GAP] <= level + EXACT * body.skin:
            return t
