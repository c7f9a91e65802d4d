"""Searches among the facets around a sphere: first contact, contact that stops the sphere, nearest feature.

A feature is the interior, an edge or a corner of a facet.
"""

import math
from typing import NamedTuple

from rpf3d_core.detection.closest import foot_on
from rpf3d_core.detection.contact import GRAZING
from rpf3d_core.detection.sphere_contact import earlier_touch, stays_on
from rpf3d_core.detection.sphere_course import Course, Touch
from rpf3d_core.detection.sphere_rim import ON_RIM
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.terrain.facet_geometry import NEAR, corner, edge_distance, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, dot, norm, scale, subtract, without


class SphereSweep(NamedTuple):
    """Search for the first contact of a moving sphere.

    course : motion of the sphere's centre; end : s, end of this motion
    before : s, at most `end`; contacts after this time are not needed
    """

    course: Course
    end: float
    before: float


class Against(NamedTuple):
    """Search for the contact that most opposes a vector `way` (3,), a velocity (m/s) or an acceleration (m/s^2).

    This contact has the most negative component of `way` along its normal, so it stops a sphere pushed along `way`.

    x : (3,) m, centre of the sphere; v, down : (3,) m/s and m/s^2, velocity and acceleration of the sphere
    radius : radius of the sphere (m); noise : rounding of `way`, in the unit of `way`

    A contact does not count if the sphere moves away from it. The normal of an edge or a corner may differ by a few
    tolerances divided by the radius from that of the facet that the sphere moves along: such an edge still counts. The
    interior of a facet counts only if the sphere stays on the facet.
    """

    x: Vec
    way: Vec
    v: Vec
    down: Vec
    radius: float
    noise: float


class Nearest(NamedTuple):
    """Search for the interior, edge or corner of a facet that is nearest to a point x (3,) m.

    `Touch.t` of the result is the distance (m).
    """

    x: Vec


@model_function
def looked_at(quest: object, facets: Facets, f: int, best: Touch) -> Touch:
    """Return the better result of a search: `best`, or the result for facet f; the order of facets does not matter.

    quest : the search, such as `SphereSweep`
    """


@model_function
def scan(locator: object, facets: Facets, low: Vec, high: Vec, quest: object, best: Touch) -> Touch:
    """Return the best result of a search among the facets in a box around a sphere; one rule per locator.

    low, high : (3,) m, corners of the box
    quest : the search, such as `SphereSweep`, `Against` or `Nearest`; best : the best result so far, NO_TOUCH for none
    """


@looked_at.rule(SphereSweep)
def swept(quest: SphereSweep, facets: Facets, f: int, best: Touch) -> Touch:
    """Return the earlier of two contacts of a moving sphere: `best`, or the first contact with facet f."""
    return earlier_touch(facets, f, quest.course, quest.end, quest.before, best)


@looked_at.rule(Nearest)
def nearest(quest: Nearest, facets: Facets, f: int, best: Touch) -> Touch:
    """Return the result nearer to the point x of the search: `best`, or the point of facet f that is closest to x.

    `Touch.t` is the distance (m), and `Touch.n` the direction from the facet to x. If x lies on facet f, this direction
    is the upward normal of facet f.
    """
    n = stored_normal(facets, f)
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return best
    gap = subtract(quest.x, foot_on(facets, f, quest.x))
    distance = norm(gap)
    if distance > best.t:
        return best
    away = scale(1.0 / distance, gap) if distance > 0.0 else scale(math.copysign(1.0, n[2]), n)
    return lesser(best, Touch(t=distance, facet=f, approach=0.0, n=away, along=ZERO, face=False))


@looked_at.rule(Against)
def against(quest: Against, facets: Facets, f: int, best: Touch) -> Touch:
    """Return the contact that opposes the vector `quest.way` more: `best`, or the contact with facet f.

    `Touch.t` is the component of `way` along the normal of the contact, below zero. The interior of a facet takes
    precedence over an edge with almost the same component: for the interior, the component is lowered by |way| times
    the largest angle between the normal of the interior and the normal of an edge within tolerance of the sphere.

    An edge takes precedence over its end: where a sphere rolls along the edge over the end, both oppose `way` equally.
    """
    n = stored_normal(facets, f)
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return best
    p = foot_on(facets, f, quest.x)
    gap = subtract(quest.x, p)
    distance = norm(gap)
    if distance > quest.radius + NEAR * facets.tolerance or distance == 0.0:
        return best
    m, speed = scale(1.0 / distance, gap), norm(quest.v)
    away, rounding = dot(m, quest.v), 2.0 * (GRAZING + facets.tolerance / quest.radius)
    if away > rounding * speed:
        return best
    face, along = _on_face(quest, facets, f, p), ZERO
    if face and away > GRAZING * speed:
        return best
    if face:
        side = 1.0 if dot(n, gap) >= 0.0 else -1.0
        m = scale(side, n)
    else:
        along = _rim_of(facets, f, p)
    opposed = dot(m, quest.way)
    if not opposed < -quest.noise or (not face and _passes(quest, facets.tolerance, m, along, distance)):
        return best
    if face:
        opposed -= 2.0 * math.sqrt(2.0 * NEAR * facets.tolerance / quest.radius) * norm(quest.way)
    else:
        along = _along_at_end(facets, f, p, gap, quest.v, along)
        if along[0] != 0.0 or along[1] != 0.0 or along[2] != 0.0:
            opposed -= rounding * norm(quest.way)
    return lesser(best, Touch(t=opposed, facet=f, approach=0.0, n=m, along=along, face=face))


