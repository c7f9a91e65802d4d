"""Directions that cover a sphere evenly."""

import math

import numpy as np

from rpf3d_core.terrain.frame import FloatArray

GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
"""Angle (rad) about the z axis from one point of a Fibonacci sphere to the next."""


def fibonacci_sphere(count: int) -> FloatArray:
    """Return unit vectors (count, 3) that cover the sphere evenly.

    Point k of n lies at z = 1 - (2 k + 1)/n and at the azimuth k times the golden angle, so each point has an equal
    share of the area (Swinbank & Purser 2006, Q. J. R. Meteorol. Soc. 132:1769).
    """
    points = np.empty((count, 3))
    for k in range(count):
        z = 1.0 - (2.0 * k + 1.0) / count
        radius, angle = math.sqrt(1.0 - z * z), k * GOLDEN_ANGLE
        points[k] = radius * math.cos(angle), radius * math.sin(angle), z
    return points
