"""Arithmetic with unit quaternions (w, x, y, z), which describe the orientation of a body.

A quaternion turns vectors from the body's axes into the axes of space. The order of operations is fixed, so Python and
compiled code give the same rounding.
"""

import math

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Vec

Quaternion = tuple[float, float, float, float]

NO_TURN: Quaternion = (1.0, 0.0, 0.0, 0.0)
"""Orientation of a body whose axes are the axes of space."""

SMALL_ANGLE = 1e-4
"""Half angle (rad) below which sin(a) / a is summed as a series, whose error is then below 1e-18."""


@kernel
def multiply(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the product p q: the turn q followed by the turn p."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@kernel
def inverse(q: Quaternion) -> Quaternion:
    """Return the inverse of a unit quaternion, which turns vectors from space into the body's axes."""
    return q[0], -q[1], -q[2], -q[3]


@kernel
def turned(q: Quaternion, a: Vec) -> Vec:
    """Return vector a turned by the unit quaternion q: from the body's axes into space."""
    x = 2.0 * (q[2] * a[2] - q[3] * a[1])
    y = 2.0 * (q[3] * a[0] - q[1] * a[2])
    z = 2.0 * (q[1] * a[1] - q[2] * a[0])
    return (
        a[0] + q[0] * x + q[2] * z - q[3] * y,
        a[1] + q[0] * y + q[3] * x - q[1] * z,
        a[2] + q[0] * z + q[1] * y - q[2] * x,
    )


@kernel
def turned_back(q: Quaternion, a: Vec) -> Vec:
    """Return vector a turned by the inverse of the unit quaternion q: from space into the body's axes."""
    return turned(inverse(q), a)


@kernel
def normalised(q: Quaternion) -> Quaternion:
    """Return a quaternion, not 0, scaled to length 1."""
    k = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return k * q[0], k * q[1], k * q[2], k * q[3]


@kernel
def turn_by(angle: Vec) -> Quaternion:
    """Return the quaternion of a turn about the direction of a vector, by the length of the vector (rad)."""
    half = 0.5 * math.sqrt(angle[0] * angle[0] + angle[1] * angle[1] + angle[2] * angle[2])
    k = 0.5 * (1.0 - half * half / 6.0) if half < SMALL_ANGLE else 0.5 * math.sin(half) / half
    return math.cos(half), k * angle[0], k * angle[1], k * angle[2]
