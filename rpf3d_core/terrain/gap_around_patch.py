"""Make triangles that fill the ring between a patch (a new survey of a part of the terrain) and the ground around it.

The points on both sides of the ring get a Delaunay triangulation. To make each given edge an edge of the triangulation,
the diagonals that cross this edge are swapped (Sloan 1993, Computers & Structures 47:441). No point is added, so no
point lies in the middle of an edge: the seam has no T-junction. The orientation of three points is computed exactly.
"""

from collections import deque
from fractions import Fraction

import numpy as np
import shapely
import shapely.errors
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.border import without_opposite

Edge = tuple[int, int]
Place = tuple[float, float]

AROUND = 4.0
"""Distance of four extra points from the box around all points, divided by the longer side of the box or 1 m (-).

The four points are the corners of a rectangle that contains all edges of the ring.
"""
SURE = 4e-16
"""Largest relative rounding error (-) of the orientation of three points.

The orientation is a difference of two products; the error is divided by the sum of their absolute values. The bound is
(3 + 16 eps) eps with eps = 2^-53 (Shewchuk 1997, Discrete Comput Geom 18:305).
"""
TURNS = 64
"""Number of attempts to swap diagonals, per crossed diagonal, after which a given edge counts as impossible."""
CROSSING = "edges of the ground and of the patch cross or coincide in plan, because the ground overhangs there"


def triangles_between(plan: FloatArray, edges: IntArray) -> IntArray:
    """Return a triangulation (T, 3) of points in plan that contains all given edges, to fill the ring around a patch.

    The triangles are counter-clockwise. They cover the regions that the edges enclose, and the rest of the convex hull
    of the points, except thin parts along the hull. The caller selects the triangles of the ring. Raises TerrainError
    if two points coincide in plan, two edges cross, or an edge runs through a point.

    plan : (N, 2) m, the points; edges : (E, 2) indices into `plan`
    """
    given = {(min(a, b), max(a, b)) for a, b in edges.tolist()}
    try:
        mesh = _Mesh(plan)
        for a, b in sorted(given):
            mesh.bring_in(a, b, given)
    except (KeyError, shapely.errors.GEOSException) as error:  # the Delaunay triangulation has a gap, or failed
        raise TerrainError(CROSSING) from error
    return mesh.triangles(len(plan))


