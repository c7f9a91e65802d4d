"""Select one facet if a rock meets several facets at the same time.

Speeds, normals and positions decide, so that the result does not depend on the order of the facets in the file. There
is one exception: facets in one plane that a rock meets at right angles (`_lies_first`).
"""

from rpf3d_core.arc import Arc, gravity_along, position, velocity
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, dot, subtract, without


@kernel
def wins_tie(facets: Facets, f: int, g: int, arc: Arc, t: float, approach: float, other: float) -> bool:
    """Return True if facet f takes precedence over facet g, for a contact in which an arc meets both after t seconds.

    The facet that the rock meets at the larger speed takes precedence. If the speeds are equal, the components of the
    normal are compared, x first, and the larger component takes precedence. For equal normals, `_lies_first` decides.

    approach : speed (m/s) into facet f; for a rock at rest, the pull of gravity along facet f (m/s^2)
    other : the same quantity for facet g
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
    """Return True if facet f takes precedence over facet g as the facet of a contact, for two facets in one plane.

    The facet further to the left of the rock's motion takes precedence, then the facet further ahead, then the smaller
    number. For a rock at rest, the direction of descent replaces the motion. Directions relative to the motion are used
    because they do not depend on the coordinate axes. A rock that moves straight into the plane has no motion along the
    plane: then the reported facet depends on the order of the facets in the file.

    n : (3,) normal of the plane
    t : time of the contact on the arc (s)
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
    """Return the scalar products (3,) of an axis with the vectors from p to the corners of facet f, largest first.

    p : (3,) m, a point; axis : (3,) of any length
    """
    a, b, c = (dot(subtract(corner(facets, f, 0), p), axis), dot(subtract(corner(facets, f, 1), p), axis),
               dot(subtract(corner(facets, f, 2), p), axis))  # fmt: skip
    return max(a, b, c), max(min(a, b), min(max(a, b), c)), min(a, b, c)
