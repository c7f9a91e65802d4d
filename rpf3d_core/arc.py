"""Compute the free flight of a rock without size (a lumped mass), an exact parabola, for both engines.

Source: thesis, equations 2-1 and 2-2.
"""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Motion, Vec


class Arc(NamedTuple):
    """A parabola that starts at x (3,) m with velocity v (3,) m/s under gravity (m/s^2, along -z)."""

    x: Vec
    v: Vec
    gravity: float


@kernel
def position(arc: Arc, t: float) -> Vec:
    """Return the position (3,) of the rock (m), t seconds after the start of the arc."""
    x, v = arc.x, arc.v
    return x[0] + v[0] * t, x[1] + v[1] * t, x[2] + (v[2] - 0.5 * arc.gravity * t) * t


@kernel
def velocity(arc: Arc, t: float) -> Vec:
    """Return the velocity (3,) of the rock (m/s), t seconds after the start of the arc."""
    return arc.v[0], arc.v[1], arc.v[2] - arc.gravity * t


@kernel
def advance(motion: Motion, gravity: float, t: float) -> Motion:
    """Return the motion of a rock after t more seconds of free flight; the spin does not change.

    gravity : m/s^2
    """
    arc = Arc(motion.x, motion.v, gravity)
    return Motion(motion.t + t, position(arc, t), velocity(arc, t), motion.w)


@kernel
def arc_length(arc: Arc, t: float) -> float:
    """Return the length (m) of the first t seconds of the arc: the integral of speed over time, in closed form."""
    horizontal = arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1]
    end = arc.v[2] - arc.gravity * t
    return (_length_term(horizontal, arc.v[2]) - _length_term(horizontal, end)) / arc.gravity


@kernel
def _length_term(h: float, u: float) -> float:
    """Return the antiderivative (m^2/s^2) of sqrt(h + u^2) with respect to u, from which `arc_length` follows.

    h : squared horizontal speed (m^2/s^2); u : vertical speed (m/s)

    The function asinh is written as a logarithm, so that both engines round the result in the same way.
    """
    speed = math.sqrt(h + u * u)
    if h <= 0.0:
        return 0.5 * u * speed
    rise = math.log((abs(u) + speed) / math.sqrt(h))
    return 0.5 * (u * speed + h * math.copysign(rise, u))


@kernel
def time_over(arc: Arc, begin: float, length: float) -> float:
    """Return a time (s) up to which a rock flies at most `length` (m) along its path, from the time `begin` (s) on.

    Both times count from the start of the arc. The path between both times may be shorter than `length`, but never
    longer. The searches for contacts choose their next step with this bound.
    """
    vx, vy, vz = arc.v[0], arc.v[1], arc.v[2] - arc.gravity * begin
    speed = math.sqrt(vx * vx + vy * vy + vz * vz)
    return begin + 2.0 * length / (speed + math.sqrt(speed * speed + 2.0 * arc.gravity * length))


@kernel
def gravity_along(n: Vec, gravity: float) -> Vec:
    """Return the part of gravity (3,) (m/s^2) that pulls a rock down a plane with unit normal n (3,).

    The third component is not computed as gravity n_z^2 - gravity: for a nearly level plane, rounding would make this
    difference 0.
    """
    return gravity * n[2] * n[0], gravity * n[2] * n[1], -gravity * (n[0] * n[0] + n[1] * n[1])


@kernel
def fall_time(z_speed: float, height: float, gravity: float) -> float:
    """Return the time (s) after which a flying rock is a given height below its start.

    z_speed : m/s, vertical speed at the start, positive upwards; height : m, at least 0; gravity : m/s^2
    """
    root = math.sqrt(z_speed * z_speed + 2.0 * gravity * height)
    if z_speed > 0.0:
        return (z_speed + root) / gravity
    return 2.0 * height / (root - z_speed) if height > 0.0 else 0.0


@kernel
def falling_time(c: float, b: float, a: float) -> float:
    """Return the first time t >= 0 (s) at which c + b t + a t^2 falls through zero, as when a rock reaches a plane.

    The result is inf if c + b t + a t^2 never falls through zero.

    c, b, a : height (m) of the rock above the plane, its speed (m/s) and half its acceleration (m/s^2), both away from
        the plane

    The result is the root at which the speed b + 2 a t is negative (or zero, if the rock only touches the plane). Of
    the two formulas for this root, the code uses the formula in which b and the square root do not cancel.
    """
    if c < 0.0 and a >= 0.0:  # from below, the height can only rise through zero
        return math.inf
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return math.inf
    if b > 0.0:
        return (-b - math.sqrt(discriminant)) / (2.0 * a) if a < 0.0 else math.inf
    denominator = math.sqrt(discriminant) - b
    if denominator == 0.0:
        return 0.0 if c == 0.0 and a < 0.0 else math.inf
    t = 2.0 * c / denominator
    return t if t >= 0.0 else math.inf
