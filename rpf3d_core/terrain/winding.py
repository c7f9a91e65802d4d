"""Count how often the border of ground runs around a point in plan, from the border sides east of the point."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray


def crossings(sides: FloatArray, points: FloatArray) -> NDArray[np.int64]:
    """Return whether each border side crosses the ray from a point to the east: 1 northwards, -1 southwards, 0 not.

    The sum over all sides of a border is the winding number: how often the border runs around the point,
    counter-clockwise.

    sides : (N, 2, 2) m, both ends of each side in plan; points : (N, 2) m, one for each side, or (2,), one for all
    """
    (ax, ay), (bx, by) = sides.transpose(1, 2, 0)
    x, y = points.T
    up, down = (ay <= y) & (by > y), (by <= y) & (ay > y)
    left = (bx - ax) * (y - ay) - (x - ax) * (by - ay)  # above 0 where the point lies to the left of the side
    return np.where(up & (left > 0.0), 1, 0) - np.where(down & (left < 0.0), 1, 0)
