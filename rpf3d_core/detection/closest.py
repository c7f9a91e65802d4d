"""Find the facet closest to a point, for the methods with fixed time steps and for spheres; one rule per locator."""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.detection.bucket_grid import cells_between
from rpf3d_core.detection.bucket_locator import BucketLocator, grid_of
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.terrain.facet_geometry import contains, corner, on_plane, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, dot, scale, subtract

SURELY = 1e-300
"""Least distance (m) of a point from all edges of a facet at which the point counts as inside the facet.

The value is nearly 0, but not 0, because `contains` needs a value above 0.
"""


class Closest(NamedTuple):
    """The facet closest to a point, and its distance (m).

    If no facet is within the search radius, `facet` is -1 and `distance` is the search radius.
    """

    distance: float
    facet: int


@model_function
def closest_facet(locator: object, facets: Facets, x: Vec, radius: float) -> Closest:
    """Return the facet closest to x (3,) m within a radius (m), and its distance; one rule per locator.

    Of equally close facets, locators may return any one.
    """


@closest_facet.rule(BucketLocator)
def closest_in_buckets(locator: BucketLocator, facets: Facets, x: Vec, radius: float) -> Closest:
    """Return the facet closest to x (3,) m within a radius (m), from the buckets of a grid.

    Only facets nearer than the radius are found. In a tie, the smaller facet number counts.
    """
    best = Closest(radius, -1)
    cells = cells_between(grid_of(locator), x[0] - radius, x[1] - radius, x[0] + radius, x[1] + radius)
    for j in range(cells.bottom, cells.top):
        for i in range(cells.left, cells.right):
            k = j * locator.nx + i
            for entry in range(locator.starts[k], locator.starts[k + 1]):
                f: Any = np.int64(locator.ids[entry])
                best = _closer(facets, f, x, best)
    return best


@kernel
def _closer(facets: Facets, f: int, x: Vec, best: Closest) -> Closest:
    """Return the closer of `best` and facet f; most facets are excluded by the distance to their plane alone.

    x : (3,) m, the point of the search; best : the closest facet so far
    """
    n, a = stored_normal(facets, f), corner(facets, f, 0)
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return best
    if abs(dot(n, subtract(x, a))) > best.distance:
        return best
    distance = distance_to_facet(facets, f, x)
    if distance < best.distance or (distance == best.distance and f < best.facet):
        return Closest(distance, f)
    return best


@kernel
def distance_to_facet(facets: Facets, f: int, x: Vec) -> float:
    """Return the distance (m) from x (3,) m to the closest point of facet f, which may lie on an edge or a corner."""
    gap = subtract(x, closest_point(facets, f, x))
    return math.sqrt(dot(gap, gap))


@kernel
def closest_point(facets: Facets, f: int, x: Vec) -> Vec:
    """Return the point of facet f closest to x (m): a corner, a point of an edge, or a point inside the facet.

    The point is used for distances to the terrain, and for the direction from the terrain to a sphere.

    Sources
    -------
    Ericson 2005, Real-Time Collision Detection, section 5.1.5.
    """
    a, b, c = corner(facets, f, 0), corner(facets, f, 1), corner(facets, f, 2)
    ab, ac = subtract(b, a), subtract(c, a)
    from_a, from_b, from_c = subtract(x, a), subtract(x, b), subtract(x, c)
    d1, d2 = dot(ab, from_a), dot(ac, from_a)
    d3, d4 = dot(ab, from_b), dot(ac, from_b)
    d5, d6 = dot(ab, from_c), dot(ac, from_c)
    if d1 <= 0.0 and d2 <= 0.0:
        return a
    if d3 >= 0.0 and d4 <= d3:
        return b
    if d6 >= 0.0 and d5 <= d6:
        return c
    beside_ab, beside_ac, beside_bc = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if beside_ab <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return add(a, scale(d1 / (d1 - d3), ab))
    if beside_ac <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return add(a, scale(d2 / (d2 - d6), ac))
    if beside_bc <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        return add(b, scale((d4 - d3) / ((d4 - d3) + (d5 - d6)), subtract(c, b)))
    whole = beside_ab + beside_ac + beside_bc
    return add(a, add(scale(beside_ac / whole, ab), scale(beside_ab / whole, ac)))


@kernel
def foot_on(facets: Facets, f: int, x: Vec) -> Vec:
    """Return the point of facet f closest to x (m), exact to rounding also on a needle (a long, thin facet).

    In `closest_point` the place on a needle is a quotient of small areas, with errors of many tolerances along the
    needle. A sphere would then touch the facet at a wrong angle. So where x is above or below the inside of the facet,
    the result is the foot of the perpendicular from x to the plane of the facet.
    """
    foot = on_plane(facets, f, x)
    return foot if contains(facets, f, foot, True, SURELY) else closest_point(facets, f, x)
