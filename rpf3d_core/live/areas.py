"""Areas of interest that arrive in messages while the simulator runs: outlines, and circles around vehicles."""

from collections.abc import Sequence

import numpy as np
import shapely

from rpf3d_core.formats.polygons import polygon_of
from rpf3d_core.terrain.frame import FloatArray

CORNERS_A_QUARTER = 8
"""Corners per quarter of a circle drawn as a polygon, which differs by at most 0.5 % of the radius from the circle."""


def outline_of(corners: Sequence[tuple[float, float]]) -> list[FloatArray]:
    """Return the outlines (P, 2) m of an area of interest from its corners in plan, at least three.

    Raises
    ------
    InputError
        The outline crosses itself or encloses no area.
    """
    return _rings(polygon_of(corners))


def circles_around(places: FloatArray, radius: float) -> list[FloatArray]:
    """Return the outlines (P, 2) m of the area within circles around places (N, 2) m, such as vehicles.

    Overlapping circles form one area. Outlines of holes are included. Each polygon encloses its true circle, so a rock
    on the circle is counted.
    """
    drawn = radius / np.cos(np.pi / (4 * CORNERS_A_QUARTER))
    circles = shapely.buffer(shapely.points(places), drawn, quad_segs=CORNERS_A_QUARTER)
    return _rings(shapely.union_all(circles))


def _rings(area: shapely.Geometry) -> list[FloatArray]:
    rings = [ring for polygon in shapely.get_parts(area) for ring in (polygon.exterior, *polygon.interiors)]
    return [shapely.get_coordinates(ring) for ring in rings]
