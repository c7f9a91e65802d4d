"""Path segments of a sphere on the ground: their duration, and position, velocity and spin of the sphere at the end."""

import math
from typing import NamedTuple

from rpf3d_core.arc import falling_time
from rpf3d_core.detection.contact import GRAZING
from rpf3d_core.detection.sphere_course import Course, Touch
from rpf3d_core.detection.sphere_rim import RIM
from rpf3d_core.detection.swept import Swept, stretch_end
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rolling_moment import STICKS
from rpf3d_core.simulation.sphere_hold import Held
from rpf3d_core.simulation.sphere_release import nearest_to
from rpf3d_core.terrain.facet_geometry import NEAR, edge_distance, edge_inward
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale, without

CURVE = 1.0 / 32.0
"""Largest length of a ground segment on an edge or a corner, divided by the radius (-).

The normal of the ground turns by at most 1.8 degrees in such a segment.
"""

LEAST = CURVE / 1024.0
"""Length of a ground segment on an edge or a corner, divided by the radius (-), that no level contact makes shorter.

The contact then leans over by at most 3e-5 rad. Without this length, rounding would leave a contact that is never
level, and segments of almost no length.
"""


class Span(NamedTuple):
    """A ground segment of a sphere: its duration t (s); curved : True if it leads around an edge or a corner."""

    t: float
    curved: bool


@kernel
def span_of(facets: Facets, held: Held, course: Course, t: float) -> Span:
    """Return the duration of a sphere's next ground segment: until the sphere leaves its facet, but at most t (s).

    The sphere leaves the facet when the contact point passes the facet's border. Around an edge or a corner the segment
    also ends at its largest length, CURVE times the radius, and where the contact is level, because beyond it the
    ground carries no sphere.

    held : contacts that carry the sphere; course : motion of the sphere
    """
    faces = held.first.face and (held.contacts == 1 or held.second.face)
    if held.first.face:
        t = min(t, _face_end(facets, held.first, course))
    if held.contacts == 2 and held.second.face:
        t = min(t, _face_end(facets, held.second, course))
    if not faces:
        t = min(t, stretch_end(course, 0.0, CURVE * course.radius, t))
    if held.contacts == 1 and not held.first.face:
        t = min(t, max(_level_time(held.first, course), stretch_end(course, 0.0, LEAST * course.radius, t)))
    return Span(t, not faces)


@kernel
def _face_end(facets: Facets, touch: Touch, course: Course) -> float:
    """Return the time (s) until the contact point of a sphere passes the border of the facet that it touches.

    The result is inf if the contact point never passes the border.

    touch : the contact; course : motion of the sphere
    """
    f, end, noise = touch.facet, math.inf, GRAZING * norm(course.v)
    foot = add(course.x, scale(-course.radius, touch.n))
    for k in range(3):
        inward = edge_inward(facets, f, k)
        squared, c = edge_distance(facets, f, k, foot)
        b, a, length = dot(inward, course.v), dot(inward, course.a), math.sqrt(squared)
        if c <= facets.tolerance * length:
            c = 0.0
            if abs(b) <= noise * length:
                b = 0.0
            if b < 0.0 or (b == 0.0 and a >= -GRAZING * length * course.gravity):
                continue
            if b == 0.0:
                c = facets.tolerance * length  # not 0: a segment without length would be repeated without end
        end = min(end, falling_time(c, b, 0.5 * a))
    return end


@kernel
def _level_time(touch: Touch, course: Course) -> float:
    """Return the time (s) until the line from an edge or a corner to a sphere's centre is level; inf if it never is.

    touch : the contact with the edge or the corner; course : motion of the sphere
    """
    v, a = without(course.v, touch.along), without(course.a, touch.along)
    return falling_time(course.radius * touch.n[2], v[2], 0.5 * a[2])


