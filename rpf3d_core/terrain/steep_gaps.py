"""Close holes in steep slopes with triangles in the plane of the hole.

In plan such holes have hardly any area, or the ground at their rim overhangs and hides a part of them.
"""

from collections import defaultdict

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.border import Corners
from rpf3d_core.terrain.mesh.components import components
from rpf3d_core.terrain.plane.hull import convex_hull
from rpf3d_core.terrain.plane.triangulation import fills, triangles_of
from rpf3d_core.terrain.winding import crossings

STEEP = 0.2
"""Vertical component of the unit normal (-) of a hole, without its sign, below which the hole is closed in its plane.

The plane of such a hole is within 12 degrees of upright.
"""
RATHER_STEEP = 0.7
"""The same for a hole that faces up and at whose rim a facet is upright or overhangs.

The plane of such a hole is steeper than 46 degrees.
"""
BESIDE = 0.1
"""Distance from a rim, along the normal of the hole, up to which ground counts as in the hole, in sizes of the hole."""


def without_steep_rings(border: FloatArray, crack: float) -> tuple[FloatArray, FloatArray, Corners]:
    """Return the border of a terrain without its holes in steep slopes, and the triangles that close these holes.

    Results: the remaining border sides (N, 3, 3) m, the triangles (T, 3, 3) m, and for each triangle the number (T,) of
    the hole that it closes.

    A ring of border sides is a hole if it runs clockwise, seen from the free side of the facets around the ring. A hole
    is closed in its own plane if it is steep (`STEEP`, `RATHER_STEEP`), or if it faces up and its rim crosses itself in
    plan: a hole over the toe of a face, for example, whose facets lean over at the rim. A ring around a component runs
    counter-clockwise, and its sides remain. Holes that touch at a vertex count as one ring with one plane, but each of
    them is closed for itself. If one of them crosses itself in this plane, the sides of all of them remain; the same
    if a component lies in, below or above a hole that is not steep (`STEEP`).

    border : (B, 3, 3) m, begin and end of each side and third corner of its facet, from `border.border_of`
    crack : width (m) up to which a hole is a crack; the sides of a crack are removed, but the crack gets no triangles
    """
    label = _ring_of(border)
    areas, looks, overhangs = _sums(border, label)
    holes, size = np.einsum("ij,ij->i", areas, looks) < 0.0, np.linalg.norm(areas, axis=1)
    steep = np.abs(areas[:, 2]) < STEEP * size
    up = ~steep & (areas[:, 2] < 0.0)
    rather = up & overhangs & (-areas[:, 2] < RATHER_STEEP * size)
    rather |= _crossing(border, label, holes & up & ~rather)
    sides_of = np.split(np.argsort(label, kind="stable"), np.cumsum(np.bincount(label))[:-1])
    caps, capped = [np.empty((0, 3, 3))], np.zeros(len(border), dtype=bool)
    others = border[~holes[label], 0]
    for hole in np.flatnonzero(holes & (steep | rather)).tolist():
        inside = others if rather[hole] else others[:0]
        closed = _closed(border[sides_of[hole], :2], -areas[hole], crack, inside)
        if closed is None or (rather[hole] and _has_ground_below(np.concatenate(closed), border[label != hole, :2])):
            continue
        caps.extend(closed)
        capped[sides_of[hole]] = True
    number = np.repeat(np.arange(len(caps)), [len(cap) for cap in caps])
    return border[~capped], np.concatenate(caps), number


def _ring_of(border: FloatArray) -> Corners:
    """Return the number (B,) of the closed ring that each border side belongs to; rings that touch count as one ring.

    border : (B, 3, 3) m, as in `without_steep_rings`
    """
    ends = border[:, :2].reshape(-1, 3) + 0.0
    points, number = np.unique(ends, axis=0, return_inverse=True)
    first, second = number.reshape(-1, 2).astype(np.int32).T
    ring = components(len(points), first, second)[first]
    return np.asarray(np.unique(ring, return_inverse=True)[1])


