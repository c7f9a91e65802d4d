"""Vertical walls around the convex hull of a terrain: a rock that leaves the hull in plan has left the terrain.

A rock outside the hull can never be above ground again, so its flight ends at the wall. Sides of the hull that lie on
the sides of the terrain's box need no wall, because flights end there anyway.
"""

import numpy as np
import shapely

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.plane.hull import convex_hull

TALLER = 16.0
"""Height of the walls above and below the border, over the border's extent (-): no rock flies over the walls."""


def outer_walls(border: FloatArray, crack: float) -> FloatArray:
    """Return the walls around a terrain as triangles (T, 3, 3) m that face inwards.

    There are no walls if the hull is only a crack wide.

    border : (B, 3, 3) m, from `border.border_of`
    crack : m, distance up to which a side of the convex hull counts as lying on a side of the terrain's box; a side of
        the hull on the box gets no wall
    """
    points = border[:, 0]
    hull = convex_hull(points[:, :2])
    if hull.area <= crack * hull.length:
        return np.empty((0, 3, 3))
    ring = shapely.get_coordinates(shapely.orient_polygons(hull))
    sides = np.stack([ring[:-1], ring[1:]], axis=1)
    box = np.array([ring.min(axis=0), ring.max(axis=0)])
    on_box = (np.abs(sides[:, None] - box[None, :, None]) <= crack).all(axis=2).any(axis=(1, 2))
    return _walls(sides[~on_box], points)


def _walls(sides: FloatArray, points: FloatArray) -> FloatArray:
    """Return the triangles (2 N, 3, 3) m of vertical walls, two for each side of the hull.

    The walls reach far above and below the points (P, 3) m.

    sides : (N, 2, 2) m, begin and end of each side; the hull lies to the left
    """
    low, high = points[:, 2].min(), points[:, 2].max()
    reach = TALLER * float(np.ptp(points, axis=0).max())
    (a, b), z = sides.transpose(1, 0, 2), np.ones((len(sides), 1))
    a_low, a_high, b_low, b_high = (
        np.hstack([place, height * z]) for place in (a, b) for height in (low - reach, high + reach)
    )
    return np.concatenate([np.stack([b_low, a_low, a_high], axis=1), np.stack([b_low, a_high, b_high], axis=1)])
