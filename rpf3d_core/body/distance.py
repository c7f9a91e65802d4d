"""Distance of a convex body and a triangle, by the search of Gilbert, Johnson and Keerthi (GJK).

The search keeps two bounds of the distance. The upper bound is the length of the shortest known difference v between a
point of the body and a point of the triangle. The lower bound is the gap between two parallel planes, which separate
the body from the triangle. The search ends when both bounds agree to rounding.

Source: Gilbert, Johnson and Keerthi 1988, IEEE J. Robot. Autom. 4:193.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.body.simplex import Simplex, Vertex, direction, extended, holds, on_face
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, dot, scale, subtract

Facet = tuple[Vec, Vec, Vec]

CLOSED = 1e-14
"""Difference of upper and lower bound, as a share (-) of the distance, at which the search ends."""

ROUNDING = 1e-15
"""Rounding error of a distance, as a share (-) of the largest difference between corners of body and facet."""

TOUCHING = 1e-14
"""Distance, as a share (-) of the largest difference between corners, below which rounding hides the normal."""

STALLS = 4
"""Number of rounds that may find no shorter difference v of body and triangle; one more such round ends the search.

Some such rounds are allowed because, on nearly parallel edges, the next vertex may still shorten v.
"""

ROUNDS = 100
"""Largest number of rounds of the search; 2 to 6 are usual. A round visits all corners of the body once."""


class Separation(NamedTuple):
    """The nearest points of a body and a triangle, in the body's axes.

    distance : m, 0 if body and triangle overlap
    normal : unit vector (3,) from the triangle towards the body; if they overlap, the direction of the given guess
    on_facet : nearest point (3,) m of the triangle
    on_body : nearest point (3,) m of the body
    overlap : true if no plane separates body and triangle; both points are then only some points near the overlap

    Nearly parallel edges or faces have many pairs of points that are equally close to rounding. The result is one pair.
    """

    distance: float
    normal: Vec
    on_facet: Vec
    on_body: Vec
    overlap: bool


@kernel
def _height(corners: Any, row: int, n: Vec) -> float:
    """Return the scalar product of n (3,) and the corner in row `row` of `corners` (N, 3)."""
    height: float = n[0] * corners[row, 0] + n[1] * corners[row, 1] + n[2] * corners[row, 2]
    return height


@kernel
def lowest(corners: Any, first: int, last: int, n: Vec) -> int:
    """Return the row, from `first` to `last` - 1, of the corner with the smallest scalar product with n (3,).

    corners : (N, 3); if several corners have the smallest product, the first row counts

    Two searches run in parallel in one loop, each over every second corner, so that neither waits for the comparison of
    the other.
    """
    least, row, other_least, other = math.inf, first, math.inf, first
    for i in range(first, last - 1, 2):
        height, other_height = _height(corners, i, n), _height(corners, i + 1, n)
        if height < least:
            least, row = height, i
        if other_height < other_least:
            other_least, other = other_height, i + 1
    if (last - first) % 2 == 1 and _height(corners, last - 1, n) < least:
        least, row = _height(corners, last - 1, n), last - 1
    return other if other_least < least or (other_least == least and other < row) else row


@kernel
def highest(facet: Facet, n: Vec) -> int:
    """Return the number (0 to 2) of the facet's corner that lies farthest in the direction n (3,)."""
    a, b, c = dot(facet[0], n), dot(facet[1], n), dot(facet[2], n)
    if a >= b and a >= c:
        return 0
    return 1 if b >= c else 2


@kernel
def corner_of(facet: Facet, i: int) -> Vec:
    """Return corner i (0 to 2) of the facet, (3,) m."""
    if i == 0:
        return facet[0]
    return facet[1] if i == 1 else facet[2]


@kernel
def corner_at(corners: Any, row: int, size: float) -> Vec:
    """Return one corner (3,) m of a body, in the body's axes: row `row` of `corners`, multiplied by `size`.

    corners : (N, 3) corners for a body of size 1; size : m, radius of the sphere of equal volume
    """
    return size * corners[row, 0], size * corners[row, 1], size * corners[row, 2]


