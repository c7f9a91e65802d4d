"""Elliptic integrals, Jacobi's elliptic functions and hyperbolic functions, for the torque-free rotation of a body.

All functions except `jacobi` use only +, -, *, / and roots in a fixed order, so both engines get the same bits.
The parameter m is the square of the modulus; m1 = 1 - m is a separate argument where m may be close to 1.
Sources: Carlson 1995 (Numer. Algorithms 10:13) for R_F; the arithmetic-geometric mean: DLMF 19.8 and 22.20.
"""

import math

from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.values import Vec

SPREAD = 6e-3
"""Relative distance of Carlson's arguments from their mean (-) below which the series of R_F is exact to rounding."""

EQUAL = 1e-9
"""Relative difference of two numbers (-), below which their means in the next step are equal to rounding.

In `jacobi`, half of the difference is compared with this value.
"""

MOST_MEANS = 12
"""Largest number of steps of the arithmetic-geometric mean; seven are enough down to m1 = 1e-32."""

MOST_HALVINGS = 40
"""Largest number of duplication steps for R_F; twenty are enough for arguments from 1e-300 to 1."""

TAYLOR = 0.5
"""Value of |x| below which sinh(x) is summed as a series, because the difference of two exponentials loses digits."""

LOG2_E = 1.4426950408889634
LN2_HIGH, LN2_LOW = 0.693147180369123816490, 1.90821492927058770002e-10
"""ln 2 in two parts; the first has so few digits that its product with a small integer is exact."""


@routine
def carlson(x: float, y: float, z: float) -> float:
    """Return Carlson's elliptic integral R_F(x, y, z) of arguments >= 0, at most one of them 0."""
    mean = (x + y + z) / 3.0
    for _ in range(MOST_HALVINGS):
        if max(abs(mean - x), abs(mean - y), abs(mean - z)) < SPREAD * mean:
            break
        a, b, c = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        shift = a * b + b * c + c * a
        x, y, z = 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)
        mean = (x + y + z) / 3.0
    a, b = (mean - x) / mean, (mean - y) / mean
    c = -a - b
    e2, e3 = a * b - c * c, a * b * c
    low = -e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 / 44.0 * e2 * e3
    high = -5.0 / 208.0 * e2 * e2 * e2 + 3.0 / 104.0 * e3 * e3 + e2 * e2 * e3 / 16.0
    return (1.0 + (low + high)) / math.sqrt(mean)


@kernel
def complete(m1: float) -> float:
    """Return the complete elliptic integral K(m) of the first kind, from m1 = 1 - m with 0 < m1 <= 1."""
    a, b = 1.0, math.sqrt(m1)
    for _ in range(MOST_MEANS):
        if abs(a - b) < EQUAL * a:
            break
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return math.pi / (a + b)


@kernel
def first_kind(s: float, c2: float, m: float, m1: float) -> float:
    """Return the elliptic integral F(phi | m) of the first kind, from s = sin(phi) and c2 = cos(phi)^2.

    |phi| <= pi / 2. The smaller of m and m1 = 1 - m must be exact to rounding; then the result is exact to rounding
    too. The arguments c2 = m1 = 0 are not allowed, because the integral is infinite.
    """
    d2 = c2 + m1 * s * s if m > 0.5 else 1.0 - m * s * s
    return s * carlson(c2, d2, 1.0)


@routine
def jacobi(u: float, m: float) -> Vec:
    """Return Jacobi's functions (sn, cn, dn)(u | m) for 0 <= m < 1, by descending Landen steps.

    Step n has the arithmetic mean a(n) and the difference c(n). The steps are not stored: a(n) = a(n + 1) + c(n + 1)
    and c(n) / 2 = sqrt(a(n + 1) c(n + 1)) lead back from the last step to the first step.
    """
    a, b, c, steps, scale = 1.0, math.sqrt(1.0 - m), math.sqrt(m), 0, 1.0
    while c > EQUAL * a and steps < MOST_MEANS:
        c = c * c / (2.0 * (a + b))
        a, b = 0.5 * (a + b), math.sqrt(a * b)
        steps, scale = steps + 1, 2.0 * scale
    angle = scale * a * u
    for _ in range(steps):
        angle = 0.5 * (angle + math.asin(min(1.0, c / a) * math.sin(angle)))
        a, c = a + c, 2.0 * math.sqrt(a * c)
    s, cosine = math.sin(angle), math.cos(angle)
    d2 = cosine * cosine + (1.0 - m) * s * s if m > 0.5 else 1.0 - m * s * s  # both exact to rounding
    return s, cosine, math.sqrt(d2)


@kernel
def hyperbolic_pair(x: float) -> tuple[float, float]:
    """Return (sinh(x), cosh(x)), each exact to a few units of its own last digit, for |x| <= 300."""
    if abs(x) < TAYLOR:
        z = x * x
        inner = 1.0 + z / 72.0 * (1.0 + z / 110.0 * (1.0 + z / 156.0 * (1.0 + z / 210.0)))
        s = x * (1.0 + z / 6.0 * (1.0 + z / 20.0 * (1.0 + z / 42.0 * inner)))
        return s, math.sqrt(1.0 + s * s)
    e = exponential(abs(x))
    s = 0.5 * (e - 1.0 / e)
    return s if x > 0.0 else -s, 0.5 * (e + 1.0 / e)


@kernel
def exponential(x: float) -> float:
    """Return e^x for 0 <= x <= 700, by a Taylor series between powers of 2."""
    n = math.floor(x * LOG2_E + 0.5)
    r = (x - n * LN2_HIGH) - n * LN2_LOW
    total = ((((1.0 / 6227020800.0) * r + 1.0 / 479001600.0) * r + 1.0 / 39916800.0) * r + 1.0 / 3628800.0) * r
    total = ((((total + 1.0 / 362880.0) * r + 1.0 / 40320.0) * r + 1.0 / 5040.0) * r + 1.0 / 720.0) * r
    total = ((((total + 1.0 / 120.0) * r + 1.0 / 24.0) * r + 1.0 / 6.0) * r + 0.5) * r
    total = (total + 1.0) * r + 1.0
    power, double = 1.0, 2.0
    while n > 0:
        if n & 1:
            power *= double
        double *= double
        n >>= 1
    return total * power
