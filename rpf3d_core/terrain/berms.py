"""Add berms (windrows) to the mesh of a terrain: such a berm is a ridge along a line, and stops rolling rocks.

Facets are cut where a ridge begins and where its slope changes.

A berm raises the ground by its full height on the crest; from the crest to the foot, the height decreases linearly to
zero. The berm therefore follows the ground, and a terrain of one sheet stays one sheet. The raised facets replace the
ground, so no rock can move between berm and ground. Facets are cut in space by vertical planes, as in `clipping`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.welding import weld
from rpf3d_core.terrain.ridge import Ridge, height_at, left_of

Polygon = list[FloatArray]
"""A convex polygon in space, as its corners (3,) m in order."""

ON_LINE = 1e-9
"""Distance (m) from a line within which a corner counts as lying on the line."""
SLACK = 1e-6
"""Distance (m) within which two points are merged, or a point counts as on an edge or on the ridge."""


def raised(terrain: Terrain, ridge: Ridge, zone: str) -> Terrain:
    """Return the terrain with a berm (ridge) on it; the facets of the berm belong to the zone with the name `zone`.

    A zone with this name is added if the terrain has none. A cut facet is replaced by its parts: the first part keeps
    the facet's number, the other parts are appended after all facets. A terrain that the ridge does not touch is
    returned unchanged.
    """
    cut = _touched(terrain, ridge)
    if not len(cut):
        return terrain
    parts = [_parts(terrain.vertices[terrain.triangles[f]], ridge) for f in cut]
    beside = _beside(terrain, cut)
    polygons = [part for its in parts for part in its]
    polygons += [list(terrain.vertices[terrain.triangles[f]]) for f in beside]
    owners = np.concatenate([np.repeat(cut, [len(its) for its in parts]), beside])
    old = np.unique(terrain.triangles[np.concatenate([cut, beside])])
    corners = np.array([corner for polygon in polygons for corner in polygon])
    places, place = weld(np.asfortranarray(np.concatenate([terrain.vertices[old], corners])), SLACK)
    lengths = np.cumsum([len(polygon) for polygon in polygons])
    rings = [_without_repeats(ring) for ring in np.split(place[len(old) :].astype(np.int64), lengths[:-1])]
    facets, owner, places = _triangles(np.array(places), rings, owners)
    on_ridge = height_at(ridge, places[facets].mean(axis=1)[:, :2], 0.0) > 0.0
    places[:, 2] += height_at(ridge, places[:, :2], SLACK)
    vertices, number = _as_vertices(terrain, places, old, place[: len(old)].astype(np.int64))
    return _with_facets(replace(terrain, vertices=vertices), number[facets], owner, on_ridge, zone)


def _as_vertices(
    terrain: Terrain, places: FloatArray, old: NDArray[np.int64], place: NDArray[np.int64]
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return the vertices (V, 3) m of a terrain with a berm, and the vertex number (P,) of each point in `places`.

    places : (P, 3) m, all points of the cut facets and of their neighbours, at the heights with the berm
    old : (N,) numbers of the original vertices in `places`; place : (N,) index into `places` of each vertex in `old`
    """
    number = np.full(len(places), -1, dtype=np.int64)
    number[place[::-1]] = old[::-1]
    new = np.flatnonzero(number < 0)
    number[new] = len(terrain.vertices) + np.arange(len(new))
    vertices = np.concatenate([terrain.vertices, places[new]])
    known = np.setdiff1d(np.arange(len(places)), new)
    vertices[number[known]] = places[known]
    return vertices, number


def _touched(terrain: Terrain, ridge: Ridge) -> NDArray[np.int64]:
    """Return the facets (N,) that may overlap the ridge in plan and therefore must be cut.

    A facet cannot overlap a polygon of the ridge if a side of the polygon, or of the polygon's box, separates the facet
    from the polygon.
    """
    plan = terrain.vertices[:, :2]
    touched = np.zeros(len(terrain.triangles), dtype=bool)
    for corners in ridge.corners:
        low, high = corners.min(axis=0), corners.max(axis=0)
        code = (plan[:, 0] <= low[0]) + 2 * (plan[:, 0] >= high[0]) + 4 * (plan[:, 1] <= low[1])
        code = (code + 8 * (plan[:, 1] >= high[1])).astype(np.uint8)
        for k in range(len(corners)):
            beyond = left_of(plan, corners[k], corners[(k + 1) % len(corners)] - corners[k]) <= 0.0
            code |= beyond.astype(np.uint8) << np.uint8(4 + k)
        touched |= np.bitwise_and.reduce(code[terrain.triangles], axis=1) == 0
    return np.flatnonzero(touched)


def _parts(corners: FloatArray, ridge: Ridge) -> list[Polygon]:
    """Return the convex parts of a facet (3, 3) m, cut along the outlines of the ridge's polygons.

    The parts on the ridge are first, then the parts outside the ridge.
    """
    inside: list[Polygon] = []
    outside: list[Polygon] = [list(corners)]
    low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
    for piece in ridge.corners:
        if (piece.min(axis=0) >= high).any() or (piece.max(axis=0) <= low).any():
            continue
        rest = []
        for polygon in outside:
            within, beyond = _cut_out(polygon, piece)
            rest += beyond if within else [polygon]
            inside += [within] if within else []
        outside = rest
    return inside + outside


def _cut_out(polygon: Polygon, piece: FloatArray) -> tuple[Polygon, list[Polygon]]:
    """Return the part of a polygon that lies, in plan, inside one convex polygon of a ridge, and the parts outside.

    If no part lies inside, both results are empty.

    piece : (N, 2) m, corners of the polygon of the ridge, counter-clockwise
    """
    within, beyond = polygon, []
    for k in range(len(piece)):
        within, right = _halves(within, piece[k], piece[(k + 1) % len(piece)])
        if not within:
            return [], []
        beyond += [right] if right else []
    return within, beyond


