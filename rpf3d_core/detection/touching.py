"""What a sphere that lies on the ground touches: which contact stands most against a direction."""

import math
from typing import NamedTuple

from rpf3d_core.detection.closest import closest_point
from rpf3d_core.detection.contact import GRAZING
from rpf3d_core.detection.sphere_contact import ON_RIM, Course, Touch, earlier_touch, stays_on
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.terrain.facet_geometry import NEAR, corner, edge_distance, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import dot, norm, scale, subtract, without


class Sweep(NamedTuple):
    """Asks for the first contact of a course that ends after `end` (s), of those in its first `before` seconds."""

    course: Course
    end: float
    before: float


class Against(NamedTuple):
    """Asks which of the contacts of a sphere, about a centre x (3,) m, stands most against a vector `way` (3,).

    v, down : (3,) m/s and m/s^2: contacts that the sphere moves off are none, and a face is one only where it leads on
    radius : of the sphere (m); noise : of the way, in its unit
    """

    x: Vec
    way: Vec
    v: Vec
    down: Vec
    radius: float
    noise: float


class Nearest(NamedTuple):
    """Asks for the feature nearest to x (3,) m; `Touch.t` is its distance (m)."""

    x: Vec


@model_function
def looked_at(quest: object, facets: Facets, f: int, best: Touch) -> Touch:
    """The better answer to a question of `best` and facet f; the order in which facets are asked decides nothing."""


@model_function
def scan(locator: object, facets: Facets, low: Vec, high: Vec, quest: object, best: Touch) -> Touch:
    """Ask all facets that reach into a box between two corners (3,) m; one rule per locator."""


@looked_at.rule(Sweep)
def swept(quest: Sweep, facets: Facets, f: int, best: Touch) -> Touch:
    """The earlier contact."""
    return earlier_touch(facets, f, quest.course, quest.end, quest.before, best)


@looked_at.rule(Nearest)
def nearest(quest: Nearest, facets: Facets, f: int, best: Touch) -> Touch:
    """The nearer one; of a facet that x lies on, its normal upwards stands for the way there."""
    n = stored_normal(facets, f)
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return best
    gap = subtract(quest.x, closest_point(facets, f, quest.x))
    distance = norm(gap)
    if distance > best.t:
        return best
    away = scale(1.0 / distance, gap) if distance > 0.0 else scale(math.copysign(1.0, n[2]), n)
    return lesser(best, Touch(distance, f, 0.0, away, ZERO, False))


@looked_at.rule(Against)
def against(quest: Against, facets: Facets, f: int, best: Touch) -> Touch:
    """The contact that stands more against the way: `Touch.t` is the part of the way along its normal, below zero.

    A face on which the sphere stands counts before an edge that stands against the way as much, but for the angle
    under which an edge within tolerance of the sphere may be seen from it.
    """
    n = stored_normal(facets, f)
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return best
    p = closest_point(facets, f, quest.x)
    gap = subtract(quest.x, p)
    distance = norm(gap)
    if distance > quest.radius + NEAR * facets.tolerance or distance == 0.0:
        return best
    m = scale(1.0 / distance, gap)
    if dot(m, quest.v) > GRAZING * norm(quest.v):
        return best
    face, along = _on_face(quest, facets, f, p), ZERO
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
    return lesser(best, Touch(opposed, f, 0.0, m, along, face))


@kernel
def _passes(quest: Against, tolerance: float, m: Vec, along: Vec, distance: float) -> bool:
    """Whether a sphere that goes straight on its way passes an edge or corner that it is only near to (`RIM`)."""
    way = without(quest.way, along)
    toward, clear = dot(m, way) * distance, quest.radius - ON_RIM * tolerance
    return (distance * distance - clear * clear) * dot(way, way) > toward * toward


@kernel
def _on_face(quest: Against, facets: Facets, f: int, p: Vec) -> bool:
    """Whether p (m) lies on the face of f, and the sphere does not move, or roll, off it across an edge."""
    off = without(subtract(quest.x, p), stored_normal(facets, f))
    return norm(off) <= 2.0 * facets.tolerance and stays_on(facets, f, p, quest.v, quest.down)


@kernel
def _rim_of(facets: Facets, f: int, p: Vec) -> Vec:
    """Direction (3,) unit of the edge of f that p (m) lies on; zero at a corner."""
    for k in range(3):
        begin = corner(facets, f, k)
        if norm(subtract(p, begin)) <= facets.tolerance:
            return ZERO
    for k in range(3):
        squared, distance = edge_distance(facets, f, k, p)
        if distance * distance <= 4.0 * facets.tolerance * facets.tolerance * squared:
            edge = subtract(corner(facets, f, (k + 1) % 3), corner(facets, f, k))
            return scale(1.0 / math.sqrt(squared), edge)
    return ZERO


@kernel
def lesser(best: Touch, other: Touch) -> Touch:
    """The answer of smaller `t`; of two alike the one of larger normal, then of smaller number."""
    if best.facet < 0 or other.t != best.t:
        return other if best.facet < 0 or other.t < best.t else best
    for k in range(3):
        if other.n[k] != best.n[k]:
            return other if other.n[k] > best.n[k] else best
    return other if other.facet < best.facet else best
