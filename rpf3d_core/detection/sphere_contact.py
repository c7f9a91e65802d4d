"""The narrow phase of a sphere: when its centre, on a parabola, comes within its radius of a facet.

A facet is touched on its face, on an edge or on a corner. The distance from the plane is a quadratic in time, the
squared distance from an edge's line or from a corner a quartic (`quartic.py`); the sphere touches where the distance
falls through R and the foot of the centre lies on the feature. The normal of the contact is the direction from that
foot to the centre: with it roughness is felt by small spheres and ridden over by large ones.

What lies within tolerance at the start, or is overlapped by the sphere, is not looked at as a root:

- approaching it, the sphere hits it now; moving along it, too, where the acceleration presses the sphere on;
- receding from it, that root is divided out: the sphere hits it when it comes back to the same distance.

Nothing of it depends on which facet the sphere has left, nor on the order in which facets are looked at.
"""

import math
from typing import NamedTuple

from rpf3d_core.compiling import kernel
from rpf3d_core.detection.contact import GRAZING, falling_time
from rpf3d_core.detection.quartic import Quartic, first_fall
from rpf3d_core.terrain.facet_geometry import NEAR, contains, corner, edge_distance, edge_inward, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, dot, norm, scale, subtract, without


class Course(NamedTuple):
    """A centre at x (3,) m with v (3,) m/s under a constant acceleration a (3,) m/s^2.

    radius : of the sphere (m); gravity : m/s^2, that accelerations are told from rounding by
    """

    x: Vec
    v: Vec
    a: Vec
    radius: float
    gravity: float


class Touch(NamedTuple):
    """Contact of a sphere after t seconds (inf: none) with a facet, at a speed (m/s) into it.

    n : (3,) unit, from the point of contact to the centre; along : (3,) unit, of the edge that is touched, else zero
    face : whether it is the facet's face, and no edge or corner, that is touched
    """

    t: float
    facet: int
    approach: float
    n: Vec
    along: Vec
    face: bool


NO_TOUCH = Touch(math.inf, -1, 0.0, (0.0, 0.0, 1.0), ZERO, False)
RIM = 2.0
"""Tolerances by which edges and corners lie deeper than faces.

A sphere that rolls over a plane touches, of the edges in it, those that its foot is on, and within tolerance those
that it is only near: s from its foot their distance is R + s^2 / 2R. None is there to it until it would sink.
"""
ON_RIM = 0.75 * RIM
"""Tolerances below R within which an edge or a corner is touched already: a quarter of RIM is left for rounding."""
POLISHED = 1e3
"""Tolerances by which the last step of Newton may move a contact; more is asked for by grazing ones alone."""


@kernel
def course_position(course: Course, t: float) -> Vec:
    """Where the centre is after t seconds (m)."""
    return add(course.x, scale(t, add(course.v, scale(0.5 * t, course.a))))


@kernel
def course_velocity(course: Course, t: float) -> Vec:
    """How fast it is after t seconds (m/s)."""
    return add(course.v, scale(t, course.a))


@kernel
def earlier_touch(facets: Facets, f: int, course: Course, end: float, before: float, best: Touch) -> Touch:
    """The earlier of `best` and the first contact with facet f.

    end : s, finite, of the whole course: roots are looked for up to there, so that they have the same bits whatever was
        looked at before; before : s, contacts after which are not asked for
    """
    n, origin = stored_normal(facets, f), corner(facets, f, 0)
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return best
    until = min(before, best.t)
    c = dot(n, subtract(course.x, origin))
    side = 1.0 if c >= 0.0 else -1.0
    begin, stop = side * c, side * dot(n, subtract(course_position(course, until), origin))
    a = dot(n, course.a)
    reach = course.radius + NEAR * facets.tolerance + 0.125 * abs(a) * until * until
    if min(begin, stop) > reach:
        return best
    for turned in (side, -side):  # one that begins beyond the plane, beside the facet, may come down on either side
        best = _earlier_on_face(facets, f, course, scale(turned, n), turned * c, best)
    for k in range(6):
        best = _earlier_on_rim(facets, f, k, course, end, before, best)
    return best


@kernel
def _earlier_on_face(facets: Facets, f: int, course: Course, n: Vec, c: float, best: Touch) -> Touch:
    """The earlier of `best` and the contact with the face, c (m) from the centre at the start on the side of n."""
    b, a, gap = dot(n, course.v), dot(n, course.a), c - course.radius
    near = NEAR * facets.tolerance
    if c >= 0.0 and gap <= near and contains(facets, f, course.x, False, facets.tolerance):
        t = _time_from_touch(b, a, course)
        if t == 0.0 and b * b <= GRAZING * GRAZING * dot(course.v, course.v):
            t = 0.0 if stays_on(facets, f, course.x, course.v, course.a) else math.inf
        if gap < -near and b > 0.0:
            t = min(t, falling_time(gap, b, 0.5 * a))
    else:
        t = falling_time(gap, b, 0.5 * a)
    if t > best.t or t == math.inf or not contains(facets, f, course_position(course, t), False, facets.tolerance):
        return best
    return _sooner(best, Touch(t, f, max(-(b + a * t), 0.0), n, ZERO, True))


@kernel
def _time_from_touch(b: float, a: float, course: Course) -> float:
    """When a sphere that touches a plane meets it: now, when it comes back, or never.

    b, a : its speed and acceleration away from the plane
    """
    speed2, pull = dot(course.v, course.v), course.gravity
    if b * b <= GRAZING * GRAZING * speed2:
        return 0.0 if a < -GRAZING * pull else math.inf
    if b < 0.0:
        return 0.0
    return -2.0 * b / a if a < 0.0 else math.inf