def _halves(polygon: Polygon, begin: FloatArray, end: FloatArray) -> tuple[Polygon, Polygon]:
    """Cut a convex polygon along a line in plan; return the part to the left of the line, and the part to the right.

    begin, end : (2,) m, two points of the line, which give its direction

    If the line does not cut the polygon, one part is the whole polygon and the other part is empty. The point where the
    line cuts an edge does not depend on the direction of the edge, so both facets at the edge get the same point.
    """
    points = np.array(polygon)
    off = left_of(points[:, :2], begin, end - begin)
    off[np.abs(off) <= ON_LINE] = 0.0
    if (off <= 0.0).all():
        return [], polygon
    if (off >= 0.0).all():
        return polygon, []
    left, right = [], []
    for i in range(len(points)):
        j = (i + 1) % len(points)
        left += [points[i]] if off[i] >= 0.0 else []
        right += [points[i]] if off[i] <= 0.0 else []
        if off[i] * off[j] < 0.0:
            a, b = (i, j) if tuple(points[i]) < tuple(points[j]) else (j, i)
            met = points[a] + off[a] / (off[a] - off[b]) * (points[b] - points[a])
            left.append(met)
            right.append(met)
    return left, right


def _beside(terrain: Terrain, cut: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the uncut facets (N,) that may share an edge with a cut facet: new points may lie on such an edge.

    A facet may share an edge if at least two of its vertices are vertices of cut facets.

    cut : (C,) the cut facets
    """
    known = np.zeros(len(terrain.vertices), dtype=bool)
    known[terrain.triangles[cut].ravel()] = True
    near = known[terrain.triangles].sum(axis=1) >= 2
    near[cut] = False
    return np.flatnonzero(near)


def _without_repeats(ring: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return a closed ring of point numbers (R,) without numbers that repeat the previous number in the ring."""
    return np.asarray(ring[ring != np.roll(ring, 1)])


def _triangles(
    places: FloatArray, rings: Sequence[NDArray[np.int64]], owners: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Return facets (F, 3) that fill rings of points, the original facet (F,) of each, and all points (Q, 3) m.

    All points are `places`, followed by the centres of rings with more than three corners. Points that lie on an edge
    of a ring become corners of the ring, so that neighbours share whole edges. A ring with fewer than three corners has
    no facet.

    places : (P, 3) m, points; rings : closed rings (R,) of indices into `places`
    owners : for each ring, the facet of the original terrain that contains the ring
    """
    order = np.argsort(places[:, 0], kind="stable")
    x = places[order, 0]
    facets, owner = [], []
    middles: list[FloatArray] = []
    for ring, its in zip(rings, owners, strict=True):
        if len(ring) < 3:
            continue
        whole = _with_places_between(places, order, x, ring)
        if len(whole) == 3:
            facets.append(whole)
            owner.append(its)
            continue
        centre = len(places) + len(middles)
        middles.append(places[ring].mean(axis=0))
        for a, b in zip(whole, np.roll(whole, -1), strict=True):
            facets.append(np.array([a, b, centre]))
            owner.append(its)
    return np.array(facets), np.array(owner), np.concatenate([places, np.array(middles).reshape(-1, 3)])


def _with_places_between(
    places: FloatArray, order: NDArray[np.int64], x: FloatArray, ring: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return a ring extended by all points that lie on its edges, in their order along the ring: no T-junctions remain.

    order : (P,) points sorted by x; x : (P,) m, their sorted coordinates
    places : (P, 3) m, all points; ring : (R,) numbers of the points of the ring
    """
    whole = []
    for a, b in zip(ring, np.roll(ring, -1), strict=True):
        begin, way = places[a], places[b] - places[a]
        low, high = min(begin[0], places[b, 0]) - SLACK, max(begin[0], places[b, 0]) + SLACK
        first, last = np.searchsorted(x, [low, high])
        near = order[first:last]
        offset = places[near] - begin
        length2 = float(way @ way)
        share = offset @ way / length2
        aside = offset - share[:, None] * way
        on = (np.einsum("ij,ij->i", aside, aside) <= SLACK * SLACK) & (share > 0.0) & (share < 1.0)
        on &= (near != a) & (near != b)
        between = near[on][np.argsort(share[on])]
        whole += [a, *between.tolist()]
    return np.array(whole, dtype=np.int64)


def _with_facets(
    terrain: Terrain, facets: NDArray[np.int64], owner: NDArray[np.int64], on_ridge: NDArray[np.bool_], zone: str
) -> Terrain:
    """Return the terrain after each cut facet is replaced by its parts; parts on the ridge belong to `zone`.

    facets : (N, 3) vertices of the parts; owner : (N,) original facet of each part; on_ridge : (N,) true for parts on
        the ridge
    """
    zones = terrain.zones if zone in terrain.zones else (*terrain.zones, zone)
    number = np.where(on_ridge, zones.index(zone), terrain.zone[owner]).astype(np.int32)
    corners: IntArray = facets.astype(np.int32)
    first = np.unique(owner, return_index=True)[1]
    triangles, zone_of = terrain.triangles.copy(), terrain.zone.astype(np.int32)
    triangles[owner[first]], zone_of[owner[first]] = corners[first], number[first]
    more = np.setdiff1d(np.arange(len(facets)), first)
    triangles, zone_of = np.concatenate([triangles, corners[more]]), np.concatenate([zone_of, number[more]])
    return replace(terrain, triangles=triangles, zone=zone_of, zones=zones)
