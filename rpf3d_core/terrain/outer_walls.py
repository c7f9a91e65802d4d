"""Vertical walls around the convex hull of a terrain: a rock that leaves the hull in plan has left the terrain.

Beyond the hull there is no more ground in any direction, so a fall there is not a flight over ground. Sides of the hull
that lie on the sides of the terrain's box need no wall, because flights end there anyway.
"""

import numpy as np
import shapely

from rpf3d_core.terrain.frame import FloatArray

TALLER = 16.0
"""Distance by which walls reach beyond the heights of the border, over its extent (-): no rock flies over them."""


def outer_walls(border: FloatArray, crack: float) -> FloatArray:
    """Return triangles (T, 3, 3) m that face inwards, along the sides of the hull that are not sides of its box.

    border : (B, 3, 3) m, as `border.border_of` gives it; crack : m, within which a side lies on a side of the box
    """
    points = border[:, 0]
    hull = shapely.convex_hull(shapely.multipoints(points[:, :2]))
    if hull.area <= crack * hull.length:
        return np.empty((0, 3, 3))
    ring = shapely.get_coordinates(shapely.orient_polygons(hull))
    sides = np.stack([ring[:-1], ring[1:]], axis=1)
    box = np.array([ring.min(axis=0), ring.max(axis=0)])
    on_box = (np.abs(sides[:, None] - box[None, :, None]) <= crack).all(axis=2).any(axis=(1, 2))
    return _walls(sides[~on_box], points)


def _walls(sides: FloatArray, points: FloatArray) -> FloatArray:
    """Return two triangles for each side (N, 2, 2) m, with the hull to its left, far above and below points (P, 3)."""
    low, high = points[:, 2].min(), points[:, 2].max()
    reach = TALLER * float(np.ptp(points, axis=0).max())
    (a, b), z = sides.transpose(1, 0, 2), np.ones((len(sides), 1))
    a_low, a_high, b_low, b_high = (
        np.hstack([place, height * z]) for place in (a, b) for height in (low - reach, high + reach)
    )
    return np.concatenate([np.stack([b_low, a_low, a_high], axis=1), np.stack([b_low, a_high, b_high], axis=1)])
