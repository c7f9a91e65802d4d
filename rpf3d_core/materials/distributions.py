"""Distributions of the numbers that a scene may leave to chance, drawn by inverting them: one uniform number each.

No draw is rejected, so a number costs the same whatever its bounds, and is a function of one counter.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.materials.normal_quantile import normal_quantile

FIXED, UNIFORM, NORMAL, LOGNORMAL, POWER_LAW = range(5)
"""Kinds of distribution."""

RAREST = 2.0**-54
"""Stands for 0 where a uniform number is turned into one without bounds: half the smallest above it."""
FEW = 5_000
"""Numbers up to which plain Python draws them: it is done before the loop has been compiled, with the same bits."""


class Distribution(NamedTuple):
    """A truncated distribution, prepared so that drawing from it is short.

    kind : FIXED ... POWER_LAW; low, high : bounds, in the unit of what is drawn
    location, scale : the number (FIXED); low and high - low (UNIFORM); mean and standard deviation before truncation
        (NORMAL), of the logarithm (LOGNORMAL); 0 and -1/exponent (POWER_LAW)
    first, span : probability below `low` and between the bounds, before truncation; of a POWER_LAW 0 and the share
        1 - (low/high)^exponent of what lies above `low`
    """

    kind: int
    low: float
    high: float
    location: float
    scale: float
    first: float
    span: float


def fixed(value: float) -> Distribution:
    """Always the same number."""
    return Distribution(FIXED, value, value, value, 0.0, 0.0, 0.0)


def uniform_between(low: float, high: float) -> Distribution:
    """Every number between two bounds alike; low < high."""
    return Distribution(UNIFORM, low, high, low, high - low, 0.0, 1.0)


def truncated_normal(mean: float, sd: float, low: float, high: float) -> Distribution:
    """A normal distribution cut off at its bounds; mean and sd are those before the cut.

    low <= mean <= high, low < high, sd >= 0
    """
    if sd == 0.0:
        return fixed(mean)
    first, last = _normal((low - mean) / sd), _normal((high - mean) / sd)
    return Distribution(NORMAL, low, high, mean, sd, first, last - first)


def truncated_lognormal(mean: float, sd: float, low: float, high: float) -> Distribution:
    """A lognormal distribution cut off at its bounds; mean and sd are those of the number itself before the cut.

    0 <= low <= mean <= high, mean > 0, sd >= 0. The logarithm has variance ln(1 + sd^2/mean^2) and mean
    ln(mean) - variance/2.
    """
    if sd == 0.0:
        return fixed(mean)
    variance = math.log1p((sd / mean) ** 2)
    location, scale = math.log(mean) - 0.5 * variance, math.sqrt(variance)
    first = _normal((math.log(low) - location) / scale) if low > 0.0 else 0.0
    last = _normal((math.log(high) - location) / scale)
    return Distribution(LOGNORMAL, low, high, location, scale, first, last - first)


def truncated_power_law(exponent: float, low: float, high: float) -> Distribution:
    """N(> x) ~ x^-exponent between two bounds (physics reference 6.4); exponent > 0, 0 < low < high."""
    return Distribution(POWER_LAW, low, high, 0.0, -1.0 / exponent, 0.0, 1.0 - (low / high) ** exponent)


@kernel
def quantile(d: Distribution, u: float) -> float:
    """The number that a distribution stays below with probability u in [0, 1); within its bounds."""
    if d.kind == FIXED:
        return d.location
    if d.kind == UNIFORM:
        x = d.location + u * d.scale
    elif d.kind == POWER_LAW:
        x = d.low * (1.0 - u * d.span) ** d.scale
    else:
        x = d.location + d.scale * normal_quantile(d.first + u * d.span)
        if d.kind == LOGNORMAL:
            x = math.exp(x)
    return min(max(x, d.low), d.high)


@kernel
def standard_normal(u: float) -> float:
    """The standard normal number of a uniform one in [0, 1); finite, 8.3 standard deviations at most."""
    return normal_quantile(max(u, RAREST))


def quantiles(distribution: Distribution, u: NDArray[np.float64]) -> NDArray[np.float64]:
    """The numbers (N,), in the distribution's unit, for shares u (N,) in [0, 1): the same bits however many there are.

    NumPy's own logarithm would do for all at once, but its last bit depends on the machine and the length.
    """
    x = np.empty(len(u))
    if len(u) <= FEW:
        _quantile_all.py_func(distribution, u.tolist(), x)  # type: ignore[attr-defined]
    else:
        _quantile_all(distribution, u, x)
    return x


@loop
def _quantile_all(distribution: Distribution, u: NDArray[np.float64], x: NDArray[np.float64]) -> None:
    """Fill x (N,)."""
    for i in range(len(x)):
        x[i] = quantile(distribution, u[i])


def _normal(z: float) -> float:
    """The probability that a standard normal number stays below z."""
    return 0.5 * math.erfc(-z / math.sqrt(2.0))
