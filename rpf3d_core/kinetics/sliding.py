"""Sliding over facets, one segment at a time: on a facet, or in a gully along the line between two facets.

Rolling uses the same functions with other coefficients in the ground model's `Law`. A segment ends where the rock
leaves a facet or stops. It also ends where an uphill slide has lost its speed and friction does not hold the rock: the
next segment is downhill. A segment also ends where the path has turned so far that a curve through both ends would no
longer show the true path, and at max_time.
"""

import math
from typing import NamedTuple

from rpf3d_core.arc import gravity_along
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.ground import Law
from rpf3d_core.kinetics.gully import Gully
from rpf3d_core.kinetics.slide_path import (
    SlidePath,
    bend_point,
    exit_point,
    is_straight,
    slide_path,
    slide_state,
    stop_point,
    time_point,
)
from rpf3d_core.terrain.facet_geometry import (
    ALONG_EDGE,
    ALONG_GULLY,
    FLAT,
    edge_distance,
    edge_inward,
    line_exit,
)
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import add, dot, norm, scale, without

HOLDS = 1.0 - 1e-9
"""Share (-) of the gravity along the ground that friction must reach to keep a rock in place.

Because the share is below 1, a slope at exactly the friction angle holds the rock despite rounding. The neglected part
of gravity would move a rock less than 0.1 m in an hour.
"""
CREEP = 1e-9
"""Speed (m/s, 4 um per hour) below which a rock that friction can hold has stopped, even if stop_speed is lower."""


class SlideSegment(NamedTuple):
    """One ground segment of a sliding or rolling rock: the motion at its end, its length (m) and how it ended.

    stopped : True if the rock has stopped for good; late : True if max_time was reached
    left_first, left_second : True if the rock has slid off the facet, or off the first or second facet of its gully
    bends : True if the segment ends only because the path bends; the same slide continues
    """

    motion: Motion
    length: float
    stopped: bool
    late: bool
    left_first: bool
    left_second: bool
    bends: bool


class StraightSlide(NamedTuple):
    """The start of a straight slide: unit direction (3,), speed (m/s) and acceleration along the direction (m/s^2).

    holds : True if the rock stops for good at the stop speed: friction can hold the rock, or `Law.anywhere` is True
    """

    direction: Vec
    speed: float
    acceleration: float
    holds: bool


class SlidePlane(NamedTuple):
    """The facet that a rock slides over, with its normal towards the rock.

    f : number of the facet; n : (3,) normal of the facet, turned towards the rock, n_z > 0
    slack : distance (m) by which a rock that moves almost along an edge may be outside the edge
    """

    f: int
    n: Vec
    slack: float


@kernel
def slide_on_facet(
    facets: Facets, plane: SlidePlane, motion: Motion, law: Law, gravity: float, time_left: float
) -> SlideSegment:
    """Return the next segment of a rock that slides over a facet, until it leaves the facet or stops.

    The segment also ends where the path has turned too far, or where an uphill slide has lost its speed.

    motion.v must lie in the plane of the facet; law : coefficients of the ground model
    gravity : m/s^2, above 0; time_left : s until max_time, at which the segment ends in any case
    """
    f, n, slack = plane.f, plane.n, plane.slack
    g_t, friction, stop_speed = scale(law.share, gravity_along(n, gravity)), law.friction, law.stop_speed
    holds = law.anywhere or friction >= HOLDS * norm(g_t)
    speed = norm(motion.v)
    path = slide_path(motion.v, n, g_t, friction)
    if is_straight(path) or (holds and speed <= max(stop_speed, CREEP)):
        if speed > 0.0:
            direction = scale(1.0 / speed, motion.v)
        else:
            direction = scale(1.0 / path.pull, g_t) if path.pull > 0.0 else g_t
        line = StraightSlide(direction=direction, speed=speed, acceleration=dot(g_t, direction) - friction, holds=holds)
        way = line_exit(facets, f, motion.x, direction, ALONG_EDGE, slack)
        return slide_on_line(motion, line, way, math.inf, stop_speed, time_left)
    leave = math.inf
    for k in range(3):
        inward, distance = edge_inward(facets, f, k), edge_distance(facets, f, k, motion.x)[1]
        length = norm(inward)
        if slack > 0.0 and -dot(inward, motion.v) < FLAT * length * speed:
            distance = distance + slack * length
        leave = min(leave, exit_point(path, inward, distance))
    stop = stop_point(path, max(stop_speed, CREEP)) if holds else math.inf
    return _slide_on_curve(path, n, motion, leave, stop, time_left)


