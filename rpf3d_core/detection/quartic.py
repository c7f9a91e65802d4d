"""Find when a polynomial of degree four first falls through zero: when a sphere touches an edge or a corner.

The squared distance of a parabola from a line or a point is a quartic in time. The second derivative is a quadratic.
Between the roots of the second derivative the first derivative is monotone, and between the roots of the first
derivative the quartic is monotone. So every root has its own bracket, and the search misses no root. The search uses
only basic arithmetic and square roots, so the result is the same to the last bit on every machine.
"""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel

ROOT_STEPS = 120
"""Largest number of steps of the search for one root; about ten are usual, and bisection alone takes about 64."""


class Quartic(NamedTuple):
    """A polynomial of degree four in time, c0 + c1 t + c2 t^2 + c3 t^3 + c4 t^4, such as a squared distance."""

    c0: float
    c1: float
    c2: float
    c3: float
    c4: float


@kernel
def value_at(q: Quartic, t: float) -> float:
    """Return the value of a quartic polynomial at time t (s), in the unit of its coefficient c0."""
    return q.c0 + t * (q.c1 + t * (q.c2 + t * (q.c3 + t * q.c4)))


@kernel
def slope_of(q: Quartic) -> Quartic:
    """Return the derivative of a quartic polynomial, which shows where the polynomial falls."""
    return Quartic(c0=q.c1, c1=2.0 * q.c2, c2=3.0 * q.c3, c3=4.0 * q.c4, c4=0.0)


@kernel
def first_fall(q: Quartic, begin: float, end: float) -> float:
    """Return the first time in (begin, end] when a quartic polynomial falls from above zero to zero or below.

    The result is inf if there is none. If q is a squared distance minus a squared radius, the fall is a contact.

    begin, end : s, finite; if q is zero at `begin`, this is not a fall
    """
    slope = slope_of(q)
    one, other = _bends(slope_of(slope))
    low = begin
    for part in range(3):
        high = end if part == 2 else min(max(one if part == 0 else other, low), end)
        if not high > low:
            continue
        middle = high
        if (value_at(slope, low) < 0.0) != (value_at(slope, high) < 0.0):
            middle = _sign_change(slope, low, high)
        if value_at(q, low) > 0.0 and value_at(q, middle) <= 0.0:
            return _sign_change(q, low, middle)
        if value_at(q, middle) > 0.0 and value_at(q, high) <= 0.0:
            return _sign_change(q, middle, high)
        low = high
    return math.inf


@kernel
def _bends(q: Quartic) -> tuple[float, float]:
    """Return the two roots of a quadratic (c0, c1, c2 of q) in ascending order; inf for a missing root.

    The quadratic is the second derivative of a quartic: at its roots the first derivative turns.
    """
    a, b, c = q.c2, q.c1, q.c0
    discriminant = b * b - 4.0 * a * c
    if not discriminant > 0.0:
        return math.inf, math.inf
    half = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))
    one = half / a if a != 0.0 else math.inf
    other = c / half if half != 0.0 else math.inf
    return min(one, other), max(one, other)


@kernel
def _sign_change(q: Quartic, low: float, high: float) -> float:
    """Return the time between `low` and `high` when a polynomial changes its sign, by the Illinois method.

    q must have one sign at `low`, and the opposite sign or zero at `high`. The result is the upper end of the last
    bracket, so the sign has changed there.
    """
    q_low, q_high = value_at(q, low), value_at(q, high)
    positive, kept = q_low > 0.0 or (q_low == 0.0 and q_high < 0.0), 0
    for _ in range(ROOT_STEPS):
        spread = q_high - q_low
        t = high - q_high * (high - low) / spread if spread != 0.0 else low
        if not (low < t < high):
            t = 0.5 * (low + high)
        if not (low < t < high):
            break
        value = value_at(q, t)
        if (value > 0.0) == positive and value != 0.0:
            q_high = 0.5 * q_high if kept == 1 else q_high
            low, q_low, kept = t, value, 1
        else:
            q_low = 0.5 * q_low if kept == -1 else q_low
            high, q_high, kept = t, value, -1
        if value == 0.0:
            break
    return high
