"""Places spread evenly over a surface by its true area. Area in plan would give a steep face too few places.

The running sum of all areas selects a rock's triangle. The square root that makes places in a triangle even (Turk 1990,
Graphics Gems, "Generating random points in triangles") selects its place. That takes three uniform numbers a rock.
"""

from dataclasses import dataclass

import numpy as np

from rpf3d_core.terrain.clipping import areas_of
from rpf3d_core.terrain.frame import FloatArray


@dataclass(frozen=True, eq=False)
class ReleaseTriangles:
    """Triangles that rocks may fall from.

    corners : (P, 3, 3) m, local frame; reached : (P,) m^2, the running sum of the triangles' areas
    """

    corners: FloatArray
    reached: FloatArray


def release_triangles(corners: FloatArray) -> ReleaseTriangles:
    """Return release triangles with the running sum of their areas, from corners (P, 3, 3) m, P >= 1."""
    return ReleaseTriangles(corners, np.cumsum(areas_of(corners)))


def places_on(triangles: ReleaseTriangles, which: FloatArray, across: FloatArray, along: FloatArray) -> FloatArray:
    """Return places (R, 3) m, spread evenly over the triangles, from uniform numbers (R,) in [0, 1).

    which : selects the triangle; across, along : select the place within the triangle
    """
    area = triangles.reached[-1]
    row = np.searchsorted(triangles.reached, which * area, side="right")
    a, b, c = (triangles.corners[np.minimum(row, len(triangles.reached) - 1), k] for k in range(3))
    width, height = np.sqrt(across)[:, None], along[:, None]
    places: FloatArray = a + width * ((b - a) + height * (c - b))
    return places
