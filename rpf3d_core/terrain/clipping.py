"""Cut facets exactly along an outline in plan, for areas of interest: vertical planes clip each facet in space.

Clipping in space, not in plan, works for vertical and overhanging faces alike. Facets are clipped against one convex
prism at a time (Sutherland and Hodgman 1974, Communications of the ACM 17(1):32-42, doi 10.1145/360767.360802).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import area_vectors
from rpf3d_core.terrain.frame import FloatArray

MOST_CORNERS = 9
"""Largest number of corners of a triangle clipped by three planes: 6, or 9 if rounding bends its straight edges."""
FACETS_A_TILE = 32
"""Mean number of facets in a tile, a cell of a coarse grid in plan that limits the search for overlaps.

Each prism is tested against every tile, and then against the facets of the tiles that the prism may overlap.
"""


class _Tiles(NamedTuple):
    """Facets grouped into tiles (cells of a coarse grid in plan), to find quickly the facets near a prism.

    order : (F,) facets, sorted by tile; start : (N,) index in `order` of the first facet of each of the N tiles
    facets : (N,) number of facets of each tile; low, high : (N, 2) m, the box in plan around the facets of each tile
    """

    order: NDArray[np.int64]
    start: NDArray[np.int64]
    facets: NDArray[np.int64]
    low: FloatArray
    high: FloatArray


def facets_within(corners: FloatArray, prisms: FloatArray) -> FloatArray:
    """Return the parts (P, 3, 3) m of facets that lie inside an area in plan, such as an area of interest.

    corners : (F, 3, 3) m, F >= 1, of the facets
    prisms : (T, 3, 2) m, triangles in plan that together are the area, without overlap, with either winding; each
        triangle is the cross-section of a vertical prism
    """
    found = [np.empty((0, 3, 3))]
    tiles = _tiles_of(corners)
    prisms = _counter_clockwise(prisms)
    for prism, neighbours in zip(prisms, _left_to_neighbours(prisms), strict=True):
        facets = corners[_near(tiles, prism)]
        off = np.stack([_off(facets, prism[k], prism[(k + 1) % 3]) for k in range(3)], axis=1)
        inside = np.asarray((off >= 0.0).all(axis=(1, 2)))
        outside = ((off <= 0.0).all(axis=2) & ((off < 0.0).any(axis=2) | neighbours)).any(axis=1)
        inside &= ~outside
        found += [facets[inside], _clipped(facets[~inside & ~outside], prism)]
    parts = np.concatenate(found)
    return parts[areas_of(parts) > 0.0]


def areas_of(triangles: FloatArray) -> FloatArray:
    """Return the areas (P,) m^2 of triangles (P, 3, 3) m in space, not in plan."""
    x, y, z = normals_of(triangles).T
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def normals_of(triangles: FloatArray) -> FloatArray:
    """Return the normals (P, 3) m^2 of triangles (P, 3, 3) m in space; the length of each is the triangle's area."""
    return area_vectors(triangles.reshape(-1, 3), np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3))


def _tiles_of(corners: FloatArray) -> _Tiles:
    """Return facets with the given corners (F, 3, 3) m, grouped into tiles: cells of a coarse grid in plan."""
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
    side = max(int((len(corners) / FACETS_A_TILE) ** 0.5), 1)
    origin = low.min(axis=0)
    extent = np.maximum(high.max(axis=0) - origin, np.finfo(float).tiny)
    cell = np.minimum(((low - origin) / extent * side).astype(np.int64), side - 1)
    tile = cell[:, 0] * side + cell[:, 1]
    order = np.argsort(tile, kind="stable")
    _, start, count = np.unique(tile[order], return_index=True, return_counts=True)
    low, high = np.minimum.reduceat(low[order], start), np.maximum.reduceat(high[order], start)
    return _Tiles(order=order, start=start, facets=count, low=low, high=high)


def _left_to_neighbours(prisms: FloatArray) -> NDArray[np.bool_]:
    """Return flags (T, 3) for the edges of prisms: true if the neighbouring prism includes vertical facets on the edge.

    A vertical facet exactly on the edge between two prisms is therefore included once. Edge k leads from corner k to
    the next corner.

    prisms : (T, 3, 2) m, counter-clockwise triangles in plan
    """
    edges = [[(*prism[k].tolist(), *prism[(k + 1) % 3].tolist()) for k in range(3)] for prism in prisms]
    known = {edge for row in edges for edge in row}
    left = [[(*edge[2:], *edge[:2]) in known and edge[:2] > edge[2:] for edge in row] for row in edges]
    return np.array(left, dtype=bool).reshape(-1, 3)


def _near(tiles: _Tiles, prism: FloatArray) -> NDArray[np.int64]:
    """Return the facets (N,) of all tiles that may overlap a prism (3, 2) m, to test only these facets.

    A tile cannot overlap the prism if it lies outside the prism's box, or entirely outside one edge of the prism.
    """
    meets = ((tiles.high >= prism.min(axis=0)) & (tiles.low <= prism.max(axis=0))).all(axis=1)
    for k in range(3):
        begin, along = prism[k], prism[(k + 1) % 3] - prism[k]
        x = np.where(along[1] > 0.0, tiles.low[:, 0], tiles.high[:, 0])  # the corner furthest to the left of the edge
        y = np.where(along[0] > 0.0, tiles.high[:, 1], tiles.low[:, 1])
        meets &= along[0] * (y - begin[1]) - along[1] * (x - begin[0]) >= 0.0
    start, count = tiles.start[meets], tiles.facets[meets]
    place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(tiles.order[np.repeat(start, count) + place])


def _off(points: FloatArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Return the distance of points (..., 3) m from a line in plan, times the line's length: (...) m^2.

    The distance is positive to the left of the line, and negative to the right.

    begin, end : (2,) m, ends of the line
    """
    along = end - begin
    return np.asarray(along[0] * (points[..., 1] - begin[1]) - along[1] * (points[..., 0] - begin[0]))


def _counter_clockwise(prisms: FloatArray) -> FloatArray:
    """Return the triangles `prisms` (T, 3, 2) with corners counter-clockwise: their interior is left of each edge."""
    u, w = prisms[:, 1] - prisms[:, 0], prisms[:, 2] - prisms[:, 0]
    return np.where((u[:, 0] * w[:, 1] < u[:, 1] * w[:, 0])[:, None, None], prisms[:, ::-1], prisms)


def _clipped(triangles: FloatArray, prism: FloatArray) -> FloatArray:
    """Return the parts (P, 3, 3) m of triangles (N, 3, 3) m that lie inside a vertical prism.

    prism : (3, 2) m, the prism's cross-section in plan, a counter-clockwise triangle
    """
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
    """Return convex polygons (N, 9, 3) without their parts to the right of a line in plan, and the corner counts (N,).

    points : (N, 9, 3) m, corners of the polygons; count : (N,) number of corners of each polygon
    begin, end : (2,) m, two points of the line, which give its direction

    Rows of a polygon beyond its corner count are not used, also in the result.
    """
    off = _off(points, begin, end)
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
