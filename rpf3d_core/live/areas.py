"""Areas of interest that arrive while the simulator runs: outlines, and circles around moving objects."""

from collections.abc import Sequence

import numpy as np
import shapely

from rpf3d_core.formats.polygons import polygon_of
from rpf3d_core.terrain.frame import FloatArray

CORNERS_A_QUARTER = 8
"""Corners per quarter of a circle drawn as a polygon, which deviates by at most 0.5 % of the radius from the circle."""


def outline_of(corners: Sequence[tuple[float, float]]) -> list[FloatArray]:
    """Return the rings (P, 2) m of an area with three or more corners in plan.

    Raises
    ------
    InputError
        The outline crosses itself or encloses no area.
    """
    return _rings(polygon_of(corners))


def circles_around(places: FloatArray, radius: float) -> list[FloatArray]:
    """Return the rings (P, 2) m, holes included, of circles around places (N, 2) m; overlapping circles form one area.

    Each polygon encloses its true circle, so a rock at the rim of the circle is counted.
    """
    drawn = radius / np.cos(np.pi / (4 * CORNERS_A_QUARTER))
    circles = shapely.buffer(shapely.points(places), drawn, quad_segs=CORNERS_A_QUARTER)
    return _rings(shapely.union_all(circles))


def _rings(area: shapely.Geometry) -> list[FloatArray]:
    rings = [ring for polygon in shapely.get_parts(area) for ring in (polygon.exterior, *polygon.interiors)]
    return [shapely.get_coordinates(ring) for ring in rings]
