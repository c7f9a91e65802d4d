"""Sliding over facets, one segment at a time: on a facet, or along the line where two facets hold the rock.

Rolling differs only by the numbers of the ground model's `Law`. A segment ends where the rock leaves a facet or stops.
It also ends where an uphill slide has lost its speed and friction does not hold the rock: the next segment goes down.
And it ends where the rock has turned so far that a curve through the ends would no longer show the way in between.
"""

import math
from typing import NamedTuple

from rpf3d_core.arc import gravity_along
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.ground import Law
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
    NEAR,
    PARALLEL,
    corner,
    edge_distance,
    edge_inward,
    leads_on,
    line_exit,
    stored_normal,
)
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale, subtract, without

HOLDS = 1.0 - 1e-9
"""Share of the pull of gravity that friction must reach to hold a rock (-).

So a slope at exactly the friction angle holds the rock.

The neglected rest of the pull would move a rock less than 0.1 m in an hour.
"""
CREEP = 1e-9
"""Speed (m/s) below which a rock that friction holds has stopped, however low stop_speed is: 4 um in an hour."""


class SlideSegment(NamedTuple):
    """One path segment of sliding: the motion at its end, its length (m) and how it ended.

    stopped : friction holds the rock; late : max_time was reached
    left_first, left_second : the rock has slid off the first, or the second, of the facets that it stood on
    bends : nothing has happened to the rock, the same slide goes on
    """

    motion: Motion
    length: float
    stopped: bool
    late: bool
    left_first: bool
    left_second: bool
    bends: bool


class Line(NamedTuple):
    """A straight slide: direction (3,) unit, speed (m/s), acceleration along it (m/s^2), True if friction holds."""

    direction: Vec
    speed: float
    acceleration: float
    holds: bool


class SlidePlane(NamedTuple):
    """The facet that a rock slides over.

    f : its number; n : (3,) its normal turned towards the rock, n_z > 0
    slack : m by which the rock may go beyond an edge that it moves along
    """

    f: int
    n: Vec
    slack: float


