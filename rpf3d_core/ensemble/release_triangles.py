"""Draw release places on a surface, spread evenly over its true area.

Places that are even in plan would be too few on steep slopes. Three uniform numbers select the place of a rock. The
first number selects the triangle, through the running sum of all areas. The other two numbers select the place in the
triangle, with a square root that makes the places even (Turk 1990, Graphics Gems, "Generating random points in
triangles").
"""

from dataclasses import dataclass

import numpy as np

from rpf3d_core.terrain.clipping import areas_of
from rpf3d_core.terrain.frame import FloatArray


@dataclass(frozen=True, eq=False)
class ReleaseTriangles:
    """The triangles of an area source, on which rocks may be released.

    corners : (P, 3, 3) m, local frame; reached : (P,) m^2, the running sum of the triangles' areas
    """

    corners: FloatArray
    reached: FloatArray


def release_triangles(corners: FloatArray) -> ReleaseTriangles:
    """Return the release triangles of an area source, with the running sum of their areas.

    corners : (P, 3, 3) m, P >= 1
    """
    return ReleaseTriangles(corners, np.cumsum(areas_of(corners)))


def places_on(triangles: ReleaseTriangles, which: FloatArray, across: FloatArray, along: FloatArray) -> FloatArray:
    """Return release places (R, 3) m, spread evenly over the triangles, from uniform numbers (R,) in [0, 1).

    which : (R,) numbers that select the triangle; across, along : (R,) numbers that select the place in the triangle
    """
    area = triangles.reached[-1]
    row = np.searchsorted(triangles.reached, which * area, side="right")
    a, b, c = (triangles.corners[np.minimum(row, len(triangles.reached) - 1), k] for k in range(3))
    width, height = np.sqrt(across)[:, None], along[:, None]
    places: FloatArray = a + width * ((b - a) + height * (c - b))
    return places