def _sums(border: FloatArray, label: Corners) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return the area vector (R, 3) m^2 of each ring, and the direction (R, 3) m in which the facets at the ring face.

    Return also flags (R,), True if some of these facets are upright or overhang. Area and direction together show
    whether the ring is a hole. The direction is the sum, over the border sides of the ring, of the facet's unit normal
    times the length of the side.

    border : (B, 3, 3) m, as in `without_steep_rings`; label : (B,) ring number of each border side
    """
    count = int(label.max()) + 1
    a, b, third = border.transpose(1, 0, 2)
    a, way = a - border[0, 0], b - a
    normal = np.cross(way, third - border[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    looks = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
    looks *= np.linalg.norm(way, axis=1, keepdims=True)
    parts = 0.5 * np.cross(a, a + way), looks
    areas, sums = (np.stack([np.bincount(label, part[:, k], count) for k in range(3)], axis=1) for part in parts)
    overhangs = np.bincount(label, (looks[:, 2] <= 0.0) & (length[:, 0] > 0.0), count) > 0.0
    return areas.astype(np.float64), sums.astype(np.float64), overhangs


def _closed(sides: FloatArray, towards: FloatArray, crack: float, others: FloatArray) -> list[FloatArray] | None:
    """Return the triangles (T, 3, 3) m that close each hole in a steep slope, inside border sides (N, 2, 3) m.

    Return None if a hole crosses itself in the plane perpendicular to `towards`, or if there is a component in it. A
    hole that is only a crack gets no triangles.

    towards : (3,), direction that the triangles face; crack : m, width up to which a hole is a crack
    others : (P, 3) m, corners of the rings around components that must not lie in a hole
    """
    n = towards / np.linalg.norm(towards)
    u = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    plane = np.stack([u, np.cross(n, u)], axis=1) / np.linalg.norm(u)
    depth, depths = sides @ n, others @ n
    slack = BESIDE * np.ptp(sides, axis=(0, 1)).max()
    near = others[(depths >= depth.min() - slack) & (depths <= depth.max() + slack)]
    closed = []
    for ring in _rings(sides, plane):
        triangles = _triangles(ring, plane, crack, near)
        if triangles is None:
            return None
        closed.append(triangles)
    return closed


def _has_ground_below(triangles: FloatArray, sides: FloatArray) -> bool:
    """Return True if separate ground lies below, or above, the middle of one of the triangles (T, 3, 3) m of a hole.

    Without the rim of the hole, the border runs around the middle once in plan, or more often if there is such ground.

    sides : (B, 2, 3) m, border sides without those of the hole
    """
    if not len(triangles):  # the hole consists of cracks
        return False
    places, ends = triangles[:, :, :2].mean(axis=1), sides[:, :, :2]
    (west, south), north = places.min(axis=0), places[:, 1].max()
    is_near = (ends[:, :, 1].min(axis=1) <= north) & (ends[:, :, 1].max(axis=1) >= south)
    near = ends[is_near & (ends[:, :, 0].max(axis=1) >= west)]
    return any(crossings(near, place).sum() > 1 for place in places)


def _crossing(border: FloatArray, label: Corners, asked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return flags (R,), True for rings that cross themselves in plan; always False for rings that are not asked for.

    border : (B, 3, 3) m, as in `without_steep_rings`; label : (B,) ring number of each border side; asked : (R,) flags
    """
    found = asked.copy()
    some = np.flatnonzero(asked[label])
    some = some[np.argsort(label[some], kind="stable")]
    _, ring = np.unique(label[some], return_inverse=True)
    lines = shapely.multilinestrings(shapely.linestrings(border[some, :2, :2]), indices=ring)
    found[asked] = ~shapely.is_simple(lines)
    return found


def _triangles(ring: FloatArray, plane: FloatArray, crack: float, others: FloatArray) -> FloatArray | None:
    """Return the triangles (T, 3, 3) m inside a ring of corners (N, 3) m; none (T = 0) if the hole is only a crack.

    Return None if the ring crosses itself in the plane, if a corner of a component lies in it, or if triangles between
    its corners do not fill it. The ring may touch itself at vertices, around ground inside the hole.

    plane : (3, 2), unit vectors of the plane, the second one counter-clockwise from the first one, seen from the free
        side; crack : m; others : (P, 3) m, corners of components near the hole
    """
    flat = np.einsum("nc,cd->nd", ring - ring[0], plane)  # unlike @, equal corners always have equal results
    loops = [flat[loop] for loop in _simple_loops(ring)]
    wide = [loop for loop in loops if not _is_crack(convex_hull(loop), crack)]
    around = [loop for loop in wide if not shapely.is_ccw(shapely.LinearRing(loop))]
    islands = [loop for loop in wide if shapely.is_ccw(shapely.LinearRing(loop))]
    if not wide:
        return np.empty((0, 3, 3))
    face = shapely.Polygon(around[0], islands) if len(around) == 1 else None
    if face is None or not face.is_valid or shapely.contains_xy(face, (others - ring[0]) @ plane).any():
        return None
    if _is_crack(face, crack):
        return np.empty((0, 3, 3))
    parts = shapely.orient_polygons(shapely.get_parts(triangles_of(face)))
    number = {corner: k for k, corner in enumerate(map(tuple, flat.tolist()))}
    corners = list(map(tuple, shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3].reshape(-1, 2).tolist()))
    if not fills(parts, face) or not number.keys() >= set(corners):
        return None
    return np.asarray(ring[[number[corner] for corner in corners]].reshape(-1, 3, 3))


def _is_crack(face: shapely.Geometry, crack: float) -> bool:
    """Return True if a face is at most as wide as a crack (m)."""
    return bool(2.0 * face.area <= crack * face.length)


def _simple_loops(ring: FloatArray) -> list[list[int]]:
    """Return the numbers of the corners of each loop of a ring (N, 3) m; a ring that touches itself has several."""
    loops, path, place = [], list[int](), dict[tuple[float, ...], int]()
    corners = [tuple(corner) for corner in (ring + 0.0).tolist()]
    for k, corner in enumerate(corners):
        if corner in place:
            first = place[corner]
            loops.append(path[first:])
            for each in path[first:]:
                del place[corners[each]]
            del path[first:]
        place[corner] = len(path)
        path.append(k)
    return [*loops, path]


def _rings(sides: FloatArray, plane: FloatArray) -> list[FloatArray]:
    """Return the corners (N, 3) m of each hole inside border sides (S, 2, 3) m, in order.

    At a vertex that several holes have in common, a ring goes on with the side that bounds the same hole. The hole is
    to the right of its sides, so this is the first side counter-clockwise from the side on which the ring has come.

    plane : (3, 2), as in `_triangles`
    """
    way = (sides[:, 1] - sides[:, 0]) @ plane
    heading = np.arctan2(way[:, 1], way[:, 0])
    begins, ends = ([tuple(corner) for corner in corners.tolist()] for corners in (sides + 0.0).transpose(1, 0, 2))
    onward: dict[tuple[float, ...], list[int]] = defaultdict(list)
    for k, begin in enumerate(begins):
        onward[begin].append(k)
    rings, left = [], set(range(len(sides)))
    for first in range(len(sides)):
        ring, k = [], first
        while k in left:
            left.remove(k)
            ring.append(k)
            back = heading[k] + np.pi
            free = [each for each in onward[ends[k]] if each in left or each == first]
            k = max(free, key=lambda each: ((back - heading[each]) % (2.0 * np.pi), -each))
        if ring:
            rings.append(sides[ring, 0])
    return rings