@kernel
def slide_on_facet(
    facets: Facets, plane: SlidePlane, motion: Motion, law: Law, gravity: float, time_left: float
) -> SlideSegment:
    """Slide over a facet until the rock leaves the facet or stops; return the segment.

    motion.v must lie in the plane of the facet; time_left : s until the segment ends wherever the rock is
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
        line = Line(direction, speed, dot(g_t, direction) - friction, holds)
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
    """Slide along a curve to the first of: the edge of the facet, the stop, a bend, or the end of time.

    leave, stop : of the edge and of the stop, as y of the path
    """
    bend = bend_point(path)
    y = min(leave, stop, bend)
    end = slide_state(path, y)
    late = end.t > time_left
    if late:
        end = slide_state(path, time_point(path, time_left, y))
    after = Motion(motion.t + end.t, add(motion.x, end.offset), without(end.v, n), motion.w)
    bends = bend < min(leave, stop) and not late
    ends = not (bends or late)
    return SlideSegment(after, end.length, stop <= leave and ends, late, leave < stop and ends, False, bends)


@kernel
def slide_on_line(
    motion: Motion, line: Line, first: float, second: float, stop_speed: float, time_left: float
) -> SlideSegment:
    """Slide straight until the rock has gone `first` or `second` (m: distances out of two facets) or has slowed down.

    If friction holds the rock, it stops at stop_speed. Otherwise its speed falls to zero, and it goes on downhill.
    """
    u, a = line.speed, line.acceleration
    lowest = min(max(stop_speed, CREEP), u) if line.holds else 0.0
    stop = (u * u - lowest * lowest) / (-2.0 * a) if a < 0.0 else math.inf
    if line.holds and u <= lowest:
        stop = 0.0
    leave = min(first, second)
    distance = min(stop, leave)
    if distance == math.inf:  # no edge ahead: the facet is a sliver whose plane has no valid digit
        return SlideSegment(motion, 0.0, False, False, True, True, False)
    end = math.sqrt(max(u * u + 2.0 * a * distance, 0.0)) if stop > leave else lowest
    t = 2.0 * distance / (u + end) if distance > 0.0 else 0.0
    late = t > time_left
    if late:
        t, end = time_left, max(u + a * time_left, 0.0)
        distance = 0.5 * (u + end) * t
    after = Motion(motion.t + t, add(motion.x, scale(distance, line.direction)), scale(end, line.direction), motion.w)
    if not late and stop > leave and end == 0.0:  # it starts from rest at the edge: let it move off
        after = Motion(motion.t, motion.x, scale(CREEP, line.direction), motion.w)
    if late or stop <= leave:
        return SlideSegment(after, distance, line.holds and not late, late, False, False, False)
    return SlideSegment(after, distance, False, False, first <= leave, second <= leave, False)


class Gully(NamedTuple):
    """Two facets that hold a rock between them.

    direction : (3,) unit, along both facets; pull : gravity along the direction (m/s^2)
    first, second : push of each facet (m/s^2), which its friction is proportional to
    """

    direction: Vec
    pull: float
    first: float
    second: float


@kernel
def gully(n_first: Vec, n_second: Vec, direction: Vec, gravity: float) -> Gully:
    """Return the action of two facets of unit normals n on a rock on the line between them, of a direction (3,) unit.

    The pushes balance gravity across the line: N_1 n_1 + N_2 n_2 + g_perp = 0. Facets that are almost one plane share
    the push equally. Between the two answers only friction differs, by the difference of mu.
    """
    c, sine = dot(n_first, n_second), kink(n_first, n_second)
    g_first, g_second = gravity * n_first[2], gravity * n_second[2]
    if sine <= PARALLEL:
        return Gully(direction, -gravity * direction[2], 0.5 * g_first, 0.5 * g_second)
    first, second = (g_first - c * g_second) / (sine * sine), (g_second - c * g_first) / (sine * sine)
    return Gully(direction, -gravity * direction[2], first, second)


@kernel
def line_between(facets: Facets, first: int, second: int, x: Vec, v: Vec) -> Vec:
    """Return the direction (3,) unit of the line between two facets at x, in the sense of v (at rest: downwards).

    The direction is the cross product of the normals. For facets that are almost one plane it is the edge of the first
    facet that x lies on and that also runs along the second facet; zero if there is no such edge.
    """
    n, m = stored_normal(facets, first), stored_normal(facets, second)
    if kink(n, m) > PARALLEL:
        line = cross(n, m)
        return _in_sense(scale(1.0 / norm(line), line), v)
    for k in range(3):
        squared, distance = edge_distance(facets, first, k, x)
        if distance * distance <= NEAR * NEAR * facets.tolerance * facets.tolerance * squared:
            edge = subtract(corner(facets, first, (k + 1) % 3), corner(facets, first, k))
            direction = _in_sense(scale(1.0 / math.sqrt(squared), edge), v)
            if leads_on(facets, first, x, direction, ALONG_GULLY) and leads_on(
                facets, second, x, direction, ALONG_GULLY
            ):
                return direction
    return 0.0, 0.0, 0.0


@kernel
def _in_sense(direction: Vec, v: Vec) -> Vec:
    """Return the direction or its reverse, whichever goes with v; downwards if v has no part along the direction."""
    along = dot(v, direction)
    reverse = along < 0.0 or (along == 0.0 and direction[2] > 0.0)
    return scale(-1.0, direction) if reverse else direction


@kernel
def slide_in_gully(
    facets: Facets, first: int, second: int, held: Gully, motion: Motion, law: Law, time_left: float
) -> SlideSegment:
    """Slide along a gully until the rock leaves one of its facets or stops; return the segment."""
    speed = max(dot(motion.v, held.direction), 0.0)
    pull = law.share * held.pull
    holds = law.anywhere or law.friction >= HOLDS * abs(pull)
    line = Line(held.direction, speed, pull - law.friction, holds)
    way_first = line_exit(facets, first, motion.x, held.direction, ALONG_GULLY, 0.0)
    way_second = line_exit(facets, second, motion.x, held.direction, ALONG_GULLY, 0.0)
    near = facets.tolerance
    piece = slide_on_line(motion, line, way_first, way_second, law.stop_speed, time_left)
    return SlideSegment(
        piece.motion,
        piece.length,
        piece.stopped,
        piece.late,
        piece.left_first or (piece.left_second and way_first <= way_second + near),
        piece.left_second or (piece.left_first and way_second <= way_first + near),
        False,
    )


@kernel
def kink(n_first: Vec, n_second: Vec) -> float:
    """Return the sine of the angle between two facets (-)."""
    return norm(cross(n_first, n_second))


@kernel
def excursion(n_over: Vec, n_from: Vec, v: Vec, gravity: float) -> float:
    """Return how far (m) a rock with velocity v climbs facet `over`, away from the line that it shares with `from`.

    Only gravity brings the rock back; a pull of less than `WEAKEST` of gravity counts as that much. The result is inf
    if gravity pulls the rock away.
    """
    across = cross(cross(n_over, n_from), n_over)
    if dot(across, n_from) < 0.0:
        across = scale(-1.0, across)
    across = scale(1.0 / norm(across), across)
    speed = max(dot(v, across), 0.0)
    pull = gravity * across[2]
    if pull < -WEAKEST * gravity:
        return math.inf
    return speed * speed / (2.0 * max(pull, WEAKEST * gravity))


WEAKEST = 1e-9
"""Share of gravity below which a facet counts as level across a gully (-): it pulls the rock neither back nor away."""