@kernel
def normal_between(n: Vec, n_end: Vec, share: float) -> Vec:
    """Return the unit normal (3,) of the ground at a share (0 to 1) of a segment, between its normals at both ends.

    n : at the start; n_end : at the end
    """
    both = add(scale(1.0 - share, n), scale(share, n_end))
    return scale(1.0 / norm(both), both)


@kernel
def length_between(v: Vec, v_end: Vec, t: float) -> float:
    """Return the length (m) of a ground segment of t seconds, from the velocities v at its start and v_end at its end.

    The length follows from Simpson's rule, which is exact for a straight segment without a reversal of the motion.
    """
    middle = norm(scale(0.5, add(v, v_end)))
    return t * (norm(v) + 4.0 * middle + norm(v_end)) / 6.0


@kernel
def put_back(facets: Facets, locator: Swept, x: Vec, n: Vec, length: float, turns: bool) -> tuple[Vec, Vec]:
    """Return the sphere's centre, moved back to its distance R from the ground, and the ground's normal there.

    x, n : (3,) centre (m) and normal before; length : of the segment (m)
    turns : True if the normal may have changed; otherwise the returned normal is n

    Around an edge or a corner, the distance of the centre differs from R by at most length^2 / 2R after one segment; on
    a facet, only by rounding errors. If no ground lies within this difference, x and n are returned unchanged.

    A sphere on an edge may be too low by RIM tolerances, because the search for contacts lowers edges by this depth. A
    sphere on a facet must not be too low, because the edges of the facet would then stop the sphere.
    """
    near = NEAR * facets.tolerance
    gap = near + length * length / (2.0 * locator.radius) if turns else near
    touch = nearest_to(locator.locator, facets, x, locator.radius + gap)
    if touch.t > locator.radius + gap:
        return x, n
    if abs(touch.t - locator.radius) <= (1.5 if turns else 0.5) * RIM * facets.tolerance:
        return x, touch.n if turns else n
    back = add(x, scale(locator.radius - touch.t, touch.n))
    return back, touch.n if turns else n


@kernel
def turned_to(v: Vec, n: Vec) -> Vec:
    """Return the velocity v (3,) m/s at a curved segment's end, turned into the plane of normal n at the same speed."""
    flat = without(v, n)
    speed = norm(flat)
    return scale(norm(v) / speed, flat) if speed > 0.0 else flat


@kernel
def pivoted(v: Vec, w: Vec, n: Vec, n_end: Vec, radius: float) -> tuple[Vec, Vec]:
    """Return velocity and spin of a sphere that has rolled on while the normal of the ground turned from n to n_end.

    v : (3,) m/s, at the end, along the ground; w : (3,) rad/s, before the sphere pivots

    Around an edge or a corner, the normal turns about an axis e. The spin about the normal, w_n, then becomes rolling
    along e, and rolling along e becomes spin about the normal. If theta is the angle of the turn:
        d v_e / d theta = 2/7 R w_n,   R d w_n / d theta = -v_e
    The energy of these two motions, 7/10 v_e^2 + 1/5 R^2 w_n^2 per unit of mass, stays constant. On a facet, n does not
    turn.

    radius : R of the sphere, m
    """
    axis, about = cross(n, n_end), dot(w, n)
    turn, share = norm(axis), math.sqrt(STICKS)
    if turn > 0.0:
        e = scale(1.0 / turn, axis)
        angle, before = share * math.atan2(turn, dot(n, n_end)), dot(v, e)
        after = before * math.cos(angle) + share * radius * about * math.sin(angle)
        about = about * math.cos(angle) - before / (share * radius) * math.sin(angle)
        v = add(v, scale(after - before, e))
    return v, rolling_spin(v, about, n_end, radius)


@kernel
def rolling_spin(v: Vec, about: float, n: Vec, radius: float) -> Vec:
    """Return the spin (3,) rad/s of a sphere that rolls with velocity v (3,) m/s on ground of normal n, without slip.

    about : component of the spin about n (rad/s); radius : of the sphere, m
    """
    return add(scale(1.0 / radius, cross(n, v)), scale(about, n))
