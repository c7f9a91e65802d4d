"""Exact contact of a sphere with an edge or a corner of a facet.

The squared distance of the sphere's centre from the line of an edge, or from a corner, is a quartic in time
(`quartic.py`). The sphere touches an edge where this distance falls through the radius while the foot, which is the
point of the line closest to the centre, lies on the edge. `sphere_contact.py` states the rules for a sphere that
touches an edge or a corner at the start.
"""

import math
from typing import NamedTuple

from rpf3d_core.detection.closest import foot_on
from rpf3d_core.detection.contact import GRAZING
from rpf3d_core.detection.quartic import Quartic, first_fall
from rpf3d_core.detection.sphere_course import Course, Touch, course_position, course_velocity, sooner
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import NEAR, corner
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, dot, norm, scale, subtract, without


class EdgeOrCorner(NamedTuple):
    """An edge or a corner of a facet.

    at : (3,) m, the corner, or the first end of the edge; length : of the edge (m), 0 for a corner
    along : (3,) unit, along the edge; zero for a corner, or an edge of length 0
    """

    at: Vec
    along: Vec
    length: float


RIM = 2.0
"""Depth by which edges and corners are lowered below the interior of facets, in tolerances, when a sphere meets them.

A sphere that rolls over a plane touches the edges in this plane under its foot. Edges near the foot are within
tolerance as well: at a distance s from the foot, an edge is R + s^2 / 2R from the centre. With this depth, such an edge
counts only if the sphere sinks into the plane.
"""
ON_RIM = 0.75 * RIM
"""Least depth, in tolerances, by which a sphere overlaps an edge or corner that it touches.

The depth is smaller than RIM to allow for rounding.
"""
DEEP = 2.0 * RIM
"""Overlap, in tolerances, at which an edge or corner stops a sphere that moves along a nearer feature of the facet."""
POLISHED = 1e3
"""Largest distance, in tolerances, by which the final Newton step may move a contact of a sphere."""


@kernel
def _rim_of(facets: Facets, f: int, k: int) -> EdgeOrCorner:
    """Return an edge or a corner of facet f; k : 0, 1, 2 for an edge; 3, 4, 5 for corner k - 3."""
    at = corner(facets, f, k % 3)
    if k >= 3:
        return EdgeOrCorner(at=at, along=ZERO, length=0.0)
    edge = subtract(corner(facets, f, (k + 1) % 3), at)
    length = norm(edge)
    return EdgeOrCorner(at=at, along=scale(1.0 / length, edge) if length > 0.0 else ZERO, length=length)


@kernel
def earlier_on_rim(facets: Facets, f: int, k: int, course: Course, end: float, before: float, best: Touch) -> Touch:
    """Return the earlier of two contacts of a moving sphere: `best`, or its contact with one edge or corner of facet f.

    k : 0, 1, 2 for an edge; 3, 4, 5 for corner k - 3
    end : s, finite, end of the whole motion; before : s, contacts after this time need not be found
    """
    rim = _rim_of(facets, f, k)
    at, along, length = rim.at, rim.along, rim.length
    if k < 3 and length == 0.0:
        return best
    from_x, until, radius = subtract(course.x, at), min(before, best.t), course.radius - RIM * facets.tolerance
    p, v, a = without(from_x, along), without(course.v, along), without(course.a, along)
    distance = norm(p)
    longest = norm(v) * until + 0.5 * norm(a) * until * until
    if distance - longest > course.radius + NEAR * facets.tolerance or distance == 0.0:
        return best
    foot, t = dot(from_x, along), math.inf
    half = scale(0.5, a)
    q = Quartic(
        c0=(distance - radius) * (distance + radius), c1=2.0 * dot(p, v), c2=dot(v, v) + 2.0 * dot(p, half),
        c3=2.0 * dot(v, half), c4=dot(half, half),
    )  # fmt: skip
    overlap = course.radius - distance
    if overlap >= ON_RIM * facets.tolerance and (k >= 3 or 0.0 <= foot <= length):
        t = _time_from_rim(course, p, v, a, distance, q, end)
        if t == 0.0 and _lies_behind(facets, f, course, add(at, scale(foot, along))):
            t = _time_into_rim(facets, course, rim, q, end)
        if q.c0 < 0.0 and q.c1 > 0.0 and t > 0.0:
            t = min(t, first_fall(q, 0.0, end))
        if 0.0 < t < math.inf and not _is_on(course, rim, t):
            t = _time_on_rim(facets, course, rim, q, t, end)
    elif ON_RIM * facets.tolerance <= overlap < DEEP * facets.tolerance:  # over the extension of the edge, at its depth
        t = _time_into_rim(facets, course, rim, q, end)
        if t == 0.0:
            t = math.inf  # rounding: the sphere does not touch the edge itself yet
    else:
        t = _time_on_rim(facets, course, rim, q, 0.0, end)
    return _sooner_on_rim(best, f, course, rim, t) if t < math.inf else best


@kernel
def _sooner_on_rim(best: Touch, f: int, course: Course, rim: EdgeOrCorner, t: float) -> Touch:
    """Return the earlier of two contacts of a sphere: `best`, or its contact with an edge or corner at time t (s).

    rim : the edge or corner; f : number of its facet
    """
    if t > best.t:
        return best
    gap = without(subtract(course_position(course, t), rim.at), rim.along)
    n, v = scale(1.0 / norm(gap), gap), course_velocity(course, t)
    return sooner(best, Touch(t=t, facet=f, approach=max(-dot(n, v), 0.0), n=n, along=rim.along, face=False))


