"""Make inclined planes, and boxes (slabs) that are released on them with one face parallel to the plane."""

import math

import numpy as np
from flights.scenes_of_facets import grid_triangles, terrain_of

from bodies.flying_bodies import about, matrix
from rpf3d_core.shapes.families import box

ACCURACY = 1e-3
"""Accuracy (m) of the flights; a slab is released 1.6 ACCURACY above the plane."""


def slope(angle: float, strike: float = 0.0, at=(0.0, 0.0, 0.0), reach: float = 200.0):
    """Return a square plane that falls at an angle (rad) towards +x, rotated by `strike` (rad) about z.

    at : centre (x, y, z) m of the plane; reach : half of the sides (m)
    """
    corners = [(u * math.cos(angle), y, -u * math.sin(angle)) for u in (-reach, reach) for y in (-reach, reach)]
    return terrain_of(np.array(corners) @ matrix(about((0, 0, 1), strike)).T + at, grid_triangles(2, 2))


def slab(b: float, h: float, angle: float, strike: float = 0.0, at=(0.0, 0.0, 0.0)):
    """Return a slab as a polyhedron, and its release on a slope: centre (3,) m and orientation (4,).

    b, h : half of its lengths (m) down the slope and normal to the slope; its width is 1 m
    angle, strike, at : as in `slope`
    """
    down, out = np.array([math.cos(angle), 0.0, -math.sin(angle)]), np.array([math.sin(angle), 0.0, math.cos(angle)])
    sides = sorted([(2.0 * b, 0, down), (2.0 * h, 1, out), (1.0, 2, np.array([0.0, 1.0, 0.0]))], reverse=True)
    columns = [axis for _, _, axis in sides]  # the first axis of a box is along its longest side
    if np.linalg.det(columns) < 0.0:
        columns[0] = -columns[0]
    turn = matrix(about((0, 0, 1), strike))
    x = turn @ ((h + 1.6 * ACCURACY) * out) + at
    return box([length for length, _, _ in sides]), x, quaternion(turn @ np.array(columns).T)


def quaternion(turn: np.ndarray) -> np.ndarray:
    """Return the quaternion (4,) of a rotation matrix (3, 3)."""
    pairs = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) @ np.diag(turn)
    q = 0.5 * np.sqrt(np.maximum(1.0 + pairs, 0.0))
    k = int(np.argmax(q))
    odd = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    if k == 0:
        return np.array([q[0], *(odd / (4.0 * q[0]))])
    even = (turn + turn.T)[k - 1] / (4.0 * q[k])
    even[k - 1] = q[k]
    return np.array([odd[k - 1] / (4.0 * q[k]), *even])
