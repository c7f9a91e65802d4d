"""Drape outlines in plan over the terrain, for views that draw them as lines."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.height_image import HeightImage, height_image, heights_at

INSIDE = 0.5
"""Distance (m) by which a line is drawn inside its outline.

Many outlines follow the toe of a face. On the outline itself, small errors of the survey would lift the line up the
face.
"""
STEP = 1.0
"""Largest distance (m) between the points of a line, unless the outline is very long."""
MOST_POINTS = 20_000
"""Largest number of points on a ring, apart from its corners."""
MARGIN = 2.0
"""Distance (m) by which the image of the ground extends beyond the outlines."""


def draped_outlines(terrain: Terrain, rings: Sequence[FloatArray], raised: float = 0.0) -> list[FloatArray]:
    """Return the outline of an area as lines (N, 3) m that follow the ground, moved by INSIDE (m) into the area.

    Where the area is too narrow, the lines lie on the outline itself. Parts off the terrain and over holes are left
    out.

    rings : closed rings (N, 2) m of the area's polygons and their holes, local frame
    raised : height of the lines above the ground (m)
    """
    if not rings:
        return []
    image = height_image(terrain, np.concatenate(rings), MARGIN)
    lines = [line for ring in rings for line in _on_ground(image, _moved_inside(rings, _with_normals(ring)))]
    return [line + np.array([0.0, 0.0, raised]) for line in lines]


def draped_lines(terrain: Terrain, lines: Sequence[FloatArray]) -> list[FloatArray]:
    """Return open lines (P, 2) m in plan as lines (N, 3) m on the ground, with points at most STEP (m) apart.

    Parts off the terrain and over holes are left out.
    """
    if not lines:
        return []
    image = height_image(terrain, np.concatenate(lines), MARGIN)
    fine = [shapely.get_coordinates(shapely.segmentize(shapely.LineString(line), STEP)) for line in lines]
    return [part for line in fine for part in _on_ground(image, line)]


def _with_normals(ring: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points (M, 2) m along a ring (N, 2) m, and the unit normal (M, 2) to the left of the ring at each point.

    Points are at most STEP (m) apart; on very long rings they are farther apart. At a corner, the normal has the mean
    direction of the normals of its two edges.
    """
    corners = ring[np.append(True, (np.diff(ring, axis=0) != 0.0).any(axis=1))]
    edges = np.diff(corners, axis=0)
    length = np.linalg.norm(edges, axis=1)
    step = max(STEP, float(length.sum()) / MOST_POINTS)
    across = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / length[:, None]
    points, normals = [], []
    for number, (a, b) in enumerate(pairwise(corners)):
        shares = np.linspace(0.0, 1.0, max(int(np.ceil(length[number] / step)), 1), endpoint=False)
        points.append(a + shares[:, None] * (b - a))
        normals.append(np.repeat(across[None, number], len(shares), axis=0))
        normals[-1][0] += across[number - 1]
    found = np.concatenate(normals)
    found /= np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-9)
    return np.concatenate([*points, points[0][:1]]), np.concatenate([found, found[:1]])


def _moved_inside(rings: Sequence[FloatArray], ring: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Return the points (M, 2) m of a ring, moved by INSIDE into the area; points stay where the area is too narrow.

    rings : all rings (N, 2) m of the area; ring : points and normals (M, 2) from `_with_normals`
    """
    points, normals = ring
    left, right = points + INSIDE * normals, points - INSIDE * normals
    in_left, in_right = _is_inside(rings, left)[:, None], _is_inside(rings, right)[:, None]
    return np.where(in_left, left, np.where(in_right, right, points))


def _is_inside(rings: Sequence[FloatArray], points: FloatArray) -> NDArray[np.bool_]:
    """Return flags (M,): True for points (M, 2) m inside an odd number of rings (N, 2) m, so inside the area."""
    inside = np.zeros(len(points), dtype=bool)
    for ring in rings:
        polygon = shapely.polygons(ring)
        shapely.prepare(polygon)
        inside ^= shapely.contains_xy(polygon, points[:, 0], points[:, 1])
    return inside


def _on_ground(image: HeightImage, plan: FloatArray) -> list[FloatArray]:
    """Return a line in plan (M, 2) m as lines (N, 3) m on the ground, without the parts that have no ground."""
    points = np.column_stack([plan, heights_at(image, plan)])
    known = np.isfinite(points[:, 2])
    parts = np.split(np.arange(len(points)), np.flatnonzero(np.diff(known)) + 1)
    return [points[part] for part in parts if known[part[0]] and len(part) > 1]
