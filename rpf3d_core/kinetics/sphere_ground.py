"""A sphere on the ground: it skids until its slip is zero, then it rolls (the scene's `ground: sphere`).

With v_c the slip of the contact point, g_t gravity along the ground and N the push of the ground, both per mass:
    skidding    dv/dt = g_t - mu N v_c/|v_c|,   dv_c/dt = g_t - 7/2 mu N v_c/|v_c|
    rolling     dv/dt = 5/7 (g_t - mu_r N v/|v|), as long as 2/7 |g_t| <= mu N; otherwise it skids down
Rolling friction needs friction itself. If mu_r is larger than mu can bear, the centre moves like a block that slides
with mu, and is neither braked nor held by more; its spin is still reported as that of rolling.
Each segment has a constant acceleration, so it is exact where friction does not turn: straight down a slope, on level
ground, and wherever a sphere rolls without rolling friction. Elsewhere the friction is taken at the middle of the
segment, which ends before friction has turned by TURN.

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
"""Tangent of the largest angle by which friction may turn in one segment: 3.6 degrees."""
CRAWL = 1e-2
"""Speed (m/s) below which slip, or the motion of a sphere that friction does not hold, counts as zero while it turns.

Its energy is that of 5 um of height.
"""
STRAIGHT = 1e-9
"""Gravity across a motion, over gravity and friction along the ground (-), below which the motion does not turn."""
ROLLS = 1e-9
"""Slip over speed (-) below which a sphere rolls, and share of the stop speed that counts as rounding.

Both are a million times the rounding.
"""


class SphereGround(NamedTuple):
    """Skidding, then rolling, with the material's friction angle and, if it has one, its rolling friction."""

    @property
    def asks_rock(self) -> bool:
        """True: the rules need the radius."""
        return True


class RollingSegment(NamedTuple):
    """One segment of a sphere's path on the ground, under a constant acceleration a (3,) m/s^2.

    v : (3,) m/s at the start; turn : (3,) rad/s^2 while the sphere skids; t : s until the motion changes
    rolls : the sphere rolls at the end; stops : it has stopped there; turns : only its direction changes there
    """

    v: Vec
    a: Vec
    turn: Vec
    t: float
    rolls: bool
    stops: bool
    turns: bool


@kernel
def rolling_piece(v: Vec, slip: Vec, n: Vec, g_t: Vec, push: float, surface: Surface, radius: float) -> RollingSegment:
    """Return the next segment of a sphere with velocity v along ground that pushes the sphere along n.

    slip : (3,) m/s along the ground; g_t : (3,) m/s^2, gravity along the ground; push : m/s^2
    """
    speed, slips = norm(v), norm(slip)
    friction, pull = surface.mu * push, norm(g_t)
    if slips > ROLLS * speed + CREEP:
        return _skids(v, slip, n, g_t, friction, radius)
    if STICKS * pull > friction:
        a, turn = _skidding(scale(1.0 / pull, g_t), n, g_t, friction, radius)
        return RollingSegment(v=v, a=a, turn=turn, t=math.inf, rolls=False, stops=False, turns=False)
    return _rolls(v, g_t, min(surface.mu_r * push, _most_resistance(v, g_t, friction)), surface.stop_speed)


@kernel
def _most_resistance(v: Vec, g_t: Vec, friction: float) -> float:
    """Return the largest rolling resistance (m/s^2) that a ground of some friction (m/s^2) can give without slip.

    A resistance r takes a friction of 2/7 g_t + 5/7 r along the motion, or down the slope at rest. That is at most mu
    N; then 5/7 (g_t - r) = g_t - mu N, as for a block that slides.
    """
    speed = norm(v)
    pull = dot(g_t, v) / speed if speed > 0.0 else norm(g_t)
    return (friction - STICKS * pull) / (1.0 - STICKS)


@kernel
def _skidding(direction: Vec, n: Vec, g_t: Vec, friction: float, radius: float) -> tuple[Vec, Vec]:
    """Return the accelerations of centre (m/s^2) and spin (rad/s^2) of a sphere that slips in a direction (3,) unit."""
    turn = scale(2.5 * friction / radius, cross(n, direction))
    return add(g_t, scale(-friction, direction)), turn


@kernel
def _skids(v: Vec, slip: Vec, n: Vec, g_t: Vec, friction: float, radius: float) -> RollingSegment:
    """Return a segment of skidding, until the slip is zero or has turned."""
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
    return RollingSegment(
        v=v,
        a=a,
        turn=turn,
        t=min(gone, turned),
        rolls=gone <= turned and gone < math.inf,
        stops=False,
        turns=turned < gone,
    )


@kernel
def _rolls(v: Vec, g_t: Vec, resistance: float, stop_speed: float) -> RollingSegment:
    """Return a segment of rolling, until the sphere has slowed to its stop speed or to zero, or has turned."""
    speed, pull = norm(v), norm(g_t)
    holds = resistance >= HOLDS * pull
    lowest = max(stop_speed, CREEP) if holds else 0.0
    if holds and speed <= lowest * (1.0 + ROLLS):
        return RollingSegment(v=v, a=ZERO, turn=ZERO, t=0.0, rolls=True, stops=True, turns=False)
    if resistance == 0.0:
        return RollingSegment(
            v=v, a=scale(1.0 - STICKS, g_t), turn=ZERO, t=math.inf, rolls=True, stops=False, turns=False
        )
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
    return RollingSegment(v=v, a=a, turn=ZERO, t=min(slow, turned), rolls=True, stops=False, turns=turned < slow)
