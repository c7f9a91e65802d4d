"""A sphere on the ground: it skids until its slip is gone, then it rolls (the scene's `ground: sphere`).

With v_c the slip of the contact point, g_t gravity along the ground and N the push of the ground, both per mass:
    skidding    dv/dt = g_t - mu N v_c/|v_c|,   dv_c/dt = g_t - 7/2 mu N v_c/|v_c|
    rolling     dv/dt = 5/7 (g_t - mu_r N v/|v|), as long as 2/7 |g_t| <= mu N; otherwise it skids down
Rolling friction needs friction itself: where mu_r is larger than mu can bear, the centre goes like a block that slides
with mu, neither braked nor held by more; its spin is still told as that of rolling.
Each piece has a constant acceleration, so it is exact where friction does not turn: straight down a slope, on the
level, and wherever a sphere rolls without rolling friction. Elsewhere friction is that of the middle of the piece,
which ends before it has turned by TURN.

Derived from rigid-body mechanics (validation reference 2.5).
"""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rolling_moment import STICKS
from rpf3d_core.kinetics.sliding import CREEP, HOLDS
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale, without

TURN = 1.0 / 16.0
"""Tangent of the angle by which friction may turn in one piece: 3.6 degrees."""
CRAWL = 1e-2
"""Speed (m/s) of slip, or of a sphere that friction does not hold, below which it counts as zero while it turns.

The energy of 5 um of height.
"""
STRAIGHT = 1e-9
"""Share of gravity across a motion below which it does not turn."""
ROLLS = 1e-9
"""Slip over speed below which a sphere rolls, and share of the stop speed that is rounding: a million times that."""


class SphereGround(NamedTuple):
    """Skid to roll with the material's friction angle and, where it has one, its rolling friction."""

    @property
    def asks_rock(self) -> bool:
        """Its rules ask for the radius."""
        return True


class Rolls(NamedTuple):
    """One piece of a sphere's way on the ground, under a constant acceleration a (3,) m/s^2.

    v : (3,) m/s that it begins with; turn : (3,) rad/s^2 while it skids; t : s until something about it changes
    rolls : whether it rolls at the end; stops : whether it has stopped there; turns : whether it only turns there
    """

    v: Vec
    a: Vec
    turn: Vec
    t: float
    rolls: bool
    stops: bool
    turns: bool


@kernel
def rolling_piece(v: Vec, slip: Vec, n: Vec, g_t: Vec, push: float, surface: Surface, radius: float) -> Rolls:
    """The next piece of a sphere with velocity v along a ground that pushes it along n.

    slip : (3,) m/s along the ground; g_t : (3,) m/s^2, gravity along it; push : m/s^2
    """
    speed, slips = norm(v), norm(slip)
    friction, pull = surface.mu * push, norm(g_t)
    if slips > ROLLS * speed + CREEP:
        return _skids(v, slip, n, g_t, friction, radius)
    if STICKS * pull > friction:
        a, turn = _skidding(scale(1.0 / pull, g_t), n, g_t, friction, radius)
        return Rolls(v, a, turn, math.inf, False, False, False)
    return _rolls(v, g_t, min(surface.mu_r * push, _most_resistance(v, g_t, friction)), surface.stop_speed)


@kernel
def _most_resistance(v: Vec, g_t: Vec, friction: float) -> float:
    """The rolling resistance (m/s^2) that a ground of some friction (m/s^2) can give a sphere: more would make it slip.

    With a resistance r it takes a friction of 2/7 g_t + 5/7 r along the way, or down the slope at rest. At most that is
    mu N; then 5/7 (g_t - r) = g_t - mu N, as of a block that slides.
    """
    speed = norm(v)
    pull = dot(g_t, v) / speed if speed > 0.0 else norm(g_t)
    return (friction - STICKS * pull) / (1.0 - STICKS)


@kernel
def _skidding(direction: Vec, n: Vec, g_t: Vec, friction: float, radius: float) -> tuple[Vec, Vec]:
    """Accelerations of centre and spin of a sphere that slips in a direction (3,) unit."""
    turn = scale(2.5 * friction / radius, cross(n, direction))
    return add(g_t, scale(-friction, direction)), turn


@kernel
def _skids(v: Vec, slip: Vec, n: Vec, g_t: Vec, friction: float, radius: float) -> Rolls:
    """A piece of skidding: until the slip is gone, or has turned."""
    slips = norm(slip)
    direction = scale(1.0 / slips, slip)
    across = norm(without(g_t, direction))
    braking = 3.5 * friction - dot(g_t, direction)
    gone = slips / braking if braking > 0.0 else math.inf
    turned = TURN * slips / across if across > STRAIGHT * (norm(g_t) + friction) else math.inf
    if turned < gone:
        ahead = add(slip, scale(0.5 * turned, add(g_t, scale(-3.5 * friction, direction))))
        direction = scale(1.0 / norm(ahead), ahead)
    a, turn = _skidding(direction, n, g_t, friction, radius)
    return Rolls(v, a, turn, min(gone, turned), gone <= turned and gone < math.inf, False, turned < gone)


@kernel
def _rolls(v: Vec, g_t: Vec, resistance: float, stop_speed: float) -> Rolls:
    """A piece of rolling: until it has slowed to a stop, or to rest, or has turned."""
    speed, pull = norm(v), norm(g_t)
    holds = resistance >= HOLDS * pull
    lowest = max(stop_speed, CREEP) if holds else 0.0
    if holds and speed <= lowest * (1.0 + ROLLS):
        return Rolls(v, ZERO, ZERO, 0.0, True, True, False)
    if resistance == 0.0:
        return Rolls(v, scale(1.0 - STICKS, g_t), ZERO, math.inf, True, False, False)
    across = norm(without(g_t, scale(1.0 / speed, v))) if speed > 0.0 else 0.0
    turned = TURN * speed / across if across > STRAIGHT * (pull + resistance) else math.inf
    if speed <= CRAWL and turned < math.inf and not holds:
        v, speed, turned = ZERO, 0.0, math.inf
    direction = scale(1.0 / speed, v) if speed > 0.0 else scale(1.0 / pull, g_t)
    if turned < math.inf:
        ahead = add(v, scale(0.5 * turned * (1.0 - STICKS), add(g_t, scale(-resistance, direction))))
        direction = scale(1.0 / norm(ahead), ahead)
    a = scale(1.0 - STICKS, add(g_t, scale(-resistance, direction)))
    braking = -dot(a, v) / speed if speed > 0.0 else 0.0
    slow = (speed - lowest) / braking if braking > 0.0 else math.inf
    return Rolls(v, a, ZERO, min(slow, turned), True, False, turned < slow)
