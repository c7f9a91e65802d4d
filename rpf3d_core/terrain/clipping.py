"""Facets cut off exactly at an outline in plan: each is clipped in space by vertical planes.

Clipping in space, not in plan, serves vertical and overhanging faces alike (Sutherland and Hodgman 1974, Communications
of the ACM 17(1):32-42, doi 10.1145/360767.360802, against one convex prism at a time).
"""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray

MOST_CORNERS = 9
"""Room for the corners of a triangle clipped by three planes: 6, and 9 if rounding should bend its straight edges."""


def facets_within(corners: FloatArray, prisms: FloatArray) -> FloatArray:
    """The parts (P, 3, 3) m of facets that lie, in plan, in triangles that do not overlap one another.

    corners : (F, 3, 3) m; prisms : (T, 3, 2) m in plan, wound either way
    """
    found = [np.empty((0, 3, 3))]
    order = np.argsort(corners[:, :, 0].min(axis=1), kind="stable")
    low, high = corners[order, :, :2].min(axis=1), corners[order, :, :2].max(axis=1)
    widest = float((high[:, 0] - low[:, 0]).max(initial=0.0))
    for prism in _counter_clockwise(prisms):
        (west, south), (east, north) = prism.min(axis=0), prism.max(axis=0)
        near = slice(*np.searchsorted(low[:, 0], [west - widest, np.nextafter(east, np.inf)]))
        meets = (high[near, 0] >= west) & (high[near, 1] >= south) & (low[near, 1] <= north)
        found.append(_clipped(corners[order[near][meets]], prism))
    parts = np.concatenate(found)
    return parts[areas_of(parts) > 0.0]


def areas_of(triangles: FloatArray) -> FloatArray:
    """True areas (P,) m^2 of triangles (P, 3, 3) m in space."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(0.5 * np.sqrt((cross * cross).sum(axis=1)))


def _counter_clockwise(prisms: FloatArray) -> FloatArray:
    """Triangles (T, 3, 2) in plan with the interior on the left of their edges."""
    u, w = prisms[:, 1] - prisms[:, 0], prisms[:, 2] - prisms[:, 0]
    return np.where((u[:, 0] * w[:, 1] < u[:, 1] * w[:, 0])[:, None, None], prisms[:, ::-1], prisms)


def _clipped(triangles: FloatArray, prism: FloatArray) -> FloatArray:
    """The parts (P, 3, 3) of triangles (N, 3, 3) inside a prism (3, 2), as triangles."""
    points = np.zeros((len(triangles), MOST_CORNERS, 3))
    points[:, :3] = triangles
    count = np.full(len(triangles), 3)
    for k in range(3):
        points, count = _cut(points, count, prism[k], prism[(k + 1) % 3])
    fans = [points[count > k + 1][:, [0, k, k + 1]] for k in range(1, MOST_CORNERS - 1)]
    return np.concatenate(fans)


def _cut(
    points: FloatArray, count: NDArray[np.int64], begin: FloatArray, end: FloatArray
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Convex polygons (N, 9, 3) of `count` (N,) corners, less what lies to the right of a line in plan."""
    along = end - begin
    off = along[0] * (points[..., 1] - begin[1]) - along[1] * (points[..., 0] - begin[0])
    kept, corners, every = np.zeros_like(points), np.zeros_like(count), np.arange(len(points))
    for i in range(MOST_CORNERS):
        there = np.where(i + 1 < count, min(i + 1, MOST_CORNERS - 1), 0)
        d, d_next = off[:, i], off[every, there]
        stays = (i < count) & (d >= 0.0)
        kept[every[stays], corners[stays]] = points[stays, i]
        corners += stays
        crosses = (i < count) & ((d >= 0.0) != (d_next >= 0.0))
        share = (d[crosses] / (d[crosses] - d_next[crosses]))[:, None]
        met = points[crosses, i] + share * (points[every[crosses], there[crosses]] - points[crosses, i])
        kept[every[crosses], corners[crosses]] = met
        corners += crosses
    return kept, corners
