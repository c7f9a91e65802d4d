"""Jacobi's theta functions as series of four terms, for the torque-free rotation of a rigid body (`rotation.py`).

The spin of the body and the phase of its precession are ratios and phases of theta functions. A theta function is a sum
of sines or cosines of multiples of its argument, weighted by powers of a small number q, the nome. The nome follows
from the parameter m (0 to 1) of the motion, which is the squared modulus of Jacobi's elliptic functions sn, cn and dn.
m is small if the spin stays near the third axis. m is 1 on the separatrix, where the motion never repeats.

Two series cover all m. For m <= 1/2, the series has circular functions and the nome of m. For m > 1/2, the series has
hyperbolic functions and the nome of m1 = 1 - m (Jacobi's imaginary transformation); for m = 1, this nome is 0. The nome
is therefore at most 0.0433, and four terms are exact to rounding. Source: DLMF 20.2, 20.7.
"""

import math
from typing import NamedTuple

from rpf3d_core.body.elliptic import complete, hyperbolic_pair
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import ZERO, Vec

Four = tuple[float, float, float, float]


class Nome(NamedTuple):
    """Powers of the nome q, a small number: the weights of the terms of the theta series of a free rotation.

    q = exp(-pi K(1 - m) / K(m)). K is the complete elliptic integral of the first kind, and m (0 to 1) its parameter,
    the squared modulus.

    odd : (q^2, q^6, q^12), for the theta functions 1 and 2; even : 2 (q, q^4, q^9), for the theta functions 3 and 4
    """

    odd: Vec
    even: Vec


class Waves(NamedTuple):
    """Sines and cosines, circular or hyperbolic, of the multiples of an argument.

    sines, cosines : of 1, 3, 5, 7 times the argument; even : cosines of 2, 4, 6 times the argument
    """

    sines: Four
    cosines: Four
    even: Vec


@kernel
def nome_of(m: float, m1: float) -> float:
    """Return the nome q of the parameter m, for 0 <= m <= 1/2; m1 : 1 - m."""
    k1 = math.sqrt(m1)
    root = 1.0 + math.sqrt(k1)
    a = 0.5 * m / ((1.0 + k1) * root * root)
    b = a * a * a * a
    return a * (1.0 + b * (2.0 + b * (15.0 + b * (150.0 + 1707.0 * b))))


@kernel
def powers_of(q: float) -> Nome:
    """Return the powers of a nome q that are the weights of theta series."""
    q2 = q * q
    q4 = q2 * q2
    return Nome(odd=(q2, q2 * q4, q4 * q4 * q4), even=(2.0 * q, 2.0 * q4, 2.0 * q * q4 * q4))


@kernel
def multiples(s: float, c: float, c2: float) -> Waves:
    """Return the waves of an argument from its sine s, its cosine c, and the cosine c2 of twice the argument.

    The functions are circular or hyperbolic; the formulas are the same for both.
    """
    d = 2.0 * c2
    s3, c3, c4 = d * s + s, d * c - c, d * c2 - 1.0
    s5, c5 = d * s3 - s, d * c3 - c
    return Waves(
        sines=(s, s3, s5, d * s5 - s3), cosines=(c, c3, c5, d * c5 - c3), even=(c2, c4, d * c4 - c2)
    )  # fmt: skip


@kernel
def circular(v: float) -> Waves:
    """Return sines and cosines of the multiples of an angle v (rad)."""
    s, c = math.sin(v), math.cos(v)
    return multiples(s, c, (c - s) * (c + s))


@kernel
def hyperbolic(x: float) -> Waves:
    """Return hyperbolic sines and cosines of the multiples of a number |x| <= 50."""
    s, c = hyperbolic_pair(x)
    return multiples(s, c, 1.0 + 2.0 * s * s)


@kernel
def alternating(f: Four, q: Vec) -> float:
    """Return f1 - q^2 f3 + q^6 f5 - q^12 f7, which is theta 1 without its factor 2 q^(1/4) if f are sines.

    f : (f1, f3, f5, f7), such as `Waves.sines`; q : (q^2, q^6, q^12), `Nome.odd`
    """
    return f[0] - (q[0] * f[1] - (q[1] * f[2] - q[2] * f[3]))


