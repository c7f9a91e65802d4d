"""Which of several facets takes a contact that all of them meet at the same instant.

Speeds, normals and places decide, so that the order of the facets in the file does not.
"""

from rpf3d_core.arc import Arc, gravity_along, position, velocity
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, dot, subtract, without


@kernel
def wins_tie(facets: Facets, f: int, g: int, arc: Arc, t: float, approach: float, other: float) -> bool:
    """Whether of facets f and g, both met after t seconds of an arc, f takes the contact.

    It does if it is met more head-on (approach, other: m/s), else by the components of its normal, else `_lies_first`.
    """
    if approach != other:
        return approach > other
    n, m = stored_normal(facets, f), stored_normal(facets, g)
    for k in range(3):
        if n[k] != m[k]:
            return n[k] > m[k]
    return _lies_first(facets, f, g, arc, t, n)


@kernel
def _lies_first(facets: Facets, f: int, g: int, arc: Arc, t: float, n: Vec) -> bool:
    """Whether of two facets of one plane f lies further left of the rock's way, or further ahead; else by number.

    Of what is told by the way nothing depends on the axes either. A rock that goes straight into the plane has none
    there, nor will it have one: only the number that is told for its facet hangs on the file then.
    """
    p, v = position(arc, t), velocity(arc, t)
    way = without(v, n) if v[0] != 0.0 or v[1] != 0.0 or v[2] != 0.0 else gravity_along(n, arc.gravity)
    for axis in (cross(n, way), way):
        mine, others = _reach(facets, f, p, axis), _reach(facets, g, p, axis)
        for k in range(3):
            if mine[k] != others[k]:
                return mine[k] > others[k]
    return f < g


@kernel
def _reach(facets: Facets, f: int, p: Vec, axis: Vec) -> Vec:
    """How far the corners of facet f lie from p (m) along an axis, in its length, the furthest first."""
    a, b, c = (dot(subtract(corner(facets, f, 0), p), axis), dot(subtract(corner(facets, f, 1), p), axis),
               dot(subtract(corner(facets, f, 2), p), axis))  # fmt: skip
    return max(a, b, c), max(min(a, b), min(max(a, b), c)), min(a, b, c)
