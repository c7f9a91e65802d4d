"""Torque-free rotation of a rigid body in closed form: the orientation and the spin after any time, without a step.

The spin follows Jacobi's elliptic functions sn, cn and dn. The orientation consists of a nutation, which the spin
determines, and a precession about the angular momentum L. The angle of the precession is the sum of a constant rate
times the time and the phase of a theta function (van Zon & Schofield 2007, JCP 225:145). The phase is used as a complex
number, so that no angle has to be unwrapped.

The axes of the body are relabelled, so that one set of formulas serves all motions: at time 0 the first component of
the spin is A1 cn >= 0, the second A2 sn, and the third A3 dn > 0, with constant amplitudes A1, A2 and A3. The third
component never changes its sign.
"""

import math
from typing import NamedTuple

from rpf3d_core.body.elliptic import first_kind
from rpf3d_core.body.quaternions import NO_TURN, Quaternion, inverse, multiply, normalised, turn_by
from rpf3d_core.body.theta import (
    CIRCULAR,
    STEADY,
    Cycle,
    alternating,
    circular,
    circular_cycle,
    combined,
    hyperbolic,
    hyperbolic_cycle,
    plain,
    still,
    theta_3,
    theta_4,
)
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.values import Vec

SLOWEST = 1e-60
"""Spin (rad/s) below which a body counts as not turning, because squares of a smaller spin would underflow."""

LEAST_CHANGE = 1e-120
"""Rate of change of the spin, as a share (-) of the square of the spin, below which the spin counts as constant."""

CANCELLED = 0.02
"""Difference of two terms, as a share (-) of their sum, below which the difference needs twice the digits."""

FARTHEST = 40.0
"""Argument (-) of hyperbolic functions beyond which the spin has reached the middle axis to rounding."""

HALF_TURN_ABOUT_1: Quaternion = (0.0, 1.0, 0.0, 0.0)
HALF_TURN_ABOUT_2: Quaternion = (0.0, 0.0, 1.0, 0.0)
HALF_TURN_ABOUT_3: Quaternion = (0.0, 0.0, 0.0, 1.0)
ROOT = math.sqrt(0.5)
SWAP_1_AND_3: Quaternion = (0.0, ROOT, 0.0, ROOT)
"""The turn (x, y, z) -> (z, -y, x), which makes the axis of the least moment the third axis."""

SPLITTER = 134217729.0
"""2^27 + 1, which splits a number into two halves of its digits (Veltkamp)."""


class Axes(NamedTuple):
    """The relabelled axes of a body: its principal axes in another order and direction.

    The spin circles about the third axis, and the spin's component along this axis is above 0.

    moments : principal moments of the relabelled axes
    low : true if the third axis is the axis of the least moment, false if it is the axis of the largest moment
    signs : signs of the spin's components about the first and the third axis at time 0, before the relabelling
    turn : quaternion that turns vectors from the body's own axes to the relabelled axes
    """

    moments: Vec
    low: bool
    signs: tuple[float, float]
    turn: Quaternion


class Turning(NamedTuple):
    """The constants of one torque-free motion of a body.

    moments : principal moments, ascending, in m2 (per unit of mass) or kg m2
    q, w : orientation and spin (rad/s, in body axes) at time 0; L : length of the angular momentum, in the unit of the
        moments times rad/s
    fastest : rad/s, a spin that the motion never exceeds
    axes, cycle : the relabelled axes and the cycle of the spin
    start : constant quaternion; the orientation at a later time is `start` times the turn of that time (`placed`) times
        `axes.turn`
    """

    moments: Vec
    q: Quaternion
    w: Vec
    L: float
    fastest: float
    axes: Axes
    cycle: Cycle
    start: Quaternion


@routine
def turning_of(moments: Vec, q: Quaternion, w: Vec) -> Turning:
    """Return the torque-free motion of a body with spin w (rad/s, in body axes) and unit quaternion q at time 0.

    The principal moments ascend, in m2 or kg m2.
    """
    energy = moments[0] * w[0] * w[0] + moments[1] * w[1] * w[1] + moments[2] * w[2] * w[2]
    M = moments[0] * w[0], moments[1] * w[1], moments[2] * w[2]
    L = math.sqrt(M[0] * M[0] + M[1] * M[1] + M[2] * M[2])
    fastest = math.sqrt(energy / moments[0])
    excess = beyond_separatrix(moments, w)
    axes = axes_of(moments, w, excess < 0.0)
    cycle = still() if is_steady(moments, w) else cycle_of(axes, relabelled(axes, w), abs(excess), energy, L)
    start = q
    if cycle.kind != STEADY:
        start = multiply(q, inverse(multiply(placed(axes, cycle, L, 0.0)[0], axes.turn)))
    return Turning(moments=moments, q=q, w=w, L=L, fastest=fastest, axes=axes, cycle=cycle, start=start)


