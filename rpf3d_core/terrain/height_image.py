"""Find the heights of the ground at many points, with an image of the terrain seen from above."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.plan_view import PlanView, Window, seen_from_above

FINEST = 0.25
"""Default of the smallest side (m) of a pixel."""
MOST_PIXELS = 3000
"""Largest number of pixels along the longer side of the image."""


class HeightImage(NamedTuple):
    """The terrain and its view from above: the uppermost facet at each pixel, on whose plane heights are computed."""

    terrain: Terrain
    view: PlanView


def height_image(terrain: Terrain, places: FloatArray, margin: float, finest: float = FINEST) -> HeightImage:
    """Return an image of the terrain from which `heights_at` computes heights around some places.

    places : (N, 2) m in plan; margin : m, distance by which the image extends beyond the places
    finest : smallest side (m) of a pixel
    """
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    window = Window(left=float(low[0]), right=float(high[0]), bottom=float(low[1]), top=float(high[1]))
    pixels = int(np.clip(max(window.width, window.height) / finest, 1, MOST_PIXELS))
    return HeightImage(terrain=terrain, view=seen_from_above(terrain, window, pixels))


def heights_at(image: HeightImage, plan: FloatArray) -> FloatArray:
    """Return the height (...,) m of the ground at points (..., 2) m in plan; NaN outside the image and in holes.

    Within about half a pixel of a facet's edge, the height may be taken from the plane of the neighbouring facet.
    """
    points = plan.reshape(-1, 2)
    facet = _facets_at(image.view, points)
    height = np.full(len(points), np.nan)
    on = np.flatnonzero(facet >= 0)
    corners = image.terrain.vertices[image.terrain.triangles[facet[on]]]
    a, normal = corners[:, 0], np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    away = points[on] - a[:, :2]
    height[on] = a[:, 2] - (normal[:, 0] * away[:, 0] + normal[:, 1] * away[:, 1]) / normal[:, 2]
    return height.reshape(plan.shape[:-1])


def _facets_at(view: PlanView, points: FloatArray) -> NDArray[np.integer]:
    """Return the facet (N,) that the view shows at points (N, 2) m in plan; -1 for no facet or outside the view."""
    rows, columns = view.facet.shape
    window = view.window
    column = np.floor((points[:, 0] - window.left) / window.width * columns).astype(np.int64)
    row = np.floor((points[:, 1] - window.bottom) / window.height * rows).astype(np.int64)
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    found = np.full(len(points), -1, dtype=np.int64)
    found[inside] = view.facet[row[inside], column[inside]]
    return found
