"""Geometry of one facet, for the search for contacts: distances, containment, and where a path leaves the facet."""

import math

from rpf3d_core.arc import falling_time
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, dot, norm, scale, subtract, without

ALONG_EDGE = 1e-14
"""Sine of the angle below which a direction on a facet counts as parallel to an edge: 30 times the rounding error.
"""
ALONG_GULLY = 1e-10
"""Sine of the angle below which a direction counts as parallel to the line between two facets.

The computed direction of this line has an error of 1e-16 over the sine of the angle between the facets.
"""
PARALLEL = 1e-5
"""Sine of the angle between two facets, below which the facets count as one plane.

Above this sine, the direction of the line between the facets, computed from the normals, has an error below 1e-10.
"""
ALONGSIDE = 16.0
"""Length of a path, in crack widths, above which a facet carries a rock that moves just outside an edge of the facet.

On this length the path must stay at most a crack's width outside the facet.
"""
FLAT = 1.0 / 64.0
"""Sine of the angle to an edge below which a rock's direction counts as almost along the edge.

The facet may carry such a rock also just outside the edge, so that the rock does not fall there.
"""
NEAR = 4.0
"""Distance from the plane of a facet, in tolerances, within which a rock counts as on the plane.

The distance is more than one tolerance, because a rock may be one tolerance outside the edge of its facet and then
another tolerance away from the neighbouring facet. Such distances must not add up to a fall.
"""
TIP = 2.0
"""Distance outside a facet's box, as a multiple of the slack, up to which `contains` may count a point as in the facet.

Beyond the tip of a needle-shaped facet, a point can be within the slack of both edges and still far from the corner: at
a distance of the slack over the sine of half the angle. Without this limit the result would depend on which facets the
locator tests.
"""
REACH = 1024.0
"""Distance outside a facet's box, in tolerances, within which a locator must test the facet.

A rock may be NEAR x CRACK = 256 tolerances away from the plane of a facet, and TIP times this distance away from its
corners: 768 tolerances in total.
"""


@kernel
def corner(facets: Facets, f: int, k: int) -> Vec:
    """Return the coordinates (m) of corner k (0, 1, 2) of facet f, from the terrain's arrays."""
    first = 12 * f + 3 * k
    return facets.geometry[first], facets.geometry[first + 1], facets.geometry[first + 2]


@kernel
def stored_normal(facets: Facets, f: int) -> Vec:
    """Return the unit normal of facet f towards its free side, from the terrain's arrays; zero if f has no area."""
    first = 12 * f + 9
    return facets.geometry[first], facets.geometry[first + 1], facets.geometry[first + 2]


@kernel
def contains(facets: Facets, f: int, p: Vec, strictly: bool, slack: float) -> bool:
    """Return True if point p (m), projected onto the plane of facet f, lies in the facet.

    strictly : the point must lie inside by more than `slack` (m, above 0); otherwise it may lie up to `slack` outside

    If the point does not lie inside every edge by more than `slack`, it must also lie in the facet's box, widened by
    `TIP` times `slack`. Most points lie well inside, and need no test of the box.
    """
    deep = True
    for k in range(3):
        squared, distance = edge_distance(facets, f, k, p)
        near = distance * distance <= slack * slack * squared
        inside = distance > 0.0 and not near
        if not inside and (strictly or not (distance >= 0.0 or near)):
            return False
        deep = deep and inside
    return deep or is_at_box(facets, f, on_plane(facets, f, p), TIP * slack)


@kernel
def is_at_box(facets: Facets, f: int, p: Vec, slack: float) -> bool:
    """Return True if p (m) lies in the box around facet f, widened by a slack (m)."""
    a, b, c = corner(facets, f, 0), corner(facets, f, 1), corner(facets, f, 2)
    inside = True
    for k in range(3):
        inside = inside and min(a[k], b[k], c[k]) - slack <= p[k] <= max(a[k], b[k], c[k]) + slack
    return inside


@kernel
def edge_distance(facets: Facets, f: int, k: int, p: Vec) -> tuple[float, float]:
    """Return the squared length (m^2) of edge k of facet f, and the distance of p from the edge times the length (m^2).

    The distance is positive on the inner side of the edge. Neither number needs a square root.

    p : (3,) m; the distance is measured in the plane of the facet
    """
    begin = corner(facets, f, k)
    edge = subtract(corner(facets, f, (k + 1) % 3), begin)
    inward = cross(stored_normal(facets, f), edge)
    return dot(edge, edge), dot(inward, subtract(p, begin))


@kernel
def edge_inward(facets: Facets, f: int, k: int) -> Vec:
    """Return a vector in the plane of facet f, perpendicular to edge k and inwards, with the length of the edge (m)."""
    edge = subtract(corner(facets, f, (k + 1) % 3), corner(facets, f, k))
    return cross(stored_normal(facets, f), edge)


@kernel
def on_plane(facets: Facets, f: int, x: Vec) -> Vec:
    """Return the point (3,) m of facet f's plane that is closest to x (m), to put a rock exactly onto its facet."""
    n = stored_normal(facets, f)
    return subtract(x, scale(dot(n, subtract(x, corner(facets, f, 0))), n))