@routine
def turned_for(turning: Turning, t: float) -> tuple[Quaternion, Vec]:
    """Return the orientation (unit quaternion) and the spin (rad/s, in body axes) of a body after t seconds, t >= 0.

    Source: van Zon & Schofield 2007, JCP 225:145.
    """
    q, w = turning.q, turning.w
    if t == 0.0:
        return q, w
    if turning.cycle.kind == STEADY:
        return normalised(multiply(q, turn_by((w[0] * t, w[1] * t, w[2] * t)))), w
    axes = turning.axes
    turn, spin = placed(axes, turning.cycle, turning.L, t)
    return normalised(multiply(turning.start, multiply(turn, axes.turn))), labelled_back(axes, spin)


@kernel
def spin_bound(turning: Turning) -> float:
    """Return an upper bound of the spin (rad/s) at any time of the motion: sqrt(2 T / I1).

    T : rotational energy; I1 : least principal moment
    """
    return turning.fastest


@kernel
def is_steady(moments: Vec, w: Vec) -> bool:
    """Return True if the spin is constant, because it is negligible or, to rounding, parallel to the angular momentum.

    moments : (3,) principal moments of inertia, in ascending order; w : (3,) rad/s, spin
    """
    top = max(abs(w[0]), abs(w[1]), abs(w[2]))
    change = (
        abs((moments[2] - moments[1]) * w[1] * w[2])
        + abs((moments[2] - moments[0]) * w[2] * w[0])
        + abs((moments[1] - moments[0]) * w[0] * w[1])
    )
    return top < SLOWEST or change <= LEAST_CHANGE * moments[2] * top * top


@kernel
def beyond_separatrix(moments: Vec, w: Vec) -> float:
    """Return L^2 - 2 T I2 of a rotating body, without cancellation error.

    The result is positive if the spin circles the axis of the largest moment of inertia, negative for the smallest,
    and 0 on the boundary between the two (separatrix). L : angular momentum; T : rotational energy; I2 : middle moment.
    Unit: moments squared times (rad/s)^2.
    moments : (3,) principal moments of inertia, in ascending order; w : (3,) rad/s, spin
    """
    a, c = moments[2] - moments[1], moments[1] - moments[0]
    x, y = moments[2] * a * w[2] * w[2], moments[0] * c * w[0] * w[0]
    if abs(x - y) > CANCELLED * (x + y):
        return x - y
    x, x_rest = term_of(moments[2], difference(moments[2], moments[1]), w[2])
    y, y_rest = term_of(moments[0], difference(moments[1], moments[0]), w[0])
    return (x - y) + (x_rest - y_rest)


@kernel
def difference(a: float, b: float) -> tuple[float, float]:
    """Return a - b exactly: the rounded difference and its rounding error (Knuth)."""
    s = a - b
    z = s - a
    return s, (a - (s - z)) - (b + z)


@kernel
def product(a: float, b: float) -> tuple[float, float]:
    """Return a b exactly: the rounded product and its rounding error (Dekker)."""
    p = a * b
    k, j = SPLITTER * a, SPLITTER * b
    a1, b1 = k - (k - a), j - (j - b)
    a2, b2 = a - a1, b - b1
    return p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2


@kernel
def term_of(moment: float, gap: tuple[float, float], w: float) -> tuple[float, float]:
    """Return the product of moment, gap and w^2 with twice the digits: the rounded value and a correction.

    moment : a principal moment; gap : a difference of moments, as its rounded value and a correction
    w : component of the spin (rad/s)
    """
    s, s_rest = product(w, w)
    p, p_rest = product(moment, s)
    r, r_rest = product(gap[0], p)
    return r, r_rest + (gap[1] * p + gap[0] * (p_rest + moment * s_rest))


@kernel
def axes_of(moments: Vec, w: Vec, low: bool) -> Axes:
    """Return the relabelled axes of a body with spin w (rad/s); low : true if `beyond_separatrix` is below 0.

    moments : (3,) principal moments of inertia, in ascending order
    """
    first, third = (w[2], w[0]) if low else (w[0], w[2])
    signs = (1.0 if first >= 0.0 else -1.0), (1.0 if third >= 0.0 else -1.0)
    turn = NO_TURN
    if signs[0] < 0.0:
        turn = HALF_TURN_ABOUT_2 if signs[1] < 0.0 else HALF_TURN_ABOUT_3
    elif signs[1] < 0.0:
        turn = HALF_TURN_ABOUT_1
    if low:
        return Axes(
            moments=(moments[2], moments[1], moments[0]), low=low, signs=signs, turn=multiply(turn, SWAP_1_AND_3)
        )
    return Axes(moments=moments, low=low, signs=signs, turn=turn)


@kernel
def relabelled(axes: Axes, w: Vec) -> Vec:
    """Return the components of a spin along the relabelled axes; w : (3,) along the body's own axes."""
    f, g = axes.signs
    if axes.low:
        return f * w[2], -f * g * w[1], g * w[0]
    return f * w[0], f * g * w[1], g * w[2]


@kernel
def labelled_back(axes: Axes, w: Vec) -> Vec:
    """Return the components of a spin along the body's own axes; w : (3,) along the relabelled axes."""
    f, g = axes.signs
    if axes.low:
        return g * w[2], -f * g * w[1], f * w[0]
    return f * w[0], f * g * w[1], g * w[2]