@kernel
def _passes(quest: Against, tolerance: float, m: Vec, along: Vec, distance: float) -> bool:
    """Return True if a sphere that moves straight along `quest.way` passes an edge or a corner without contact.

    m : (3,) unit, from the edge or corner to the sphere's centre; along : (3,) unit, along the edge, zero for a corner
    distance : m, of the centre from the edge or corner; tolerance : of the terrain, m
    """
    way = without(quest.way, along)
    toward, clear = dot(m, way) * distance, quest.radius - ON_RIM * tolerance
    return (distance * distance - clear * clear) * dot(way, way) > toward * toward


@kernel
def _on_face(quest: Against, facets: Facets, f: int, p: Vec) -> bool:
    """Return True if a sphere touches the interior of facet f at p (m) and does not leave the facet across an edge.

    In a shallow groove, gravity alone would pull the sphere off each flank, across the bottom line. But the other flank
    turns this pull along the groove. So it is enough if the sphere stays on the facet when it is pushed along
    `quest.way`.
    """
    off = without(subtract(quest.x, p), stored_normal(facets, f))
    if norm(off) > 2.0 * facets.tolerance:
        return False
    return stays_on(facets, f, p, quest.v, quest.down) or stays_on(facets, f, p, quest.v, quest.way)


@kernel
def _rim_of(facets: Facets, f: int, p: Vec) -> Vec:
    """Return the unit vector (3,) along the edge of facet f on which point p (m) lies; zero if p is a corner.

    Near a corner, p may lie on two edges within tolerance; the nearer edge counts.
    """
    for k in range(3):
        begin = corner(facets, f, k)
        if norm(subtract(p, begin)) <= facets.tolerance:
            return ZERO
    along, least = ZERO, 4.0 * facets.tolerance * facets.tolerance
    for k in range(3):
        squared, distance = edge_distance(facets, f, k, p)
        if distance * distance <= least * squared:
            along = scale(1.0 / math.sqrt(squared), subtract(corner(facets, f, (k + 1) % 3), corner(facets, f, k)))
            least = distance * distance / squared
    return along


@kernel
def _along_at_end(facets: Facets, f: int, p: Vec, gap: Vec, v: Vec, along: Vec) -> Vec:
    """Return the unit vector (3,) along the edge that carries a sphere near a corner; zero if the corner carries it.

    p : m, the point of facet f that the sphere touches; gap : (3,) m, from p to the centre
    v : (3,) m/s, velocity; along : (3,) unit, from `_rim_of`; if `along` is not zero, the result is `along`

    An edge carries the sphere if the sphere's foot on the line of the edge lies on the edge, within tolerance of its
    end; or if the foot lies within tolerance before the edge, and the sphere moves onto the edge.
    """
    if along[0] != 0.0 or along[1] != 0.0 or along[2] != 0.0:
        return along
    for k in range(3):
        for at, other in ((k, (k + 1) % 3), ((k + 1) % 3, k)):
            end = corner(facets, f, at)
            if norm(subtract(p, end)) <= facets.tolerance:
                edge = subtract(corner(facets, f, other), end)
                length = norm(edge)
                foot = dot(add(gap, subtract(p, end)), edge)
                least = -facets.tolerance * length if dot(v, edge) > 0.0 else 0.0
                if least <= foot <= facets.tolerance * length:
                    return scale(1.0 / length, edge)
    return ZERO


@kernel
def lesser(best: Touch, other: Touch) -> Touch:
    """Return the better of two search results: the result with the smaller `t`, a time, a distance or a component.

    If both values of `t` are equal, the larger components of the normal decide, then the smaller facet number. If
    `best` has no facet (a number below 0), the result is `other`.
    """
    if best.facet < 0 or other.t != best.t:
        return other if best.facet < 0 or other.t < best.t else best
    for k in range(3):
        if other.n[k] != best.n[k]:
            return other if other.n[k] > best.n[k] else best
    return other if other.facet < best.facet else best
