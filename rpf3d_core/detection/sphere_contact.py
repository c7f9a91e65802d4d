"""Exact contact of a sphere with a facet: the narrow phase for spheres whose centre follows a parabola.

A feature of a facet is its interior, an edge or a corner. The foot is the point of a feature's plane, line or corner
that is closest to the centre of the sphere. The distance from the plane is a quadratic in time. The squared distance
from the line of an edge, or from a corner, is a quartic (`sphere_rim.py`). The sphere touches a feature when the
distance falls through the radius R while the foot lies on the feature. The normal of the contact points from the foot
to the centre. So rough ground deflects small spheres, and large spheres roll over its roughness.

If the sphere touches or overlaps a feature at the start, three rules replace the search for a root:

- If the sphere approaches the feature, it hits the feature at once. If the sphere moves along the feature, it hits the
  feature at once when the acceleration presses it against the feature.
- If the sphere moves away from the feature, the root at the start is divided out: the sphere hits the feature when it
  returns to the same distance.
- If the sphere moves along, or away from, a nearer feature of the same facet, an edge or a corner does not stop it at
  once, but only where the sphere sinks into the edge or corner. So the end of an edge does not stop a sphere that rolls
  along this edge.

The result depends neither on the facet that the sphere has left nor on the order in which facets are tested.
"""

import math

from rpf3d_core.arc import falling_time
from rpf3d_core.detection.contact import GRAZING
from rpf3d_core.detection.sphere_course import Course, Touch, course_position, course_velocity, sooner
from rpf3d_core.detection.sphere_rim import earlier_on_rim
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import (
    NEAR,
    contains,
    corner,
    edge_distance,
    edge_inward,
    stored_normal,
    time_into,
)
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import dot, norm, scale, subtract, without


@kernel
def earlier_touch(facets: Facets, f: int, course: Course, end: float, before: float, best: Touch) -> Touch:
    """Return the earlier of two contacts of a moving sphere: `best`, found so far, or the first contact with facet f.

    end : s, finite, end of the whole motion; the search always runs up to this time, so the time of a contact has the
        same bits in any order of the facets
    before : s, contacts after this time need not be found
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
    for turned in (side, -side):  # a sphere that passes the plane outside the facet may hit either side of the facet
        best = _earlier_on_face(facets, f, course, scale(turned, n), turned * c, best)
    for k in range(6):
        best = earlier_on_rim(facets, f, k, course, end, before, best)
    return best


@kernel
def _earlier_on_face(facets: Facets, f: int, course: Course, n: Vec, c: float, best: Touch) -> Touch:
    """Return the earlier of two contacts of a moving sphere: `best`, or its contact with the interior of facet f.

    n : normal of the facet towards the tested side; c : m, height of the centre above the facet's plane at the start
    """
    b, a, gap = dot(n, course.v), dot(n, course.a), c - course.radius
    near = NEAR * facets.tolerance
    if c >= 0.0 and gap <= near and contains(facets, f, course.x, False, facets.tolerance):
        t = _time_from_touch(b, a, course)
        if t == 0.0 and b * b <= GRAZING * GRAZING * dot(course.v, course.v):
            t = 0.0 if stays_on(facets, f, course.x, course.v, course.a) else math.inf
        if gap < -near and b > 0.0:
            t = min(t, falling_time(gap, b, 0.5 * a))
    else:
        t = falling_time(max(gap, 0.0) if gap >= -near else gap, b, 0.5 * a)
        if t < math.inf and course.a[2] == -course.gravity and not _is_over(facets, f, course, t):
            t = _entry_time(facets, f, course, n, t)
        elif t == math.inf and b > 0.0 > a and gap - 0.5 * b * b / a >= -near and course.a[2] == -course.gravity:
            t = _time_from_border(facets, f, course, gap, b, a)
    if t > best.t or not _is_over(facets, f, course, t):
        return best
    return sooner(best, Touch(t=t, facet=f, approach=max(-(b + a * t), 0.0), n=n, along=ZERO, face=True))


@kernel
def _is_over(facets: Facets, f: int, course: Course, t: float) -> bool:
    """Return True if the point of facet f's plane closest to a sphere's centre lies in facet f at time t (s).

    The result is False if t is inf.
    """
    return t < math.inf and contains(facets, f, course_position(course, t), False, facets.tolerance)


@kernel
def _entry_time(facets: Facets, f: int, course: Course, n: Vec, t: float) -> float:
    """Return the time (s) when a flying sphere meets facet f, if it reaches the plane of f at time t (s) outside f.

    The result is inf if the sphere does not meet facet f.

    n : normal of the facet towards the sphere

    A sphere that rolls fast takes off at the edge between its facet and facet f, if f bends away. At an angle of 1e-10
    to 1e-3 rad, the sphere must come back to facet f at once. But rounding may have put the sphere just below the
    plane, or the sphere may reach the plane before its contact point has crossed the border of facet f. The sphere then
    meets facet f at this border, if two conditions hold: the sphere does not rise there, and its distance from the
    plane has changed since time t by at most NEAR tolerances. A sphere that sinks deeper has met the edge before.
    """
    x, v = course_position(course, t), course_velocity(course, t)
    later = time_into(facets, f, x, v, course.a, facets.tolerance)
    if later == math.inf:
        return math.inf
    b, a = dot(n, v), dot(n, course.a)
    height = (b + 0.5 * a * later) * later
    return t + later if abs(height) <= NEAR * facets.tolerance and b + a * later <= 0.0 else math.inf


@kernel
def _time_from_border(facets: Facets, f: int, course: Course, gap: float, b: float, a: float) -> float:
    """Return the time (s) when a flying sphere meets facet f, if it rises to the plane of f, but not above it.

    The result is inf if the sphere does not meet facet f.

    gap : height (m) of the sphere above the plane of f at the start, negative
    b, a : its speed (m/s) and acceleration (m/s^2) away from the plane

    A sphere that takes off from an edge of facet f, or lands on it, is below the plane of f until its foot crosses the
    border of f: at a distance d outside f, by d^2 / 2R. If its height above the plane is at most NEAR tolerances at the
    border, it touches facet f there, and meets it there or where it comes back to this height. A sphere that is deeper
    has met the edge before.
    """
    t = time_into(facets, f, course.x, course.v, course.a, facets.tolerance)
    if t == math.inf or abs(gap + (b + 0.5 * a * t) * t) > NEAR * facets.tolerance:
        return math.inf
    rate = b + a * t
    if rate <= 0.0:
        return t
    return t - 2.0 * rate / a if a < 0.0 else math.inf


@kernel
def _time_from_touch(b: float, a: float, course: Course) -> float:
    """Return the time (s) when a sphere that already touches a plane hits the plane: 0 for at once, inf for never.

    b, a : speed (m/s) and acceleration (m/s^2) of the sphere away from the plane
    """
    speed2, pull = dot(course.v, course.v), course.gravity
    if b * b <= GRAZING * GRAZING * speed2:
        return 0.0 if a < -GRAZING * pull else math.inf
    if b < 0.0:
        return 0.0
    return -2.0 * b / a if a < 0.0 else math.inf


@kernel
def stays_on(facets: Facets, f: int, p: Vec, v: Vec, a: Vec) -> bool:
    """Return True if a sphere that touches the interior of facet f will keep touching it: the foot crosses no edge.

    p : m, the foot, that is the point of facet f that the sphere touches; or the centre of the sphere
    v, a : velocity (m/s) and acceleration (m/s^2) of p

    If the foot crosses an edge, the sphere touches only the edge: it rolls around the edge, or flies off.
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
