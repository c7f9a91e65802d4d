"""Segments of a sphere's path on the ground: how long one lasts, and where and how it ends."""

import math
from typing import NamedTuple

from rpf3d_core.detection.contact import GRAZING
from rpf3d_core.detection.narrow_phase import falling_time
from rpf3d_core.detection.sphere_contact import RIM, Course, Touch
from rpf3d_core.detection.swept import Swept, stretch_end
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.simulation.sphere_hold import Held
from rpf3d_core.simulation.sphere_impacts import nearest_to
from rpf3d_core.terrain.facet_geometry import NEAR, edge_distance, edge_inward
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale, without

CURVE = 1.0 / 32.0
"""Largest length of a segment on an edge or a corner, over R (-): the normal turns by 1.8 degrees."""


class Span(NamedTuple):
    """Duration of a segment (s), and whether the sphere moves around an edge or a corner."""

    t: float
    curved: bool


@kernel
def span_of(facets: Facets, held: Held, course: Course, t: float) -> Span:
    """Return the time until the centre comes over the end of a face, but at most t (s).

    Around an edge or a corner the segment also ends after the largest length that one segment may have.
    """
    faces = held.first.face and (held.contacts == 1 or held.second.face)
    if held.first.face:
        t = min(t, _face_end(facets, held.first, course))
    if held.contacts == 2 and held.second.face:
        t = min(t, _face_end(facets, held.second, course))
    if not faces:
        t = min(t, stretch_end(course, 0.0, CURVE * course.radius, t))
    return Span(t, not faces)


@kernel
def _face_end(facets: Facets, touch: Touch, course: Course) -> float:
    """Return when the centre comes over the end of the face that it touches (s); inf if it never does."""
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
        end = min(end, falling_time(c, b, 0.5 * a))
    return end


@kernel
def normal_between(n: Vec, n_end: Vec, share: float) -> Vec:
    """Return the normal (3,) unit after a share of a segment that begins with the normal n and ends with n_end."""
    both = add(scale(1.0 - share, n), scale(share, n_end))
    return scale(1.0 / norm(both), both)


@kernel
def length_between(v: Vec, v_end: Vec, t: float) -> float:
    """Return the length (m) of a segment between two velocities, by Simpson's rule: exact for a straight segment."""
    middle = norm(scale(0.5, add(v, v_end)))
    return t * (norm(v) + 4.0 * middle + norm(v_end)) / 6.0


@kernel
def put_back(facets: Facets, locator: Swept, x: Vec, n: Vec, length: float, turns: bool) -> tuple[Vec, Vec]:
    """Return the centre, put back to its distance from the ground, and the normal there.

    Around an edge or a corner, a segment of some length (m) leaves the ground by at most length^2 / 2R; on a face only
    by rounding.
    """
    near = NEAR * facets.tolerance
    gap = near + length * length / (2.0 * locator.radius)
    touch = nearest_to(locator.locator, facets, x, locator.radius + gap)
    if touch.t > locator.radius + gap:
        return x, n
    if abs(touch.t - locator.radius) <= 1.5 * RIM * facets.tolerance:
        return x, touch.n if turns else n
    back = add(x, scale(locator.radius - touch.t, touch.n))
    return back, touch.n if turns else n


@kernel
def turned_to(v: Vec, n: Vec) -> Vec:
    """Return a velocity turned into the plane of n, with its speed kept."""
    flat = without(v, n)
    speed = norm(flat)
    return scale(norm(v) / speed, flat) if speed > 0.0 else flat


@kernel
def rolling_spin(v: Vec, w: Vec, n: Vec, radius: float) -> Vec:
    """Return the spin (3,) rad/s of a sphere that rolls with v over ground of normal n; its spin about n is kept."""
    return add(scale(1.0 / radius, cross(n, v)), scale(dot(w, n), n))
