"""The inverse of the standard normal distribution, for random numbers: the same bits in both engines.

Wichura 1988, Algorithm AS 241, Applied Statistics 37(3):477-484, doi 10.2307/2347330: PPND16, relative error about
1e-16.
"""

import math

from rpf3d_core.jit.dispatch import kernel

Coefficients = tuple[float, float, float, float, float, float, float, float]

CENTRE = 0.425
"""Largest distance of p from 1/2 (-) for which the central approximation is used.

The approximations of the tails beyond it are functions of sqrt(-ln p), where p is the probability of the tail.
"""
FAR = 5.0
"""Value of sqrt(-ln p) beyond which the far tail begins (p < 1.4e-11)."""

A: Coefficients = (
    3.3871328727963666080, 1.3314166789178437745e2, 1.9715909503065514427e3, 1.3731693765509461125e4,
    4.5921953931549871457e4, 6.7265770927008700853e4, 3.3430575583588128105e4, 2.5090809287301226727e3,
)  # fmt: skip
B: Coefficients = (
    1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3,
    2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4, 5.2264952788528545610e3,
)  # fmt: skip
C: Coefficients = (
    1.42343711074968357734, 4.63033784615654529590, 5.76949722146069140550, 3.64784832476320460504,
    1.27045825245236838258, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4,
)  # fmt: skip
D: Coefficients = (
    1.0, 2.05319162663775882187, 1.67638483018380384940, 6.89767334985100004550e-1,
    1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4, 1.05075007164441684324e-9,
)  # fmt: skip
E: Coefficients = (
    6.65790464350110377720, 5.46378491116411436990, 1.78482653991729133580, 2.96560571828504891230e-1,
    2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7,
)  # fmt: skip
F: Coefficients = (
    1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
    7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15,
)  # fmt: skip


@kernel
def normal_quantile(p: float) -> float:
    """Return the value z (-) below which a standard normal number lies with the probability p, 0 < p < 1.

    With a uniform random number p, the result is a normal random number. For p <= 0 the result is -inf, for p >= 1 inf.
    """
    q = p - 0.5
    if abs(q) <= CENTRE:
        return q * _ratio(A, B, CENTRE * CENTRE - q * q)
    tail = p if q < 0.0 else 1.0 - p
    if tail <= 0.0:
        return -math.inf if q < 0.0 else math.inf
    r = math.sqrt(-math.log(tail))
    z = _ratio(C, D, r - 1.6) if r <= FAR else _ratio(E, F, r - FAR)
    return -z if q < 0.0 else z


@kernel
def _ratio(above: Coefficients, below: Coefficients, r: float) -> float:
    """Return the ratio of two polynomials of degree 7 at r (-), by Horner's rule.

    above, below : coefficients of the numerator and of the denominator, constant term first
    """
    p, q = above[7], below[7]
    for k in range(6, -1, -1):
        p, q = p * r + above[k], q * r + below[k]
    return p / q
