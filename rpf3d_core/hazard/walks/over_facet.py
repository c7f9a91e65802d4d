"""Find when an arc is over a facet in plan, and how high above it; times and heights are exact, not sampled."""

import math

from rpf3d_core.arc import Arc
from rpf3d_core.detection.stretch import SLOWEST
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, subtract

VERTICAL = 1e-7
"""Vertical part of the unit normal (-) below which a facet counts as vertical, without area in plan.

A wall 20 m high would be 2 um wide in plan, and the height above its plane would be a rounding error.
"""


@kernel
def under(facets: Facets, f: int, arc: Arc, begin: float, end: float) -> tuple[float, float]:
    """Return when an arc is over facet f in plan: begin and end (s); end <= begin if never.

    begin, end : the result is limited to these times (s) of the arc

    The arc is a straight line in plan. The line enters and leaves a triangle through the two edges whose ends lie on
    different sides of the line. The positions of these ends along and across the line give the crossings.
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
    """Return the position in plan of corner k of facet f: along the line of an arc, and to the left of the line.

    Both values are distances (m), from the arc's start and from the line, times the arc's speed in plan (m/s): m^2/s.
    """
    p = corner(facets, f, k)
    x, y = p[0] - arc.x[0], p[1] - arc.x[1]
    return x * arc.v[0] + y * arc.v[1], y * arc.v[0] - x * arc.v[1]


@kernel
def crossing(a: float, across_a: float, b: float, across_b: float) -> float:
    """Return where a line crosses an edge: the position along the line, in the unit of `a` and `b`.

    a, across_a and b, across_b : positions of the two ends of the edge along and across the line
    Exchanging the two ends does not change the result, so two neighbouring facets find equal bits for the crossing.
    """
    if across_a < across_b:
        a, across_a, b, across_b = b, across_b, a, across_a
    return a + (b - a) * (across_a / (across_a - across_b))


@kernel
def _holds(facets: Facets, f: int, x: Vec) -> bool:
    """Return True if a point x (3,) m lies over facet f in plan; points over the sides of the facet count."""
    side = math.copysign(1.0, stored_normal(facets, f)[2])
    for k in range(3):
        a, b = corner(facets, f, k), corner(facets, f, (k + 1) % 3)
        if side * ((b[0] - a[0]) * (x[1] - a[1]) - (b[1] - a[1]) * (x[0] - a[0])) < 0.0:
            return False
    return True


@kernel
def largest_height(facets: Facets, f: int, arc: Arc, low: float, high: float) -> float:
    """Return the largest height (m) of an arc above the plane of facet f from the time `low` to the time `high` (s).

    The height is negative if the arc is always below the plane.
    """
    c, b = above_plane(facets, f, arc)
    return largest_above(c, b, arc.gravity, low, high)


@kernel
def above_plane(facets: Facets, f: int, arc: Arc) -> tuple[float, float]:
    """Return the vertical height c of an arc above the plane of facet f at the start of the arc, and the rate b of c.

    c : m; b : m/s. After t (s) the height is c + b t - g t^2 / 2, with the gravity g of the arc.
    """
    n = stored_normal(facets, f)
    return dot(n, subtract(arc.x, corner(facets, f, 0))) / n[2], dot(n, arc.v) / n[2]


@kernel
def largest_above(c: float, b: float, g: float, low: float, high: float) -> float:
    """Return the largest value of the height c + b t - g t^2 / 2 (m) from t = `low` to t = `high` (s)."""
    height = max(c + (b - 0.5 * g * low) * low, c + (b - 0.5 * g * high) * high)
    if g > 0.0 and low * g < b < high * g:
        height = max(height, c + 0.5 * b * b / g)
    return height
