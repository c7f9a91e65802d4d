"""Ground model of a sphere: it skids until its slip is zero, then it rolls (the scene's `ground: sphere`).

Let v be the velocity of the centre, v_c the slip of the contact point, g_t the gravity along the ground, N the push of
the ground per mass, mu the friction and mu_r the rolling friction of the material:
    skidding    dv/dt = g_t - mu N v_c/|v_c|,   dv_c/dt = g_t - 7/2 mu N v_c/|v_c|
    rolling     dv/dt = 5/7 (g_t - mu_r N v/|v|), as long as 2/7 |g_t| <= mu N; otherwise the sphere skids down
Rolling resistance acts through friction, so mu limits the resistance. If mu_r gives more than this limit, the centre
moves like a rock that slides with mu, without further resistance; the reported spin is still the spin of a rolling
sphere. The acceleration of a segment is constant. This is exact if the direction of friction is constant: straight down
a slope, on level ground, and for a sphere that rolls without rolling friction. Otherwise the acceleration follows from
the friction at the middle of the segment, and the segment ends before gravity could turn the slip, or the velocity of a
rolling sphere, by TURN (3.6 degrees). Every segment also ends when the velocity has turned by TURN, because barriers,
trees and gaps are searched for on the chord of the segment. The exception is a sphere so slow that it could stop within
BACK times its radius: its velocity may turn by any angle.

Derived from rigid-body mechanics (docs/explanation/physics.md, "The rigid sphere").
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
"""Tangent of the largest angle by which friction, or the velocity, may turn in one segment: 3.6 degrees."""
BACK = 1e-3
"""Distance, divided by the radius (-), within which a sphere may slow down and turn back in one segment."""
CRAWL = 1e-2
"""Speed (m/s) below which a slip that changes its direction counts as zero.

The velocity of a rolling sphere that changes its direction also counts as zero below this speed, if friction cannot
hold the sphere. The kinetic energy at this speed corresponds to a height of 5 um.
"""
STRAIGHT = 1e-9
"""Ratio (-) below which a motion counts as straight: acceleration across the motion, over all accelerations together.

The accelerations are components along the ground, by gravity and by friction.
"""
ROLLS = 1e-9
"""Ratio (-) of slip to speed below which a sphere counts as rolling.

A speed that exceeds the stop speed by this ratio or less also counts as the stop speed. Both limits are far above the
rounding error.
"""


class SphereGround(NamedTuple):
    """The ground model of a sphere, with the material's friction angle and, if it has one, its rolling friction."""

    @property
    def asks_rock(self) -> bool:
        """True: the rules for the sphere need the radius of the rock."""
        return True


