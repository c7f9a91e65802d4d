"""Close holes in steep slopes with triangles in the plane of the hole: in plan such holes have hardly any area."""

import numpy as np
import shapely

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.border import Corners
from rpf3d_core.terrain.mesh.components import components

STEEP = 0.2
"""Vertical component of a ring's unit normal (-) below which the hole inside the ring is closed in its own plane.

The plane of such a ring is steeper than 78 degrees.
"""


def without_steep_rings(border: FloatArray, crack: float) -> tuple[FloatArray, FloatArray, Corners]:
    """Return the border of a terrain without its holes in steep slopes, and the triangles that close these holes.

    Results: the remaining border sides (N, 3, 3) m, the triangles (T, 3, 3) m, and for each triangle the number (T,) of
    the hole that it closes.

    A steep ring of border sides (`STEEP`) is a hole if it runs clockwise, seen from the free side of the facets around
    the ring. A ring around a component runs counter-clockwise, and its sides remain. The sides of a ring that touches
    another ring, or that crosses itself in its own plane, remain as well.

    border : (B, 3, 3) m, begin and end of each side and third corner of its facet, from `border.border_of`
    crack : width (m) up to which a hole is a crack; the sides of a crack are removed, but the crack gets no triangles
    """
    label = _ring_of(border)
    areas, looks = _sums(border, label)
    steep = np.abs(areas[:, 2]) < STEEP * np.linalg.norm(areas, axis=1)
    holes = np.flatnonzero(steep & (np.einsum("ij,ij->i", areas, looks) < 0.0))
    caps, capped = [np.empty((0, 3, 3))], np.zeros(len(border), dtype=bool)
    for hole in holes.tolist():
        sides = label == hole
        cap = _closed(border[sides, :2], -areas[hole], crack)
        if cap is not None:
            caps.append(cap)
            capped |= sides
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


def _sums(border: FloatArray, label: Corners) -> tuple[FloatArray, FloatArray]:
    """Return the area vector (R, 3) m^2 of each ring, and the direction (R, 3) m in which the facets at the ring face.

    Both together show whether the ring is a hole. The direction is the sum, over the border sides of the ring, of the
    facet's unit normal times the length of the side.

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
    return areas.astype(np.float64), sums.astype(np.float64)


def _closed(sides: FloatArray, towards: FloatArray, crack: float) -> FloatArray | None:
    """Return triangles (T, 3, 3) m that close a hole in a steep slope, inside one ring of sides (N, 2, 3) m.

    Return None if the sides are not one ring, or if the ring crosses itself in the plane perpendicular to `towards`.
    Return no triangles if the hole is only a crack.

    towards : (3,), direction that the triangles face; crack : m, width up to which a hole is a crack
    """
    ring = _in_order(sides)
    if ring is None:
        return None
    n = towards / np.linalg.norm(towards)
    u = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    u /= np.linalg.norm(u)
    flat = (ring - ring[0]) @ np.stack([u, np.cross(n, u)], axis=1)
    face = shapely.Polygon(flat)
    if not face.is_valid:
        return None
    if 2.0 * face.area <= crack * face.length:
        return np.empty((0, 3, 3))
    parts = shapely.orient_polygons(shapely.get_parts(shapely.constrained_delaunay_triangles(face)))
    number = {corner: k for k, corner in enumerate(map(tuple, flat.tolist()))}
    corners = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    return np.asarray(ring[[number[corner] for corner in map(tuple, corners.tolist())]].reshape(-1, 3, 3))


def _in_order(sides: FloatArray) -> FloatArray | None:
    """Return the corners (N, 3) m of a ring of sides (N, 2, 3) m, in order; None if the sides are not one ring."""
    following = {tuple(begin): tuple(end) for begin, end in (sides + 0.0).tolist()}
    ring = [next(iter(following))]
    while len(ring) <= len(sides) and following.get(ring[-1]) not in (ring[0], None):
        ring.append(following[ring[-1]])
    return np.array(ring) if len(ring) == len(sides) == len(following) else None
