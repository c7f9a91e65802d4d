"""Places spread evenly over a surface: by its true area, not by its area in plan, where a steep face counts too little.

A rock's patch is found on the running sum of all areas, and its place in it by the square root that makes a triangle's
places even (Turk 1990, Graphics Gems, "Generating random points in triangles"): three uniform numbers a rock.
"""

from dataclasses import dataclass

import numpy as np

from rpf3d_core.terrain.clipping import areas_of
from rpf3d_core.terrain.frame import FloatArray


@dataclass(frozen=True, eq=False)
class Patches:
    """Triangles that rocks may fall from.

    corners : (P, 3, 3) m, local frame; reached : (P,) m^2, the running sum of their areas
    """

    corners: FloatArray
    reached: FloatArray


def patches_of(corners: FloatArray) -> Patches:
    """Patches from triangles (P, 3, 3) m, P >= 1."""
    return Patches(corners, np.cumsum(areas_of(corners)))


def places_on(patches: Patches, which: FloatArray, across: FloatArray, along: FloatArray) -> FloatArray:
    """Places (R, 3) m, even over the patches for uniform numbers (R,) in [0, 1): the patch, and two within it."""
    area = patches.reached[-1]
    patch = np.searchsorted(patches.reached, which * area, side="right")
    a, b, c = (patches.corners[np.minimum(patch, len(patches.reached) - 1), k] for k in range(3))
    width, height = np.sqrt(across)[:, None], along[:, None]
    places: FloatArray = a + width * ((b - a) + height * (c - b))
    return places