class RollingSegment(NamedTuple):
    """One ground segment of a sphere, under a constant acceleration a (3,) m/s^2.

    v : (3,) m/s, velocity at the start; zero for a rolling sphere that turns slower than CRAWL and cannot be held
    turn : (3,) rad/s^2, angular acceleration; zero if the sphere rolls, because the spin then follows from the velocity
    t : duration until the motion changes (s); inf if it does not change
    rolls : True if the sphere rolls at the end; stops : True if the sphere has stopped for good
    turns : True if the segment ends only because the direction of the motion has turned, or the speed has become zero
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
    """Return the next ground segment of a sphere, which skids or rolls; n : (3,) normal of the ground.

    v, slip : (3,) m/s along the ground; g_t : (3,) m/s^2, gravity along the ground
    push : normal force of the ground on the sphere, per mass (m/s^2)
    surface : surface properties of the ground; radius : of the sphere, m
    """
    speed, slips = norm(v), norm(slip)
    friction, pull = surface.mu * push, norm(g_t)
    if slips > ROLLS * speed + CREEP:
        return _skids(v, slip, n, g_t, friction, radius)
    if STICKS * pull > friction:
        a, turn = _skidding(scale(1.0 / pull, g_t), n, g_t, friction, radius)
        t = _turning_time(v, a, radius)
        return RollingSegment(v=v, a=a, turn=turn, t=t, rolls=False, stops=False, turns=t < math.inf)
    holds = min(surface.mu_r * push, friction) >= HOLDS * pull
    return _rolls(v, g_t, surface.mu_r * push, friction, max(surface.stop_speed, CREEP) if holds else 0.0, radius)


@kernel
def _turning_time(v: Vec, a: Vec, radius: float) -> float:
    """Return the time (s) until a velocity v (m/s), at constant acceleration a (m/s^2), is zero or has turned too far.

    Too far is 3.6 degrees, the angle whose tangent is TURN. The result is inf if the velocity never turns so far and
    never becomes zero. The result is also inf for a sphere so slow that the acceleration could stop it within BACK
    (0.001) times its radius (m): the velocity of such a sphere may turn by any angle in one segment.
    """
    speed, pull = norm(v), norm(a)
    if speed * speed <= 2.0 * BACK * radius * pull:
        return math.inf
    along = dot(a, v) / speed
    across = norm(without(a, scale(1.0 / speed, v)))
    if across <= STRAIGHT * pull:
        return -speed / along if along < 0.0 else math.inf
    rate = across - TURN * along  # m/s^2; tan(angle) = across * t / (speed + along * t)
    return TURN * speed / rate if rate > 0.0 else math.inf


@kernel
def _most_resistance(v: Vec, g_t: Vec, friction: float) -> float:
    """Return the largest rolling resistance (m/s^2) that a sphere can have without slip, for a given friction (m/s^2).

    A resistance r needs a friction of 2/7 g_t + 5/7 r, where g_t is the gravity along the motion (at rest: down the
    slope). Friction is at most mu N. At this limit 5/7 (g_t - r) = g_t - mu N, as for a rock that slides.

    v : (3,) m/s, velocity of the centre; g_t : (3,) m/s^2, gravity along the ground
    """
    speed = norm(v)
    pull = dot(g_t, v) / speed if speed > 0.0 else norm(g_t)
    return (friction - STICKS * pull) / (1.0 - STICKS)


@kernel
def _skidding(direction: Vec, n: Vec, g_t: Vec, friction: float, radius: float) -> tuple[Vec, Vec]:
    """Return the accelerations of a skidding sphere: of the centre (m/s^2) and of the spin (rad/s^2).

    direction : (3,) unit vector of the slip; friction : mu N (m/s^2)
    n : (3,) normal of the ground; g_t : (3,) m/s^2, gravity along the ground; radius : of the sphere, m
    """
    turn = scale(2.5 * friction / radius, cross(n, direction))
    return add(g_t, scale(-friction, direction)), turn


@kernel
def _skids(v: Vec, slip: Vec, n: Vec, g_t: Vec, friction: float, radius: float) -> RollingSegment:
    """Return the segment on which a sphere skids, until its slip is zero, or its slip or velocity has turned too far.

    The segment ends when the velocity has turned by TURN (3.6 degrees) or has become zero. If gravity turns the slip,
    the segment also ends after the time in which gravity would turn a slip of constant size by TURN. Friction turns the
    slip back within the time in which friction alone would stop the slip. A segment is not longer than this time:
    otherwise friction at the middle of the segment would push the sphere to the wrong side.

    friction : deceleration by friction, mu N (m/s^2)
    v, slip, n, g_t, radius : as in `rolling_piece`
    """
    slips = norm(slip)
    direction = scale(1.0 / slips, slip)
    across = norm(without(g_t, direction))
    braking = 3.5 * friction - dot(g_t, direction)
    gone = slips / braking if braking > 0.0 else math.inf
    turned = math.inf
    if across > STRAIGHT * (norm(g_t) + friction):
        turned = slips / max(across / TURN, 3.5 * friction)
    if turned < gone:
        ahead = add(slip, scale(0.5 * turned, add(g_t, scale(-3.5 * friction, direction))))
        direction = scale(1.0 / norm(ahead), ahead)
    a, turn = _skidding(direction, n, g_t, friction, radius)
    turned = min(turned, _turning_time(v, a, radius))
    return RollingSegment(
        v=v,
        a=a,
        turn=turn,
        t=min(gone, turned),
        rolls=gone <= turned and gone < math.inf and STICKS * norm(g_t) <= friction,
        stops=False,
        turns=turned < gone,
    )


@kernel
def _rolling(v: Vec, g_t: Vec, resistance: float, direction: Vec, lowest: float) -> tuple[Vec, float]:
    """Return the acceleration (3,) m/s^2 of a rolling sphere, and the time (s) until its speed is `lowest`.

    The time is inf if the sphere does not brake.

    direction : (3,) unit vector against which the rolling resistance (m/s^2) acts; lowest : m/s
    v : (3,) m/s, velocity of the centre; g_t : (3,) m/s^2, gravity along the ground
    """
    a, speed = scale(1.0 - STICKS, add(g_t, scale(-resistance, direction))), norm(v)
    braking = -dot(a, v) / speed if speed > 0.0 else 0.0
    return a, (speed - lowest) / braking if braking > 0.0 else math.inf


@kernel
def _rolls(v: Vec, g_t: Vec, rolling: float, friction: float, lowest: float, radius: float) -> RollingSegment:
    """Return the segment on which a sphere rolls, until it has slowed down or its velocity has turned by TURN.

    TURN is 3.6 degrees. Where gravity turns the velocity, the resistance turns the velocity back within the time in
    which the resistance alone would stop the sphere. A segment is not longer than this time: otherwise the resistance
    at the middle of the segment would push the sphere to the wrong side. A sphere slower than CRAWL that turns, and
    that the ground cannot hold, starts the segment at rest.

    rolling : rolling resistance without the limit by friction, mu_r N (m/s^2)
    friction : largest deceleration by friction, mu N (m/s^2)
    lowest : speed (m/s) at which the sphere stops for good; 0 if the ground cannot hold the sphere at rest
    v, g_t, radius : as in `rolling_piece`
    """
    speed, pull, holds = norm(v), norm(g_t), lowest > 0.0
    resistance = min(rolling, _most_resistance(v, g_t, friction))
    if holds and speed <= lowest * (1.0 + ROLLS):
        return RollingSegment(v=v, a=ZERO, turn=ZERO, t=0.0, rolls=True, stops=True, turns=False)
    if resistance == 0.0:
        a = scale(1.0 - STICKS, g_t)
        t = _turning_time(v, a, radius)
        return RollingSegment(v=v, a=a, turn=ZERO, t=t, rolls=True, stops=False, turns=t < math.inf)
    across = norm(without(g_t, scale(1.0 / speed, v))) if speed > 0.0 else 0.0
    turned = math.inf
    if across > STRAIGHT * (pull + resistance):
        turned = min(TURN * speed / across, speed / ((1.0 - STICKS) * resistance))
    if speed <= CRAWL and turned < math.inf and not holds:
        v, speed, turned = ZERO, 0.0, math.inf
        resistance = min(rolling, _most_resistance(ZERO, g_t, friction))  # less than for a sphere that moves uphill
    direction = scale(1.0 / speed, v) if speed > 0.0 else scale(1.0 / pull, g_t)
    a, slow = _rolling(v, g_t, resistance, direction, lowest)
    if turned < slow:
        ahead = add(v, scale(0.5 * turned, a))
        a, slow = _rolling(v, g_t, resistance, scale(1.0 / norm(ahead), ahead), lowest)
    turned = min(turned, _turning_time(v, a, radius))
    return RollingSegment(v=v, a=a, turn=ZERO, t=min(slow, turned), rolls=True, stops=False, turns=turned < slow)
