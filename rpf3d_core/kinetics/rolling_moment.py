"""Friction and rolling moment of one impact of a solid sphere, solved as one problem.

Let u be the velocity of the centre along the ground, s = R w x n the surface velocity due to spin, c = u - s the slip
of the contact point and P the normal impulse. Per unit of mass, an impact gives
    a tangential impulse p, |p| <= mu P                     u' = u + p
    an angular impulse M = R n x m, |m| <= mu_r P           s' = s + 5/2 (m - p)
Friction opposes the remaining slip, p = -mu P c'/|c'|, or the contact sticks, c' = 0. The moment opposes the remaining
spin, m = -mu_r P s'/|s'|, or the spin is arrested, s' = 0. These are the conditions for the smallest kinetic energy
along the ground, T = 1/2 |u'|^2 + 1/5 |s'|^2, over all p and m within their limits, since dT/dp = c' and dT/dm = s'. T
is strictly convex, so the solution is unique, and an impact never raises T.

Let y - 1 >= 0 be the Lagrange multiplier of the limit |p| <= mu P, and q = 2/5 s, k = mu P, r = mu_r P. For a given y
the solution is
    arrested    p = -u / y                                  where |u + y q| <= y r
    rolling     p = -(c + 5/2 r e) / (5/2 + y), m = -r e    with e = (u + y q) / |u + y q|
The contact sticks if |p| <= k at y = 1. Otherwise the contact slips, and y solves |p| = k: |p| falls as y grows. An
arrested spin has y = |u| / k. For a rolling sphere, L = k (5/2 + y) solves |c + 5/2 r e(L)| = L, for which a bracket is
known.

Derived from rigid-body mechanics. The program PlatRock, with the solver Siconos, also combines a rolling moment with
Coulomb friction.
"""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, norm, scale, subtract

STICKS = 2.0 / 7.0
"""Impulse that stops the slip of a solid sphere, per unit of mass and slip (-): 1 / (1 + m R^2 / I), I = 2/5 m R^2."""
ROUNDS = 64
"""Largest number of steps to solve the equation for the length L at the top of this file; usually 12 suffice.

Every second step at least halves the interval that contains L.
"""
ROUNDING = 4e-16
"""Relative difference (-) between the two sides of the equation for L, below which the difference is rounding error."""


class Impulses(NamedTuple):
    """The impulses along the ground that the ground gives a sphere in an impact, per unit of mass.

    push : (3,) m/s, the friction impulse p
    moment : (3,) m/s, m = M x n / R, with M the angular impulse of the rolling resistance (symbols: top of this file)
    """

    push: Vec
    moment: Vec


@kernel
def impulses_of(u: Vec, s: Vec, friction: float, moment: float) -> Impulses:
    """Return the friction impulse and the rolling moment that the ground gives a sphere in an impact.

    Of all impulses within the limits `friction` and `moment`, these impulses dissipate the most energy.

    u, s : (3,) m/s along the ground, velocity of the centre and surface velocity due to spin
    friction, moment : mu P and mu_r P (m/s), the largest size of each impulse
    """
    q = scale(1.0 / 2.5, s)
    if friction == 0.0:
        return Impulses(ZERO, _within(scale(-1.0, q), moment))
    sticking = _sticking(u, s, q, moment)
    if norm(sticking.push) <= friction:
        return sticking
    speed = norm(u)
    if speed >= friction:
        push = scale(-friction / speed, u)
        arresting = subtract(push, q)
        if norm(arresting) <= moment:
            return Impulses(push, arresting)
    return _slipping(u, s, q, friction, moment)


@kernel
def _within(impulse: Vec, most: float) -> Vec:
    """Return an impulse (3,) m/s, shortened to the length `most` (m/s) if it is longer."""
    size = norm(impulse)
    return impulse if size <= most else scale(most / size, impulse)


@kernel
def _sticking(u: Vec, s: Vec, q: Vec, moment: float) -> Impulses:
    """Return the impulses of an impact that stops the slip of the contact point, as if friction had no limit (y = 1).

    u, s, moment : as in `impulses_of`; q : 2/5 s
    """
    both = add(u, q)
    size = norm(both)
    if size <= moment:
        return Impulses(scale(-1.0, u), scale(-1.0, both))
    against = scale(-moment / size, both)
    return Impulses(scale(-STICKS, add(subtract(u, s), scale(-2.5, against))), against)


@kernel
def _slipping(u: Vec, s: Vec, q: Vec, friction: float, moment: float) -> Impulses:
    """Return the impulses of an impact that stops neither the slip of the contact point nor the spin of the sphere.

    u, s, friction, moment : as in `impulses_of`; q : 2/5 s

    The impulses follow from the length L that solves |c + 5/2 r e(L)| = L (derivation at the top of this file), with c
    the slip before the impact. L is exact except for rounding.
    """
    c = subtract(u, s)
    low, high = max(3.5 * friction, norm(c) - 2.5 * moment), norm(c) + 2.5 * moment
    over, under = _excess(u, c, q, friction, moment, low), _excess(u, c, q, friction, moment, high)
    length, side = high, 0
    for _ in range(ROUNDS):
        if over - under <= 0.0:
            break
        length = (low * -under + high * over) / (over - under)
        excess = _excess(u, c, q, friction, moment, length)
        if abs(excess) <= ROUNDING * length:
            break
        if excess > 0.0:
            low, over = length, excess
            under = 0.5 * under if side == 1 else under
            side = 1
        else:
            high, under = length, excess
            over = 0.5 * over if side == -1 else over
            side = -1
    return _at_length(u, c, q, friction, moment, length)


@kernel
def _spin_left(u: Vec, q: Vec, friction: float, length: float) -> Vec:
    """Return k (u + y q), a vector (3,) m^2/s^2 in the direction of the surface velocity due to spin after an impact.

    friction : k; length : trial value of L = k (5/2 + y), as at the top of this file
    """
    return add(scale(friction, u), scale(length - 2.5 * friction, q))


@kernel
def _excess(u: Vec, c: Vec, q: Vec, friction: float, moment: float, length: float) -> float:
    """Return the left side minus the right side (m/s) of |c + 5/2 r e(L)| = L, for a trial value of the length L.

    The result is positive if the trial value is too small, and 0 for the solution. The derivation of the equation is at
    the top of this file. If the spin is arrested at the trial value, the left side is |u| L / (L - 5/2 k) instead, with
    k = `friction`.
    u, friction, moment : as in `impulses_of`; q : (3,) m/s, 2/5 of the surface velocity due to spin
    c : (3,) m/s, slip before the impact; length : trial value of L (m/s)
    """
    left, share = _spin_left(u, q, friction, length), length - 2.5 * friction
    size = norm(left)
    if size <= share * moment:
        return norm(u) * length / share - length
    return norm(add(c, scale(2.5 * moment / size, left))) - length


@kernel
def _at_length(u: Vec, c: Vec, q: Vec, friction: float, moment: float, length: float) -> Impulses:
    """Return the impulses of an impact with slip, from the length L (m/s) that `_slipping` has found.

    u, q, friction, moment : as in `_slipping`; c : slip before the impact (3,) m/s; length : L
    """
    left = _spin_left(u, q, friction, length)
    size = norm(left)
    against = scale(-moment / size, left) if size > 0.0 else ZERO
    drive = add(c, scale(-2.5, against))
    size = norm(drive)
    return Impulses(scale(-friction / size, drive) if size > 0.0 else ZERO, against)