@kernel
def _lies_behind(facets: Facets, f: int, course: Course, foot: Vec) -> bool:
    """Return True if a sphere that touches an edge or corner of facet f moves along, or away from, a nearer part of f.

    foot : m, the point of the edge or corner that is closest to the centre of the sphere

    Such a corner is the end of an edge on which the sphere rolls; such an edge is another edge of a narrow facet. The
    edge or corner does not stop the sphere at once: the search for the contacts that carry the sphere
    (`touching.against`) does not find it.
    """
    near = foot_on(facets, f, course.x)
    gap = subtract(course.x, near)
    across = subtract(foot, near)
    if dot(across, across) <= facets.tolerance * facets.tolerance:
        return False
    return dot(gap, course.v) >= -GRAZING * norm(gap) * norm(course.v)


@kernel
def _time_into_rim(facets: Facets, course: Course, rim: EdgeOrCorner, q: Quartic, until: float) -> float:
    """Return the time (s) when a sphere hits an edge or corner that it already touches at the start; inf for never.

    This function is for an edge or corner that does not stop the sphere at once (`_lies_behind`). The sphere hits the
    edge or corner when both overlap by DEEP tolerances, or when the sphere has moved away and returns.

    rim : the edge or corner; until : s, end of the search
    q : polynomial of time: squared distance (m^2) of the centre from the line or corner, minus the square of the radius
        reduced by RIM tolerances
    """
    deep = _at_depth(q, course.radius, DEEP * facets.tolerance, RIM * facets.tolerance)
    if deep.c0 <= 0.0:
        return 0.0
    again = _at_depth(q, course.radius, ON_RIM * facets.tolerance, RIM * facets.tolerance)
    t = first_fall(deep, 0.0, until)
    back = _time_on_rim(facets, course, rim, again, 0.0, until)
    return min(back, t) if t < math.inf and _is_on(course, rim, t) else back


@kernel
def _at_depth(q: Quartic, radius: float, depth: float, before: float) -> Quartic:
    """Return a polynomial of time: squared distance (m^2) of a sphere's centre from an edge, minus (radius - depth)^2.

    The polynomial is 0 when the sphere overlaps the edge, or the corner, by the depth (m).

    q : the same polynomial with the depth `before` (m); radius : of the sphere (m)
    """
    return Quartic(c0=q.c0 + (depth - before) * (2.0 * radius - depth - before), c1=q.c1, c2=q.c2, c3=q.c3, c4=q.c4)


@kernel
def _time_from_rim(course: Course, p: Vec, v: Vec, a: Vec, distance: float, q: Quartic, until: float) -> float:
    """Return the time (s) when a sphere that already touches an edge or corner hits it: 0 for at once, inf for never.

    p, v, a : offset of the centre from the line or corner (m) and its derivatives (m/s, m/s^2); distance : |p| (m)
    q : polynomial of time: the squared distance minus the square of the radius reduced by RIM tolerances
    until : s, end of the search
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
    return first_fall(Quartic(c0=0.0, c1=max(q.c1, 0.0), c2=q.c2, c3=q.c3, c4=q.c4), 0.0, until)


@kernel
def _time_on_rim(facets: Facets, course: Course, rim: EdgeOrCorner, q: Quartic, begin: float, until: float) -> float:
    """Return the time (s) when a flying sphere first touches an edge or a corner; inf for never.

    The polynomial q of time is the squared distance (m^2) from the edge or corner, minus the square of the radius
    reduced by some tolerances. The polynomial falls through zero at most twice. The result is the first of these times
    at which the sphere touches the edge between its ends (`_is_on`).

    rim : the edge or corner; begin, until : s, begin and end of the search
    """
    for _ in range(2):
        t = first_fall(q, begin, until)
        if t == math.inf:
            return t
        at_rim = _polished(facets, course, rim, t)
        if _is_on(course, rim, at_rim):
            return at_rim
        begin = t
    return math.inf


@kernel
def _is_on(course: Course, rim: EdgeOrCorner, t: float) -> bool:
    """Return True if the point of an edge's line closest to a sphere's centre lies on the edge at time t (s).

    The result is True for a corner.
    """
    return 0.0 <= dot(subtract(course_position(course, t), rim.at), rim.along) <= rim.length


@kernel
def _polished(facets: Facets, course: Course, rim: EdgeOrCorner, t: float) -> float:
    """Return a more exact time (s) for the contact of a sphere with an edge or a corner near time t, by a Newton step.

    Time t is the root of a polynomial, which loses digits by rounding. The Newton step uses positions instead.
    """
    gap, v = without(subtract(course_position(course, t), rim.at), rim.along), course_velocity(course, t)
    distance = norm(gap)
    rate = dot(gap, v) / distance if distance > 0.0 else 0.0
    if not rate < 0.0:
        return t
    step = (distance - (course.radius - RIM * facets.tolerance)) / rate
    moved = abs(step) * norm(v)
    return max(t - step, 0.0) if moved <= POLISHED * facets.tolerance else t
