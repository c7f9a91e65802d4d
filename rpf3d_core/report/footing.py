"""Find whether a fence can be built at a place, from the slope of the ground there."""

from typing import NamedTuple

import numpy as np

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.height_image import HeightImage, height_image, heights_at

BUILDABLE = 35.0
"""Largest slope (degrees) of the ground on which a fence can be built. UNCONFIRMED.

Broken rock lies at 35 to 40 degrees: on steeper ground no fill holds and no machine stands. Berms have less than 15
degrees, bench faces 55 to 85, so that the exact limit matters little on a benched wall.
"""
FOOTING = 1.0
"""Distance (m) on each side of a place over which the slope of the ground is measured."""
MOSTLY = 0.5
"""Smallest share (-) of steep ground for which a place counts as on a face."""


class Footing(NamedTuple):
    """The slope of the ground where a fence would stand, from many points along the line of the fence.

    steep : share (-) of the points on ground steeper than BUILDABLE; None if the ground is not known at any point
    slope : median slope (degrees) of the steep points if their share is at least MOSTLY, else of the points that are
        not steep; None if the ground is not known at any point
    """

    steep: float | None
    slope: float | None

    @property
    def is_on_a_face(self) -> bool:
        """True if no fence can be built, because most of the ground is too steep."""
        return self.steep is not None and self.steep >= MOSTLY


def footing_at(terrain: Terrain, places: FloatArray) -> Footing:
    """Return the slope of the ground at places (N, 2) m in plan, local frame, as a `Footing`."""
    slope = slopes_at(terrain, places)
    slope = slope[np.isfinite(slope)]
    if len(slope) == 0:
        return Footing(steep=None, slope=None)
    is_steep = slope > BUILDABLE
    share = float(is_steep.mean())
    return Footing(steep=share, slope=float(np.median(slope[is_steep == (share >= MOSTLY)])))


def slopes_at(terrain: Terrain, places: FloatArray) -> FloatArray:
    """Return the slope (N,) degrees of the ground at places (N, 2) m in plan; NaN where the ground is not known.

    Along each axis of the plan, the flatter of both sides of a place counts: at the foot of a face and at the edge of a
    berm, a fence can stand on the flatter side.
    """
    if len(places) == 0:
        return np.empty(0)
    image = height_image(terrain, places, 2.0 * FOOTING)
    height = heights_at(image, places)
    along = [_flatter(image, places, height, np.array(step)) for step in ((FOOTING, 0.0), (0.0, FOOTING))]
    return np.asarray(np.degrees(np.arctan(np.hypot(*along))))


def _flatter(image: HeightImage, places: FloatArray, height: FloatArray, step: FloatArray) -> FloatArray:
    """Return the smaller gradient (N,) (-) of the two from each place to its sides along an axis; NaN if both are NaN.

    height : (N,) m, of the ground at the places; step : (2,) m, from a place to one side
    """
    sides = [np.abs(heights_at(image, places + sign * step) - height) / FOOTING for sign in (-1.0, 1.0)]
    return np.asarray(np.fmin(*sides))
