"""Find the point of an edge, a triangle or a tetrahedron that is nearest to the origin: a step of the GJK search.

The vertices are differences of a corner of the body and a corner of the facet. Every result is a convex combination of
its vertices, so its length is never below the true distance, even if rounding selects a neighbouring feature.

Source: the signed areas and volumes follow Montanari, Petrinic and Barbieri 2017, ACM Trans. Graph. 36:30.
"""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, cross, dot, scale, subtract


class Vertex(NamedTuple):
    """The difference w (3,) m of a corner of the body and a corner of a facet.

    body : row of the body's corner in the array of corners; corner : number of the facet's corner, 0 to 2
    """

    w: Vec
    body: int
    corner: int


class Simplex(NamedTuple):
    """The smallest simplex (point, edge or triangle) that contains the point v (3,) m nearest to the origin.

    size : number of vertices, 1 to 3 in the order a, b, c, or 4 if the origin lies inside a tetrahedron
    weights : shares (-) of a, b and c in v, none negative, with sum 1
    square : squared length of v (m^2)
    """

    size: int
    a: Vertex
    b: Vertex
    c: Vertex
    weights: Vec
    v: Vec
    square: float


@kernel
def on_point(a: Vertex) -> Simplex:
    """Return the simplex of a single vertex."""
    return Simplex(size=1, a=a, b=a, c=a, weights=(1.0, 0.0, 0.0), v=a.w, square=dot(a.w, a.w))


@kernel
def on_edge(a: Vertex, b: Vertex) -> Simplex:
    """Return the part of the edge from a to b that is nearest to the origin: the edge or one of its ends."""
    edge = subtract(b.w, a.w)
    length, ahead = dot(edge, edge), -dot(a.w, edge)
    if ahead <= 0.0:
        return on_point(a)
    if ahead >= length:
        return on_point(b)
    share = ahead / length
    v = add(a.w, scale(share, edge))
    return Simplex(size=2, a=a, b=b, c=b, weights=(1.0 - share, share, 0.0), v=v, square=dot(v, v))


@kernel
def closer(first: Simplex, second: Simplex) -> Simplex:
    """Return the simplex whose point v is closer to the origin; `first` if both are equally close."""
    return second if second.square < first.square else first


@routine
def on_face(a: Vertex, b: Vertex, c: Vertex) -> Simplex:
    """Return the part of the triangle a b c that is nearest to the origin: its inside, an edge or a corner."""
    ab, ac = subtract(b.w, a.w), subtract(c.w, a.w)
    n = cross(ab, ac)
    whole = dot(n, n)
    of_b, of_c = dot(cross(ac, a.w), n), dot(cross(a.w, ab), n)
    of_a = whole - of_b - of_c
    flat = whole <= 0.0
    if not flat and of_a >= 0.0 and of_b >= 0.0 and of_c >= 0.0:
        return _inside_face(a, b, c, (of_a / whole, of_b / whole, of_c / whole))
    return _on_outline(a, b, c, (flat or of_a < 0.0, flat or of_b < 0.0, flat or of_c < 0.0))


@kernel
def _inside_face(a: Vertex, b: Vertex, c: Vertex, weights: Vec) -> Simplex:
    """Return the simplex of three vertices; weights : (3,) of the vertices in the point nearest to the origin."""
    v = add(a.w, add(scale(weights[1], subtract(b.w, a.w)), scale(weights[2], subtract(c.w, a.w))))
    return Simplex(size=3, a=a, b=b, c=c, weights=weights, v=v, square=dot(v, v))


@kernel
def _on_outline(a: Vertex, b: Vertex, c: Vertex, beyond: tuple[bool, bool, bool]) -> Simplex:
    """Return the part of the outline of a triangle that is nearest to the origin: an edge or a corner.

    beyond : for a, b and c, true if the origin lies beyond the opposite edge; only such an edge can be nearest
    """
    best = on_point(a)
    if beyond[2]:
        best = closer(best, on_edge(a, b))
    if beyond[1]:
        best = closer(best, on_edge(a, c))
    if beyond[0]:
        best = closer(best, on_edge(b, c))
    return best


@kernel
def hides(a: Vec, b: Vec, c: Vec, d: Vec) -> bool:
    """Return True if the origin lies on the same side of the plane through a, b and c as the point d.

    Then the triangle a b c is not the part of the tetrahedron a b c d that is nearest to the origin.
    """
    n = cross(subtract(b, a), subtract(c, a))
    return dot(n, subtract(d, a)) * -dot(n, a) > 0.0


@kernel
def in_solid(a: Vertex, old: Simplex, apart: bool) -> Simplex:
    """Return the part of the tetrahedron of vertex a and triangle `old` that is nearest to the origin.

    If the origin lies inside the tetrahedron, the result has size 4. Otherwise the result is a corner, an edge or a
    triangle, but not the triangle `old` itself, which cannot be nearest.

    a : the new vertex; old : the current simplex, of three vertices
    apart : true if body and facet are known to be apart, so that the origin cannot lie inside the tetrahedron
    """
    b, c, d = old.a, old.b, old.c
    no_abc, no_acd, no_abd = hides(a.w, b.w, c.w, d.w), hides(a.w, c.w, d.w, b.w), hides(a.w, b.w, d.w, c.w)
    all_hidden = no_abc and no_acd and no_abd
    if all_hidden and not apart:
        return Simplex(size=4, a=b, b=c, c=d, weights=old.weights, v=(0.0, 0.0, 0.0), square=0.0)
    best = on_point(a)
    if all_hidden or not no_abc:
        best = closer(best, on_face(a, b, c))
    if all_hidden or not no_acd:
        best = closer(best, on_face(a, c, d))
    if all_hidden or not no_abd:
        best = closer(best, on_face(a, b, d))
    return best


@kernel
def extended(a: Vertex, old: Simplex, apart: bool) -> Simplex:
    """Add a vertex to a simplex: return the part of the larger simplex that is nearest to the origin.

    a : the new vertex; old : the simplex, of 1 to 3 vertices; apart : as in `in_solid`
    """
    if old.size == 1:
        return on_edge(a, old.a)
    if old.size == 2:
        return on_face(a, old.a, old.b)
    return in_solid(a, old, apart)


@kernel
def holds(simplex: Simplex, new: Vertex) -> bool:
    """Return True if the simplex already has the vertex `new`, so that the vertex would change nothing."""
    a, b, c = simplex.a, simplex.b, simplex.c
    return same(new, a) or (simplex.size > 1 and same(new, b)) or (simplex.size > 2 and same(new, c))


@kernel
def same(a: Vertex, b: Vertex) -> bool:
    """Return True if two vertices are differences of the same corners."""
    return a.body == b.body and a.corner == b.corner


@kernel
def direction(simplex: Simplex) -> Vec:
    """Return a vector (3,), of any length, at right angles to the simplex and towards its point v.

    Without rounding, v itself has this direction. But v has few exact digits if the gap is small and the vertices are
    far from the origin.
    """
    if simplex.size == 1:
        return simplex.v
    along = subtract(simplex.b.w, simplex.a.w)
    if simplex.size == 2:
        return _at_right_angles(simplex.v, along)
    n = cross(along, subtract(simplex.c.w, simplex.a.w))
    return n if dot(n, simplex.a.w) >= 0.0 else scale(-1.0, n)


@kernel
def _at_right_angles(v: Vec, along: Vec) -> Vec:
    """Return the component (3,) of v at right angles to the vector `along`, which is not 0."""
    return subtract(v, scale(dot(v, along) / dot(along, along), along))