@kernel
def _slide_on_curve(
    path: SlidePath, n: Vec, motion: Motion, leave: float, stop: float, time_left: float
) -> SlideSegment:
    """Return the segment of a rock that slides along a curve.

    The segment ends where the rock leaves the facet, stops or has turned too far (`bend_point`), or at max_time.

    leave, stop : path parameter y (`slide_path`) where the rock leaves the facet, and where it stops; inf if never
    motion : at the start of the segment; n : (3,) normal of the facet; time_left : s until max_time
    """
    bend = bend_point(path)
    y = min(leave, stop, bend)
    end = slide_state(path, y)
    late = end.t > time_left
    if late:
        end = slide_state(path, time_point(path, time_left, y))
    after = Motion(t=motion.t + end.t, x=add(motion.x, end.offset), v=without(end.v, n), w=motion.w)
    bends = bend < min(leave, stop) and not late
    ends = not (bends or late)
    return SlideSegment(
        motion=after,
        length=end.length,
        stopped=stop <= leave and ends,
        late=late,
        left_first=leave < stop and ends,
        left_second=False,
        bends=bends,
    )


@kernel
def slide_on_line(
    motion: Motion, line: StraightSlide, first: float, second: float, stop_speed: float, time_left: float
) -> SlideSegment:
    """Return the segment of a rock that slides straight, until it leaves a facet or has slowed down.

    If `line.holds`, the rock stops at stop_speed. If friction brakes but cannot hold the rock, its speed falls to zero,
    and the next segment is downhill. If the rock neither slows down nor has a border ahead, which only the rounding of
    a very narrow facet causes, the rock counts as having slid off both facets at once. A rock at rest at the border,
    which gravity pulls over the border, leaves the facet with the speed CREEP.

    line : the start of the slide; stop_speed : m/s
    first, second : distance (m) along the slide to the border of the first and of the second facet; inf without a
        second facet
    time_left : s until max_time
    """
    u, a = line.speed, line.acceleration
    lowest = min(max(stop_speed, CREEP), u) if line.holds else 0.0
    stop = (u * u - lowest * lowest) / (-2.0 * a) if a < 0.0 else math.inf
    if line.holds and u <= lowest:
        stop = 0.0
    leave = min(first, second)
    distance = min(stop, leave)
    if distance == math.inf:  # no edge ahead: the facet is a sliver, its normal is only rounding error
        return SlideSegment(
            motion=motion, length=0.0, stopped=False, late=False, left_first=True, left_second=True, bends=False
        )
    end = math.sqrt(max(u * u + 2.0 * a * distance, 0.0)) if stop > leave else lowest
    t = 2.0 * distance / (u + end) if distance > 0.0 else 0.0
    late = t > time_left
    if late:
        t, end = time_left, max(u + a * time_left, 0.0)
        distance = 0.5 * (u + end) * t
    after = Motion(
        t=motion.t + t, x=add(motion.x, scale(distance, line.direction)), v=scale(end, line.direction), w=motion.w
    )
    if not late and stop > leave and end == 0.0:  # the rock starts from rest at the edge: let it move off
        after = Motion(t=motion.t, x=motion.x, v=scale(CREEP, line.direction), w=motion.w)
    if late or stop <= leave:
        return SlideSegment(
            motion=after,
            length=distance,
            stopped=line.holds and not late,
            late=late,
            left_first=False,
            left_second=False,
            bends=False,
        )
    return SlideSegment(
        motion=after,
        length=distance,
        stopped=False,
        late=False,
        left_first=first <= leave,
        left_second=second <= leave,
        bends=False,
    )


@kernel
def slide_in_gully(
    facets: Facets, first: int, second: int, held: Gully, motion: Motion, law: Law, time_left: float
) -> SlideSegment:
    """Return the segment of a rock that slides along a gully, until it leaves one of the two facets or stops.

    The segment also ends where an uphill slide has lost its speed. If both facets end within a tolerance of each other,
    the rock leaves both.

    first, second : numbers of the facets; held : the gully; law : coefficients of the ground model
    time_left : s until max_time
    """
    speed = max(dot(motion.v, held.direction), 0.0)
    pull = law.share * held.pull
    holds = law.anywhere or law.friction >= HOLDS * abs(pull)
    line = StraightSlide(direction=held.direction, speed=speed, acceleration=pull - law.friction, holds=holds)
    way_first = line_exit(facets, first, motion.x, held.direction, ALONG_GULLY, 0.0)
    way_second = line_exit(facets, second, motion.x, held.direction, ALONG_GULLY, 0.0)
    near = facets.tolerance
    piece = slide_on_line(motion, line, way_first, way_second, law.stop_speed, time_left)
    return SlideSegment(
        motion=piece.motion,
        length=piece.length,
        stopped=piece.stopped,
        late=piece.late,
        left_first=piece.left_first or (piece.left_second and way_first <= way_second + near),
        left_second=piece.left_second or (piece.left_first and way_second <= way_first + near),
        bends=False,
    )
