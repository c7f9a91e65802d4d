"""An arc over one facet: from when to when in plan, and how high above it. Exact times, no samples."""

import math

from rpf3d_core.arc import Arc
from rpf3d_core.detection.stretch import SLOWEST
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, subtract

VERTICAL = 1e-7
"""Cosine of the angle to the vertical below which a facet has no plan: 20 m of wall would be 2 um wide there, and the
height above its plane nothing but rounding."""


@kernel
def under(facets: Facets, f: int, arc: Arc, begin: float, end: float) -> tuple[float, float]:
    """From when to when, between two times (s), an arc passes over facet f in plan; the end before the begin if never.

    The straight line that the arc is in plan enters and leaves a triangle through those edges whose ends lie on either
    side of it; where it does is told from the places of the two ends along and across the line.
    """
    if abs(stored_normal(facets, f)[2]) <= VERTICAL:
        return math.inf, -math.inf
    speed2 = arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1]
    if speed2 < SLOWEST:
        return (begin, end) if _holds(facets, f, arc.x) else (math.inf, -math.inf)
    a0, c0 = along_across(facets, f, 0, arc)
    a1, c1 = along_across(facets, f, 1, arc)
    a2, c2 = along_across(facets, f, 2, arc)
    if min(c0, c1, c2) >= 0.0 or max(c0, c1, c2) < 0.0:
        return math.inf, -math.inf
    first = crossing(a0, c0, a1, c1) if (c0 >= 0.0) != (c1 >= 0.0) else crossing(a1, c1, a2, c2)
    second = crossing(a2, c2, a0, c0) if (c2 >= 0.0) != (c0 >= 0.0) else crossing(a1, c1, a2, c2)
    per_second = 1.0 / speed2
    return max(min(first, second) * per_second, begin), min(max(first, second) * per_second, end)


@kernel
def along_across(facets: Facets, f: int, k: int, arc: Arc) -> tuple[float, float]:
    """Place of corner k of facet f along the line of an arc in plan and to its left, from its start (m^2/s)."""
    p = corner(facets, f, k)
    x, y = p[0] - arc.x[0], p[1] - arc.x[1]
    return x * arc.v[0] + y * arc.v[1], y * arc.v[0] - x * arc.v[1]


@kernel
def crossing(a: float, across_a: float, b: float, across_b: float) -> float:
    """Place along the line at which it crosses an edge, from the places of its ends along and across it.

    The same whichever end comes first, so neighbours agree on where the one ends and the other begins.
    """
    if across_a < across_b:
        a, across_a, b, across_b = b, across_b, a, across_a
    return a + (b - a) * (across_a / (across_a - across_b))


@kernel
def _holds(facets: Facets, f: int, x: Vec) -> bool:
    """Whether a point lies over facet f in plan, its rim included."""
    side = math.copysign(1.0, stored_normal(facets, f)[2])
    for k in range(3):
        a, b = corner(facets, f, k), corner(facets, f, (k + 1) % 3)
        if side * ((b[0] - a[0]) * (x[1] - a[1]) - (b[1] - a[1]) * (x[0] - a[0])) < 0.0:
            return False
    return True


@kernel
def largest_height(facets: Facets, f: int, arc: Arc, low: float, high: float) -> float:
    """Largest vertical height (m) of an arc above the plane of f between two times; negative if it stays below it."""
    c, b = above_plane(facets, f, arc)
    return largest_above(c, b, arc.gravity, low, high)


@kernel
def above_plane(facets: Facets, f: int, arc: Arc) -> tuple[float, float]:
    """Vertical height (m) of an arc above the plane of f when it begins, and how fast that grows then (m/s).

    After t it is c + b t - g t^2 / 2.
    """
    n = stored_normal(facets, f)
    return dot(n, subtract(arc.x, corner(facets, f, 0))) / n[2], dot(n, arc.v) / n[2]


@kernel
def largest_above(c: float, b: float, g: float, low: float, high: float) -> float:
    """Largest height c + b t - g t^2 / 2 (m) between two times (s): at one of them or, where b = g t, in between."""
    height = max(c + (b - 0.5 * g * low) * low, c + (b - 0.5 * g * high) * high)
    if g > 0.0 and low * g < b < high * g:
        height = max(height, c + 0.5 * b * b / g)
    return height