@kernel
def unit(a: Vec) -> Vec:
    """Return a vector scaled to length 1; the zero vector unchanged."""
    square = dot(a, a)
    return scale(1.0 / math.sqrt(square), a) if square > 0.0 else a


@kernel
def vertex(corner: Vec, row: int, facet: Facet, i: int) -> Vertex:
    """Return the difference of a corner of the body and a corner of the facet, as a vertex for the GJK search.

    corner : (3,) m, the corner of the body; row : number of this corner; i : number of the facet's corner, 0 to 2
    """
    return Vertex(w=subtract(corner, corner_of(facet, i)), body=row, corner=i)


@kernel
def reach(a: Vertex) -> float:
    """Return an upper bound of the length (m) of a difference of two corners: the sum of its absolute components."""
    return abs(a.w[0]) + abs(a.w[1]) + abs(a.w[2])


@kernel
def begun(corner: Vec, row: int, facet: Facet) -> Simplex:
    """Return the simplex with which the GJK search begins: the part of the facet nearest to one corner of the body.

    corner : (3,) m, the corner of the body; row : number of this corner
    """
    a, b, c = vertex(corner, row, facet, 0), vertex(corner, row, facet, 1), vertex(corner, row, facet, 2)
    return on_face(a, b, c)


@routine
def separation(corners: Any, first: int, last: int, size: float, facet: Facet, guess: Vec) -> Separation:
    """Return the distance between a convex body and a triangle, and their nearest points.

    corners : (N, 3); the rows `first` to `last` - 1 times `size` (m) are the body's corners, in the body's axes
    facet : the triangle's corners (3,) m, in the body's axes
    guess : (3,), of any length above 0: a guess of the direction from the triangle towards the body

    The distance is exact to 1e-9 of the body's size for gaps from 1e-6 m. A gap below 1e-7 m between nearly parallel
    edges may count as an overlap. A good guess saves time. The guess changes the distance only by rounding. If body and
    triangle overlap, the resulting normal is the guess.
    """
    row = lowest(corners, first, last, guess)
    now = begun(corner_at(corners, row, size), row, facet)
    longest, lower, normal, stalls = max(reach(now.a), reach(now.c)), -math.inf, guess, 0
    for _ in range(ROUNDS):
        n = direction(now)
        length, square = math.sqrt(now.square), dot(n, n)
        if length <= TOUCHING * longest or square <= 0.0:
            break
        row = lowest(corners, first, last, n)
        new = vertex(corner_at(corners, row, size), row, facet, highest(facet, n))
        bound, longest = dot(n, new.w) / math.sqrt(square), max(longest, reach(new))
        if bound > lower:
            lower, normal = bound, n
        allowed = CLOSED * length + ROUNDING * longest
        if length - lower <= allowed or holds(now, new):
            break
        then = extended(new, now, lower > 0.0)
        stalls += 1 if then.square >= now.square else 0
        if stalls > STALLS or math.sqrt(then.square) > length + allowed:
            break
        now = then
    return _found(corners, size, facet, now, normal if lower > 0.0 else guess, lower <= 0.0)


@kernel
def _found(corners: Any, size: float, facet: Facet, now: Simplex, n: Vec, overlap: bool) -> Separation:
    """Return the result of a GJK search that ended with the simplex `now` and the normal n (3,), of any length.

    corners, size, facet : as in `separation`; overlap : True if body and facet overlap
    """
    a, b, c = now.a, now.b, now.c
    ground = corner_of(facet, a.corner), corner_of(facet, b.corner), corner_of(facet, c.corner)
    body = corner_at(corners, a.body, size), corner_at(corners, b.body, size), corner_at(corners, c.body, size)
    return Separation(
        distance=0.0 if overlap else math.sqrt(now.square),
        normal=unit(n),
        on_facet=_mixed(now.weights, ground),
        on_body=_mixed(now.weights, body),
        overlap=overlap,
    )


@kernel
def _mixed(weights: Vec, points: tuple[Vec, Vec, Vec]) -> Vec:
    """Return the weighted mean (3,) of three points; the sum of the weights is 1."""
    return add(scale(weights[0], points[0]), add(scale(weights[1], points[1]), scale(weights[2], points[2])))
