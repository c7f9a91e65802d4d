"""Compute with vectors (x, y, z) as tuples of floats.

The order of operations is fixed, so that Python and compiled code round in the same way.
"""

import math

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Vec


@kernel
def add(a: Vec, b: Vec) -> Vec:
    """Return the sum a + b of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel
def subtract(a: Vec, b: Vec) -> Vec:
    """Return the difference a - b of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def scale(k: float, a: Vec) -> Vec:
    """Return the vector a multiplied by the number k."""
    return k * a[0], k * a[1], k * a[2]


@kernel
def dot(a: Vec, b: Vec) -> float:
    """Return the scalar product a . b of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a: Vec, b: Vec) -> Vec:
    """Return the vector product a x b of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def norm(a: Vec) -> float:
    """Return the length |a| of a vector."""
    return math.sqrt(dot(a, a))


NOISE = 1e-12
"""Share of a vector's length (-) below which its component along a plane counts as rounding error.

The limit is a thousand times the largest possible rounding error.
"""


@kernel
def along(a: Vec, n: Vec) -> Vec:
    """Return the component of vector a along the plane with unit normal n; zero if only rounding error remains."""
    part = without(a, n)
    return part if dot(part, part) > NOISE * NOISE * dot(a, a) else (0.0, 0.0, 0.0)


@kernel
def without(a: Vec, n: Vec) -> Vec:
    """Return vector a without its component along the unit vector n."""
    return subtract(a, scale(dot(a, n), n))
