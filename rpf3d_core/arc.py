"""Free flight of a lumped mass: a parabola, exactly.

Source: thesis, equations 2-1 and 2-2.
"""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Motion, Vec


class Arc(NamedTuple):
    """A parabola from x (3,) m with v (3,) m/s under gravity (m/s^2, along -z)."""

    x: Vec
    v: Vec
    gravity: float


@kernel
def position(arc: Arc, t: float) -> Vec:
    """Where the rock is t seconds into the arc (m)."""
    x, v = arc.x, arc.v
    return x[0] + v[0] * t, x[1] + v[1] * t, x[2] + (v[2] - 0.5 * arc.gravity * t) * t


@kernel
def velocity(arc: Arc, t: float) -> Vec:
    """How fast it is t seconds into the arc (m/s)."""
    return arc.v[0], arc.v[1], arc.v[2] - arc.gravity * t


@kernel
def advance(motion: Motion, gravity: float, t: float) -> Motion:
    """The motion t seconds of free flight later; spin is kept."""
    arc = Arc(motion.x, motion.v, gravity)
    return Motion(motion.t + t, position(arc, t), velocity(arc, t), motion.w)


@kernel
def arc_length(arc: Arc, t: float) -> float:
    """Length of the arc's first t seconds (m): the integral of speed over time, in closed form."""
    horizontal = arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1]
    end = arc.v[2] - arc.gravity * t
    return (_length_term(horizontal, arc.v[2]) - _length_term(horizontal, end)) / arc.gravity


@kernel
def _length_term(h: float, u: float) -> float:
    """Antiderivative of sqrt(h + u^2) in u, with asinh written out so that both engines round alike."""
    speed = math.sqrt(h + u * u)
    if h <= 0.0:
        return 0.5 * u * speed
    rise = math.log((abs(u) + speed) / math.sqrt(h))
    return 0.5 * (u * speed + h * math.copysign(rise, u))


@kernel
def time_over(arc: Arc, begin: float, length: float) -> float:
    """A time (s) by which the arc, from `begin` on, has gone no further than `length` (m)."""
    vx, vy, vz = arc.v[0], arc.v[1], arc.v[2] - arc.gravity * begin
    speed = math.sqrt(vx * vx + vy * vy + vz * vz)
    return begin + 2.0 * length / (speed + math.sqrt(speed * speed + 2.0 * arc.gravity * length))


@kernel
def gravity_along(n: Vec, gravity: float) -> Vec:
    """The part of gravity (m/s^2) along a plane of unit normal n.

    Written without the difference g - g n_z^2, which loses the slope of a nearly level plane to rounding.
    """
    return gravity * n[2] * n[0], gravity * n[2] * n[1], -gravity * (n[0] * n[0] + n[1] * n[1])


@kernel
def fall_time(z_speed: float, height: float, gravity: float) -> float:
    """Time (s) until a rock that rises at z_speed (m/s) is `height` >= 0 (m) lower than it is now."""
    root = math.sqrt(z_speed * z_speed + 2.0 * gravity * height)
    if z_speed > 0.0:
        return (z_speed + root) / gravity
    return 2.0 * height / (root - z_speed) if height > 0.0 else 0.0
