"""Areas of interest that come while the simulator runs: outlines, and circles around what moves about."""

from collections.abc import Sequence

import numpy as np
import shapely

from rpf3d_core.io.polygons import polygon_of
from rpf3d_core.terrain.frame import FloatArray

CORNERS_A_QUARTER = 8
"""Of a circle drawn as a polygon: it lies within 0.5 % of the radius of the true one."""


def outline_of(corners: Sequence[tuple[float, float]]) -> list[FloatArray]:
    """The ring (P, 2) m of three or more corners in plan.

    Raises
    ------
    InputError
        They cross themselves or enclose no area.
    """
    return _rings(polygon_of(corners))


def circles_around(places: FloatArray, radius: float) -> list[FloatArray]:
    """The rings (P, 2) m around places (N, 2) m, holes among them; circles that overlap are one area.

    Each circle is drawn around the true one, never inside it: a rock at its rim is counted.
    """
    drawn = radius / np.cos(np.pi / (4 * CORNERS_A_QUARTER))
    circles = shapely.buffer(shapely.points(places), drawn, quad_segs=CORNERS_A_QUARTER)
    return _rings(shapely.union_all(circles))


def _rings(area: shapely.Geometry) -> list[FloatArray]:
    rings = [ring for polygon in shapely.get_parts(area) for ring in (polygon.exterior, *polygon.interiors)]
    return [shapely.get_coordinates(ring) for ring in rings]