@routine
def cycle_of(axes: Axes, w: Vec, excess: float, energy: float, L: float) -> Cycle:
    """Return the cycle of a torque-free motion: its spin as theta series, and its precession.

    w : (3,) rad/s, spin at time 0 along the relabelled axes `axes`; excess : |L^2 - 2 T I2| (`beyond_separatrix`)
    energy : 2 T, twice the rotational energy; L : length of the angular momentum

    All sums have terms >= 0, so that no digits are lost for nearly equal moments; m1 is as exact as `excess`.
    """
    J = axes.moments
    gap1, gap3, span = abs(J[1] - J[0]), abs(J[2] - J[1]), abs(J[2] - J[0])
    x, y = J[0] * span * w[0] * w[0], J[1] * gap3 * w[1] * w[1]
    p, r = x + y, J[1] * gap1 * w[1] * w[1] + J[2] * span * w[2] * w[2]
    m, m1 = p * gap1 / (r * gap3), span * excess / (r * gap3)
    sense = -1.0 if axes.low else 1.0
    A = math.sqrt(p / (J[0] * span)), sense * math.sqrt(p / (J[1] * gap3)), math.sqrt(r / (J[2] * span))
    u = first_kind(w[1] / A[1], x / p, m, m1)
    slant, rise = J[0] * p / (J[0] * p + J[2] * r), J[2] * r / (J[0] * p + J[2] * r)
    eta = first_kind(math.sqrt(rise), slant, m1, m)
    rate = math.sqrt(r * gap3 / (J[0] * J[1] * J[2]))
    if m > 0.5:
        return hyperbolic_cycle(m1, A, (u, eta, rate), (sense, energy, L))
    return circular_cycle(m, A, (u, eta, rate), (sense, energy, L))


@kernel
def placed(axes: Axes, cycle: Cycle, L: float, t: float) -> tuple[Quaternion, Vec]:
    """Return, for time t (s), the turn from the relabelled axes to axes fixed in space, and the spin of the body.

    The third of the axes in space is along the angular momentum. The spin (rad/s) is along the relabelled axes.

    L : length of the angular momentum
    """
    x, half_angle, sign, A = cycle.rate * t + cycle.start, 0.5 * cycle.precession * t, 1.0, cycle.amplitudes
    f, q = cycle.phase, cycle.nome
    if cycle.kind == CIRCULAR:
        waves = circular(x)
        real, imaginary = combined(f.first, waves.sines), combined(f.second, waves.cosines)
        k = 1.0 / theta_4(waves.even, q.even)
        c = plain(waves.cosines, q.odd)
    else:
        n = math.floor(0.5 * (x / cycle.half_period + 1.0))
        half_angle += 0.5 * n * cycle.per_period
        sign = -1.0 if n % 2 else 1.0
        waves = hyperbolic(max(-FARTHEST, min(FARTHEST, x - 2.0 * n * cycle.half_period)))
        real, imaginary = sign * combined(f.first, waves.cosines), sign * combined(f.second, waves.sines)
        k = 1.0 / plain(waves.cosines, q.odd)
        c = theta_4(waves.even, q.even)
    s = alternating(waves.sines, q.odd)
    w = sign * A[0] * c * k, sign * A[1] * s * k, A[2] * theta_3(waves.even, q.even) * k
    precession = advanced(half_angle, half_of(real, cycle.sense * imaginary))
    return multiply((precession[0], 0.0, 0.0, precession[1]), nutation(axes.moments, w, L)), w


@kernel
def half_of(x: float, y: float) -> tuple[float, float]:
    """Return cosine and sine of half the angle from the x axis to the vector (x, y), which must not be (0, 0).

    For x < 0 and y < 0, both numbers have the opposite sign: they belong to the half angle plus half a turn. As parts
    of a quaternion, both pairs of numbers describe the same turn.
    """
    length = math.sqrt(x * x + y * y)
    k = math.sqrt(0.5 * (1.0 + abs(x) / length))
    j = 0.5 * y / (length * k)
    return (k, j) if x >= 0.0 else (j, k)


@kernel
def advanced(angle: float, a: tuple[float, float]) -> tuple[float, float]:
    """Return (cos, sin) of the sum of an angle (rad) and the angle of the unit vector a (2,)."""
    c, s = math.cos(angle), math.sin(angle)
    return c * a[0] - s * a[1], s * a[0] + c * a[1]


@kernel
def nutation(moments: Vec, w: Vec, L: float) -> Quaternion:
    """Return the quaternion that turns the angular momentum onto the third axis.

    The turn consists of a turn about the first axis, and then a turn about the second axis.

    moments, w : principal moments and spin (rad/s) along the relabelled axes
    L : length of the angular momentum
    """
    M1, M2, M3 = moments[0] * w[0], moments[1] * w[1], moments[2] * w[2]
    a = half_of(M3, M2)
    b = half_of(math.sqrt(M2 * M2 + M3 * M3), -M1)
    return b[0] * a[0], b[0] * a[1], b[1] * a[0], -b[1] * a[1]
