"""Make a mesh from one point in each cell of a square grid in plan, in time proportional to the number of points.

The points of four cells around a common corner are the corners of a quadrilateral. The quadrilateral contains the
common corner and is star-shaped around this corner, so one of its diagonals cuts it into two triangles that face up.
All quadrilaterals together cover the plan once. A cell without a point leaves a hole; `cloud_holes.py` closes small
holes.
"""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.ground_points import Cells, Ids


def cell_triangles(plan: FloatArray, cells: Cells) -> NDArray[np.int32]:
    """Return the triangles (F, 3) between the points of neighbouring cells; all face up.

    plan : (K, 2) m, the point of each cell in plan; cells : the K cells with a point
    """
    corner = _squares(cells)
    there = (corner >= 0).sum(axis=1)
    full = corner[there == 4]
    a, b, c, d = (plan[full[:, k]] for k in range(4))
    first = np.minimum(_area(a, b, c), _area(a, c, d)), _in_circle(a, b, c, d)
    second = np.minimum(_area(a, b, d), _area(b, c, d))
    other = (first[0] <= 0.0) | ((second > 0.0) & first[1])
    along, across = full[~other], full[other]
    three = _three(corner[there == 3])
    triangles = np.concatenate(
        [along[:, [0, 1, 2]], along[:, [0, 2, 3]], across[:, [0, 1, 3]], across[:, [1, 2, 3]], three]
    )
    p, q, r = (plan[triangles[:, k]] for k in range(3))
    return triangles[_area(p, q, r) > 0.0].astype(np.int32)


def _squares(cells: Cells) -> Ids:
    """Return the four points (S, 4) around each common corner of four cells, counter-clockwise; -1 for a missing point.

    Corners with fewer than three points around them are left out.
    """
    stride = int(cells.column.max()) + 3
    key = cells.row * stride + cells.column
    steps = (0, 1, stride + 1, stride)
    low = np.sort(np.concatenate([key - step for step in steps]))
    low = low[np.concatenate([[True], low[1:] != low[:-1]])]
    corner = np.empty((len(low), 4), np.int64)
    for k, step in enumerate(steps):
        at = np.minimum(np.searchsorted(key, low + step), len(key) - 1)
        corner[:, k] = np.where(key[at] == low + step, at, -1)
    return np.asarray(corner[(corner >= 0).sum(axis=1) >= 3])


def _three(corner: Ids) -> Ids:
    """Return the triangle (S, 3) around each common corner of four cells if exactly three of the cells have a point.

    corner : (S, 4) points of the four cells, from `_squares`; exactly one of the four is -1
    """
    order = np.argsort(corner < 0, axis=1, kind="stable")[:, :3]
    return np.asarray(np.take_along_axis(corner, order, axis=1))


def _area(p: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
    """Return twice the area (N,) m^2 in plan of the triangles p q r; above 0 if they face up.

    p, q, r : (N, 2) m, the corners
    """
    return np.asarray((q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (r[:, 0] - p[:, 0]) * (q[:, 1] - p[:, 1]))


def _in_circle(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> NDArray[np.bool_]:
    """Return flags (N,): true where d lies inside the circle through a, b, c.

    Where true, the diagonal b d cuts the quadrilateral a b c d into better triangles than the diagonal a c.

    a, b, c, d : (N, 2) m, counter-clockwise
    """
    (ax, ay), (bx, by), (cx, cy) = ((p - d).T for p in (a, b, c))
    aa, bb, cc = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    return np.asarray(ax * (by * cc - bb * cy) - ay * (bx * cc - bb * cx) + aa * (bx * cy - by * cx) > 0.0)