@kernel
def on_line(facets: Facets, first: int, second: int, x: Vec) -> Vec:
    """Return the point closest to x (m) on the line where the planes of two facets meet, to put a rock into a gully.

    x must lie on the plane of the first facet. If both planes are almost the same, the result is x.

    first, second : numbers of the facets
    """
    n, m = stored_normal(facets, first), stored_normal(facets, second)
    across = without(m, n)
    squared = dot(across, across)
    if squared <= PARALLEL * PARALLEL:
        return x
    off = dot(m, subtract(x, corner(facets, second, 0)))
    return subtract(x, scale(off / squared, across))


@kernel
def line_exit(facets: Facets, f: int, x: Vec, direction: Vec, parallel: float, slack: float) -> float:
    """Return the distance (m) that a rock at x can move in a direction over facet f until it leaves the facet.

    The rock leaves the facet at the first edge that its path crosses. If the path crosses an edge at a small angle
    (sine below `FLAT`), the rock leaves only at the distance `slack` outside this edge. If the path crosses no edge,
    and no box ends it, the result is inf.

    x : m; direction : (3,) unit
    parallel : sine of the angle between path and edge below which the path does not cross the edge
    slack : m; if above 0, the path also ends at the box of the facet, widened by `slack`
    """
    leave = math.inf
    for k in range(3):
        inward = edge_inward(facets, f, k)
        closing, length = -dot(inward, direction), norm(inward)
        if closing > parallel * length:
            distance = edge_distance(facets, f, k, x)[1]
            if closing < FLAT * length:
                distance = distance + slack * length
            leave = min(leave, max(distance, 0.0) / closing)
    return min(leave, _box_exit(facets, f, x, direction, slack)) if slack > 0.0 else leave


@kernel
def _box_exit(facets: Facets, f: int, x: Vec, direction: Vec, slack: float) -> float:
    """Return the distance (m) that a rock at x can move in a direction until it leaves the box of facet f.

    slack : m by which the box is widened

    Without the box, a path beyond the tip of a needle-shaped facet could stay near both edges for a long distance.
    """
    a, b, c = corner(facets, f, 0), corner(facets, f, 1), corner(facets, f, 2)
    leave = math.inf
    for k in range(3):
        if direction[k] > 0.0:
            leave = min(leave, max((max(a[k], b[k], c[k]) + slack - x[k]) / direction[k], 0.0))
        elif direction[k] < 0.0:
            leave = min(leave, max((min(a[k], b[k], c[k]) - slack - x[k]) / direction[k], 0.0))
    return leave


@kernel
def lies_below(facets: Facets, f: int, other: int, side: float, slack: float) -> bool:
    """Return True if facet f lies below the plane of the facet `other`, for example across a convex edge.

    Facet f lies below the plane if none of its corners is more than `slack` (m) above the plane, and at least one is
    more than `slack` below. A rock that moves from `other` across a convex edge flies off and does not hit facet f.

    side : the side of the facet `other` that counts as above: 1 along its normal, -1 against its normal
    """
    n, origin = stored_normal(facets, other), corner(facets, other, 0)
    highest, lowest = -math.inf, math.inf
    for k in range(3):
        height = side * dot(n, subtract(corner(facets, f, k), origin))
        highest, lowest = max(highest, height), min(lowest, height)
    return highest <= slack and lowest < -slack


@kernel
def goes_beside(facets: Facets, f: int, x: Vec, way: Vec) -> bool:
    """Return True if a straight path in the plane of facet f stays on the facet for more than `ALONGSIDE` crack widths.

    A path almost parallel to an edge counts as on the facet up to one crack width outside this edge.

    x : m, start of the path; way : (3,) direction of the path, of any length; for a zero vector the result is True
    """
    length = norm(way)
    if length == 0.0:
        return True
    return line_exit(facets, f, x, scale(1.0 / length, way), ALONG_EDGE, facets.crack) > ALONGSIDE * facets.crack


@kernel
def leads_on(facets: Facets, f: int, x: Vec, direction: Vec, parallel: float) -> bool:
    """Return True if a straight path over facet f stays on the facet for more than the contact tolerance.

    x : m, start of the path; direction : (3,) unit vector along the path
    parallel : sine of the angle between path and edge below which the path does not cross the edge
    """
    return line_exit(facets, f, x, direction, parallel, 0.0) > facets.tolerance


@kernel
def time_into(facets: Facets, f: int, p: Vec, v: Vec, a: Vec, slack: float) -> float:
    """Return the time (s) at which a moving point has crossed all edges of facet f outside which the point started.

    The point is projected onto the plane of the facet. The result is 0 for a point that starts inside all edges, and
    inf if the point starts outside an edge and never crosses it.

    p, v, a : position (3,) m and velocity (3,) m/s at time 0, and constant acceleration (3,) m/s^2 of the point
    slack : distance (m) outside an edge up to which the point counts as inside
    """
    inside = 0.0
    for k in range(3):
        squared, distance = edge_distance(facets, f, k, p)
        if distance < 0.0 and distance * distance > slack * slack * squared:
            inward = edge_inward(facets, f, k)
            inside = max(inside, falling_time(-distance, -dot(inward, v), -0.5 * dot(inward, a)))
    return inside