@kernel
def stays_on(facets: Facets, f: int, p: Vec, v: Vec, a: Vec) -> bool:
    """Whether a foot at p (m) of the face of f, with velocity v and acceleration a, does not leave it across an edge.

    On the rim of a face it may be that an edge is all that is touched, and that the sphere goes around it, or flies.
    """
    n, slack = stored_normal(facets, f), facets.tolerance
    speed, pull = GRAZING * norm(without(v, n)), GRAZING * norm(without(a, n))
    for k in range(3):
        squared, distance = edge_distance(facets, f, k, p)
        if distance > 0.0 and distance * distance > slack * slack * squared:
            continue
        inward, length = edge_inward(facets, f, k), math.sqrt(squared)
        leaving = dot(inward, v)
        if leaving < -speed * length or (leaving <= speed * length and dot(inward, a) < -pull * length):
            return False
    return True


@kernel
def _earlier_on_rim(facets: Facets, f: int, k: int, course: Course, end: float, before: float, best: Touch) -> Touch:
    """The earlier of `best` and the contact with edge k (0, 1, 2) or corner k - 3 of facet f."""
    at, length, along = corner(facets, f, k % 3), 0.0, ZERO
    if k < 3:
        edge = subtract(corner(facets, f, (k + 1) % 3), at)
        length = norm(edge)
        if length == 0.0:
            return best
        along = scale(1.0 / length, edge)
    from_x, until, radius = subtract(course.x, at), min(before, best.t), course.radius - RIM * facets.tolerance
    p, v, a = without(from_x, along), without(course.v, along), without(course.a, along)
    distance = norm(p)
    longest = norm(v) * until + 0.5 * norm(a) * until * until
    if distance - longest > course.radius + NEAR * facets.tolerance or distance == 0.0:
        return best
    foot, t = dot(from_x, along), math.inf
    half = scale(0.5, a)
    q = Quartic(
        (distance - radius) * (distance + radius), 2.0 * dot(p, v), dot(v, v) + 2.0 * dot(p, half),
        2.0 * dot(v, half), dot(half, half),
    )  # fmt: skip
    if distance <= course.radius - ON_RIM * facets.tolerance and (k >= 3 or 0.0 <= foot <= length):
        t = _time_from_rim(course, p, v, a, distance, q, end)
        if q.c0 < 0.0 and q.c1 > 0.0 and t > 0.0:
            t = min(t, first_fall(q, 0.0, end))
    else:
        t = _time_on_rim(facets, course, at, along, length, q, end)
    if not t <= best.t or t == math.inf:
        return best
    gap = without(subtract(course_position(course, t), at), along)
    n = scale(1.0 / norm(gap), gap)
    return _sooner(best, Touch(t, f, max(-dot(n, course_velocity(course, t)), 0.0), n, along, False))


@kernel
def _time_from_rim(course: Course, p: Vec, v: Vec, a: Vec, distance: float, q: Quartic, until: float) -> float:
    """When a sphere that touches an edge or a corner meets it: now, when it comes back, or never.

    p, v, a : offset from the line or corner and its derivatives; distance : |p|
    """
    speed2, pull = dot(course.v, course.v), course.gravity
    rate = dot(p, v) / distance
    bend = dot(p, a) / distance + (dot(v, v) - rate * rate) / distance
    if rate * rate <= GRAZING * GRAZING * speed2:
        if bend < -GRAZING * pull:
            return 0.0
        if bend <= GRAZING * max(pull, speed2 / distance):
            return math.inf
    elif rate < 0.0:
        return 0.0
    return first_fall(Quartic(0.0, max(q.c1, 0.0), q.c2, q.c3, q.c4), 0.0, until)


@kernel
def _time_on_rim(
    facets: Facets, course: Course, at: Vec, along: Vec, length: float, q: Quartic, until: float
) -> float:  # fmt: skip
    """When a sphere that does not touch a feature comes to touch it: of at most two falls the first on the feature."""
    begin = 0.0
    for _ in range(2):
        t = first_fall(q, begin, until)
        if t == math.inf:
            return t
        at_rim = _polished(facets, course, at, along, t)
        foot = dot(subtract(course_position(course, at_rim), at), along)
        if 0.0 <= foot <= length:
            return at_rim
        begin = t
    return math.inf


@kernel
def _polished(facets: Facets, course: Course, at: Vec, along: Vec, t: float) -> float:
    """The time of a contact after a step of Newton from positions: the polynomial has lost digits to its size."""
    gap, v = without(subtract(course_position(course, t), at), along), course_velocity(course, t)
    distance = norm(gap)
    rate = dot(gap, v) / distance if distance > 0.0 else 0.0
    if not rate < 0.0:
        return t
    step = (distance - (course.radius - RIM * facets.tolerance)) / rate
    moved = abs(step) * norm(v)
    return max(t - step, 0.0) if moved <= POLISHED * facets.tolerance else t


@kernel
def _sooner(best: Touch, other: Touch) -> Touch:
    """The sooner of two contacts; of two at one instant the one met most head-on, then by normal, then by number."""
    if other.t != best.t:
        return other if other.t < best.t else best
    if other.approach != best.approach:
        return other if other.approach > best.approach else best
    for k in range(3):
        if other.n[k] != best.n[k]:
            return other if other.n[k] > best.n[k] else best
    return other if other.facet < best.facet else best