class _Mesh:
    """A triangulation whose edges can be swapped.

    Each edge is stored twice, once in each direction, with the third corner of the triangle to its left.
    """

    def __init__(self, plan: FloatArray) -> None:
        low, high = plan.min(axis=0), plan.max(axis=0)
        far = AROUND * max(float((high - low).max()), 1.0)
        around = np.array([low - far, [high[0] + far, low[1] - far], high + far, [low[0] - far, high[1] + far]])
        points = np.concatenate([plan, around])
        self._at: list[Place] = list(zip(*points.T.tolist(), strict=True))
        number = {place: k for k, place in enumerate(self._at)}
        if len(number) < len(points):
            raise TerrainError(CROSSING)
        x, y = shapely.get_coordinates(shapely.delaunay_triangles(shapely.linestrings(points))).T.tolist()
        corners = np.array([number[place] for place in zip(x, y, strict=True)], dtype=np.int32).reshape(-1, 4)[:, :3]
        sides = _counter_clockwise(points, corners)[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]].reshape(-1, 3)
        begin, end, left = sides.T.tolist()
        self._left: dict[Edge, int] = dict(zip(zip(begin, end, strict=True), left, strict=True))
        self._beside: list[set[int]] = [set() for _ in points]
        for p, q in self._left:
            self._beside[p].add(q)
            self._beside[q].add(p)

    def _add(self, a: int, b: int, c: int) -> None:
        """Add a counter-clockwise triangle with corners a, b, c to the triangulation."""
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
            self._left[p, q] = r
            self._beside[p].add(q)
            self._beside[q].add(p)

    def _turn(self, a: int, b: int, c: int) -> float:
        return turn(self._at[a], self._at[b], self._at[c])

    def bring_in(self, u: int, v: int, given: set[Edge]) -> None:
        """Swap diagonals until an edge joins the points u and v.

        Raises TerrainError if that is impossible.

        given : edges that must not be swapped
        """
        crossing = deque(self._crossing(u, v))
        for _ in range(TURNS * (len(crossing) + 1)):
            if not crossing:
                return
            a, b = crossing.popleft()
            if (min(a, b), max(a, b)) in given:
                break
            c, d = self._left[a, b], self._left[b, a]
            if self._turn(c, d, b) <= 0 or self._turn(d, c, a) <= 0:
                crossing.append((a, b))
                continue
            self._swap(a, b, c, d)
            if not {c, d} & {u, v} and self._turn(u, v, c) * self._turn(u, v, d) < 0:
                crossing.append((c, d))
        raise TerrainError(CROSSING)

    def _swap(self, a: int, b: int, c: int, d: int) -> None:
        """Replace the edge a b between two triangles by the other diagonal c d of their quadrilateral."""
        del self._left[a, b], self._left[b, a]
        self._beside[a].discard(b)
        self._beside[b].discard(a)
        self._add(c, d, b)
        self._add(d, c, a)

    def _crossing(self, u: int, v: int) -> list[Edge]:
        """Return the edges that the line from u to v crosses, in order from u: the diagonals to swap.

        The list is empty if an edge already joins u and v. Raises TerrainError if the line runs through a point.
        """
        if v in self._beside[u]:
            return []
        p, q = self._first_crossed(u, v)
        found = [(p, q)]
        while True:
            t = self._left[q, p]
            if t == v:
                return found
            side = self._turn(u, v, t)
            if side == 0:
                raise TerrainError(CROSSING)
            p, q = (p, t) if side > 0 else (t, q)
            found.append((p, q))

    def _first_crossed(self, u: int, v: int) -> Edge:
        for p in sorted(self._beside[u]):
            q = self._left.get((u, p))
            if q is not None and self._turn(u, v, p) < 0 < self._turn(u, v, q):
                return p, q
        raise TerrainError(CROSSING)

    def triangles(self, count: int) -> IntArray:
        """Return the triangles (T, 3) that have all three corners among the first `count` points."""
        some = [(a, b, c) for (a, b), c in self._left.items() if a < b and a < c and max(b, c) < count]
        return np.array(some, dtype=np.int32).reshape(-1, 3)


def _counter_clockwise(points: FloatArray, triangles: IntArray) -> IntArray:
    """Return triangles (T, 3) with counter-clockwise corners: two corners of each clockwise triangle are exchanged.

    points : (N, 2) m, in plan
    """
    (ax, ay), (bx, by), (cx, cy) = (points[corner].T for corner in triangles.T)
    left, right = (ax - cx) * (by - cy), (ay - cy) * (bx - cx)
    backwards = left < right
    for t in np.flatnonzero(np.abs(left - right) <= SURE * (np.abs(left) + np.abs(right))).tolist():
        backwards[t] = turn(*points[triangles[t]].tolist()) < 0
    return np.where(backwards[:, None], triangles[:, [0, 2, 1]], triangles)


def turn(a: Place, b: Place, c: Place) -> float:
    """Return twice the area of a triangle in plan with an exact sign: positive if the corners run counter-clockwise.

    If rounding could change the sign, the result is only the sign: -1, 0 or 1.
    """
    left, right = (a[0] - c[0]) * (b[1] - c[1]), (a[1] - c[1]) * (b[0] - c[0])
    if abs(left - right) > SURE * (abs(left) + abs(right)):
        return left - right
    (ax, ay), (bx, by), (cx, cy) = ([Fraction(x) for x in place] for place in (a, b, c))
    exact = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return float((exact > 0) - (exact < 0))


def rim_edges(triangles: IntArray) -> NDArray[np.int64]:
    """Return the border (E, 2) of a mesh of triangles (F, 3): sides that no triangle has in the opposite direction."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    return np.asarray(sides[without_opposite(sides)])