@kernel
def plain(f: Four, q: Vec) -> float:
    """Return f1 + q^2 f3 + q^6 f5 + q^12 f7, which is theta 2 without its factor 2 q^(1/4) if f are cosines.

    f : (f1, f3, f5, f7), such as `Waves.cosines`; q : (q^2, q^6, q^12), `Nome.odd`
    """
    return f[0] + (q[0] * f[1] + (q[1] * f[2] + q[2] * f[3]))


@kernel
def theta_3(even: Vec, q: Vec) -> float:
    """Return theta 3 of an argument; even : cosines of 2, 4 and 6 times the argument; q : `Nome.even`."""
    return 1.0 + (q[0] * even[0] + (q[1] * even[1] + q[2] * even[2]))


@kernel
def theta_4(even: Vec, q: Vec) -> float:
    """Return theta 4 of an argument; even : cosines of 2, 4 and 6 times the argument; q : `Nome.even`."""
    return 1.0 - (q[0] * even[0] - (q[1] * even[1] - q[2] * even[2]))


class Phase(NamedTuple):
    """The phase (angle in the complex plane) of theta 1 along a line of arguments, as weights of four waves.

    first, second : weights of the four waves in the real part and in the imaginary part of theta 1, up to a common
        positive factor, which does not change the phase
    rate : minus the rate of change of the phase per unit of the argument, at the argument for which cn is 0
    """

    first: Four
    second: Four
    rate: float


@kernel
def circular_phase(q: float, b: float) -> Phase:
    """Return the phase of theta_1(v + i b | q) along real v, for b >= 0; the weights are scaled by about exp(-b).

    `first` has the weights of sin(v), sin(3 v), ...; `second` has the weights of cos(v), cos(3 v), ...
    """
    s, c = hyperbolic_pair(min(b, 300.0))
    h = 1.0 / (s + c)
    beta, s0 = h * h, 2.0 * s * h
    a = q / beta
    q2 = q * q
    w1, w2, w3 = a * q, a * a * q2 * q2, a * a * a * q2 * q2 * q2 * q2 * q
    b2, b3 = beta * beta, beta * beta * beta
    c1, c2, c3 = w1 * (1.0 + b3), w2 * (1.0 + b2 * b3), w3 * (1.0 + b2 * b2 * b3)
    t3, t5 = 1.0 + (beta + b2), 1.0 + (beta + (b2 + (b3 + b2 * b2)))
    # the common factor s0 keeps all digits of the sums where b is small
    s1, s2, s3 = w1 * s0 * t3, w2 * s0 * t5, w3 * s0 * (t5 + b2 * b3 * (1.0 + beta))
    rate = (s0 + (3.0 * s1 + (5.0 * s2 + 7.0 * s3))) / ((1.0 + beta) + (c1 + (c2 + c3)))
    return Phase(first=(1.0 + beta, -c1, c2, -c3), second=(s0, -s1, s2, -s3), rate=rate)


@kernel
def hyperbolic_phase(q: float, y: float) -> Phase:
    """Return the phase of theta_1(y - i x | q) along real x, for 0 <= y <= pi / 2.

    `first` has the weights of cosh(x), cosh(3 x), ...; `second` has the weights of sinh(x), sinh(3 x), ...
    """
    w, powers = circular(y), powers_of(q)
    o, e, s, c = powers.odd, powers.even, w.sines, w.cosines
    s2 = 2.0 * s[0] * c[0]
    s4 = 2.0 * s2 * w.even[0]
    s6 = 2.0 * w.even[0] * s4 - s2
    rate = (2.0 * e[0] * s2 - (4.0 * e[1] * s4 - 6.0 * e[2] * s6)) / theta_4(w.even, e)
    return Phase(
        first=(s[0], -o[0] * s[1], o[1] * s[2], -o[2] * s[3]),
        second=(-c[0], o[0] * c[1], -o[1] * c[2], o[2] * c[3]),
        rate=rate,
    )


@kernel
def combined(f: Four, g: Four) -> float:
    """Return the sum of four waves g with weights f; the small terms are added first, to limit the rounding error."""
    return f[0] * g[0] + (f[1] * g[1] + (f[2] * g[2] + f[3] * g[3]))


STEADY, CIRCULAR, HYPERBOLIC = 0, 1, 2
"""Kinds of motion: constant spin; m <= 1/2, series of circular functions; m > 1/2, series of hyperbolic functions."""

