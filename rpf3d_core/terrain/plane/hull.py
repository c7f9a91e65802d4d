"""Find the convex hull of points in plan, with exact arithmetic.

`shapely.convex_hull` is not used: in GEOS 3.14.1, the hull of points that lie on straight sides up to rounding may lack
a corner, or run through the middle of the points. The rim of a rotated rectangular survey has such points.
"""

import numpy as np
import shapely

from rpf3d_core.terrain.frame import FloatArray

MANTISSA_BITS = 53
"""Number of bits of the mantissa of a floating-point number, with the leading bit."""

Point = tuple[int, int]


def convex_hull(points: FloatArray) -> shapely.Geometry:
    """Return the convex hull of points in plan as a polygon, clockwise from its lowest corner.

    No corner lies on a side. Points on a straight line have no polygon; for them the result is the line, or a point.

    Algorithm: monotone chain (Andrew 1979, Information Processing Letters 9:216). The coordinates become integers, so
    each comparison is exact.

    points : (P, 2) m, at least one; finite
    """
    places = np.unique(points + 0.0, axis=0)
    exact = _as_integers(places)
    right, left = _chain(exact, range(len(exact))), _chain(exact, range(len(exact) - 1, -1, -1))
    ring = places[(right[:-1] + left[:-1])[::-1]]
    if len(ring) > 2:
        return shapely.polygons(np.roll(ring, -int(np.lexsort((ring[:, 0], ring[:, 1]))[0]), axis=0))
    return shapely.linestrings(ring) if len(ring) == 2 else shapely.points(places[0])


def _as_integers(points: FloatArray) -> list[Point]:
    """Return points (P, 2) m as pairs of integers: the coordinates times one power of two."""
    share, power = np.frexp(points)
    digits = (share * 2.0**MANTISSA_BITS).astype(np.int64)
    shift = np.where(digits == 0, 0, power - power.min(where=digits != 0, initial=power.max()))
    return [(x << i, y << j) for (x, y), (i, j) in zip(digits.tolist(), shift.tolist(), strict=True)]


def _chain(points: list[Point], order: range) -> list[int]:
    """Return the points, as indices, from the first to the last point of `order`, so that the chain only turns left.

    order : indices of the points, sorted along x, either way
    """
    chain: list[int] = []
    for k in order:
        while len(chain) > 1 and not _turns_left(points[chain[-2]], points[chain[-1]], points[k]):
            chain.pop()
        chain.append(k)
    return chain


def _turns_left(a: Point, b: Point, c: Point) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])