ENDLESS = 1e300
"""Half period (in units of the argument) of a motion on the separatrix, which never repeats: stands for infinity."""


class Cycle(NamedTuple):
    """The torque-free motion of a body: its periodic spin, as theta series of an argument, and its precession.

    The argument of the series is `rate` t + `start` at time t (s).

    kind : STEADY, CIRCULAR or HYPERBOLIC; amplitudes : (3,) rad/s, of the spin's components
    nome : powers of the nome of the series; rate : 1/s; start : (-)
    half_period : half of the period of dn, in units of the argument; used for hyperbolic functions only
    precession : rad/s, mean rate; per_period : rad, additional angle of the precession in each period of dn
    phase, sense : the phase of theta 1 times `sense` (1 or -1) is also added to the precession
    """

    kind: int
    amplitudes: Vec
    nome: Nome
    rate: float
    start: float
    half_period: float
    phase: Phase
    sense: float
    precession: float
    per_period: float


@kernel
def still() -> Cycle:
    """Return the cycle of a motion with constant spin; its kind is STEADY, and its other numbers are not used."""
    none = 0.0, 0.0, 0.0, 0.0
    return Cycle(
        kind=STEADY, amplitudes=ZERO, nome=Nome(odd=ZERO, even=ZERO), rate=0.0, start=0.0, half_period=ENDLESS,
        phase=Phase(first=none, second=none, rate=0.0), sense=1.0, precession=0.0, per_period=0.0,
    )  # fmt: skip


@kernel
def circular_cycle(m: float, A: Vec, arguments: Vec, motion: Vec) -> Cycle:
    """Return the cycle of a motion with m <= 1/2.

    m : parameter of Jacobi's functions
    A : (3,) rad/s, amplitudes of the spin: its components are A1 cn(u), A2 sn(u), A3 dn(u)
    arguments : (u, eta, du/dt): argument u of Jacobi's functions at time 0, shift eta of the argument of theta 1 off
        the real axis, in the unit of u, and rate of u (1/s)
    motion : (sense, 2 T, L): `Cycle.sense`, twice the rotational energy, and the length of the angular momentum, both
        in the units of the moments of inertia
    """
    u, eta, rate = arguments
    sense, energy, L = motion
    q = nome_of(m, 1.0 - m)
    powers = powers_of(q)
    unit = 1.0, 1.0, 1.0
    t3, t4, odd = theta_3(unit, powers.even), theta_4(unit, powers.even), 1.0 + (powers.odd[0] + powers.odd[1])
    k = 1.0 / (t3 * t3)
    phase = circular_phase(q, k * eta)
    return Cycle(
        kind=CIRCULAR, amplitudes=(A[0] * (t4 / odd), A[1] * (t3 / odd), A[2] * (t4 / t3)), nome=powers,
        rate=k * rate, start=k * u, half_period=ENDLESS, phase=phase, sense=sense,
        precession=energy / L + sense * k * rate * phase.rate, per_period=0.0,
    )  # fmt: skip


@kernel
def hyperbolic_cycle(m1: float, A: Vec, arguments: Vec, motion: Vec) -> Cycle:
    """Return the cycle of a motion with m > 1/2; m1 : 1 - m, may be 0; other parameters as in `circular_cycle`."""
    u, eta, rate = arguments
    sense, energy, L = motion
    q = nome_of(m1, 1.0 - m1)
    powers = powers_of(q)
    unit = 1.0, 1.0, 1.0
    t3, t4, odd = theta_3(unit, powers.even), theta_4(unit, powers.even), 1.0 + (powers.odd[0] + powers.odd[1])
    k = 1.0 / (t3 * t3)
    phase = hyperbolic_phase(q, k * eta)
    return Cycle(
        kind=HYPERBOLIC, amplitudes=(A[0] * (odd / t4), A[1] * (t3 / t4), A[2] * (odd / t3)), nome=powers,
        rate=k * rate, start=k * u, half_period=k * complete(m1) if m1 > 0.0 else ENDLESS, phase=phase, sense=sense,
        precession=energy / L + sense * k * rate * phase.rate, per_period=2.0 * sense * k * eta,
    )  # fmt: skip
