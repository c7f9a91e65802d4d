"""Distributions of the random numbers of a scene, such as rock sizes; each number comes from one uniform number.

Numbers are drawn by inversion of the distribution, and no draw is rejected. So each number takes the same time, for any
bounds, and depends only on one uniform number.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.materials.normal_quantile import normal_quantile

FIXED, UNIFORM, NORMAL, LOGNORMAL, POWER_LAW, WEIBULL, TRIANGULAR = range(7)
"""The kinds of distributions (`Distribution.kind`), as numbers that compiled code can compare."""

RAREST = 2.0**-54
"""Replacement of the uniform number 0 where 0 would give an infinite result.

The value is half of 2^-53, which is the smallest uniform number above 0.
"""
COMMONEST = 1.0 - 2.0**-53
"""Largest float (-) below 1, and so the largest probability for which a Weibull number is finite."""
LARGEST_EXPONENT = 700.0
"""Largest value of ln((x / scale)^shape) for which a Weibull probability is computed.

A larger value would overflow; the probability is then 1 to rounding.
"""
FEW = 5_000
"""Largest number of draws for which plain Python is used, because it takes less time than compiling the loop.

The results are the same to the last bit.
"""


class Distribution(NamedTuple):
    """A truncated distribution, with values computed in advance so that a draw is fast.

    kind : number from FIXED (0) to TRIANGULAR (6); low, high : bounds, in the unit of the drawn number
    location, scale : FIXED: the number, 0; UNIFORM: low, high - low; NORMAL: mean, standard deviation before
        truncation; LOGNORMAL: mean, standard deviation of the logarithm before truncation; POWER_LAW: 0, -1/exponent;
        WEIBULL: 1/shape, scale; TRIANGULAR: mode, high - low
    first, span : probability below `low` and probability between the bounds, both before truncation; for POWER_LAW: 0,
        1 - (low/high)^exponent; for TRIANGULAR: 0, probability below the mode; for FIXED: 0, 0
    """

    kind: int
    low: float
    high: float
    location: float
    scale: float
    first: float
    span: float


def fixed(value: float) -> Distribution:
    """Return the distribution of a quantity that is not random: every draw is the same number."""
    return Distribution(kind=FIXED, low=value, high=value, location=value, scale=0.0, first=0.0, span=0.0)


def uniform_between(low: float, high: float) -> Distribution:
    """Return the uniform distribution between two bounds, low < high."""
    return Distribution(kind=UNIFORM, low=low, high=high, location=low, scale=high - low, first=0.0, span=1.0)


def truncated_normal(mean: float, sd: float, low: float, high: float) -> Distribution:
    """Return the normal distribution with a mean and a standard deviation sd, truncated to two bounds.

    Mean and sd are those before truncation; low <= mean <= high, low < high, sd >= 0.
    If sd is 0, every draw is the mean.
    """
    if sd == 0.0:
        return fixed(mean)
    first, last = _normal((low - mean) / sd), _normal((high - mean) / sd)
    return Distribution(kind=NORMAL, low=low, high=high, location=mean, scale=sd, first=first, span=last - first)


def truncated_lognormal(mean: float, sd: float, low: float, high: float) -> Distribution:
    """Return the lognormal distribution of a number with a mean and a standard deviation sd, truncated to two bounds.

    Mean and sd are those of the number itself, before truncation; 0 <= low <= mean <= high, mean > 0, sd >= 0. Its
    logarithm has the variance ln(1 + sd^2/mean^2) and the mean ln(mean) - variance/2. If sd is 0, every draw
    is the mean.
    """
    if sd == 0.0:
        return fixed(mean)
    variance = math.log1p((sd / mean) ** 2)
    location, scale = math.log(mean) - 0.5 * variance, math.sqrt(variance)
    first = _normal((math.log(low) - location) / scale) if low > 0.0 else 0.0
    last = _normal((math.log(high) - location) / scale)
    return Distribution(
        kind=LOGNORMAL, low=low, high=high, location=location, scale=scale, first=first, span=last - first
    )


def truncated_power_law(exponent: float, low: float, high: float) -> Distribution:
    """Return the power law of rock sizes between two bounds: the number of rocks larger than x falls as x^-exponent.

    exponent > 0, 0 < low < high
    """
    return Distribution(
        kind=POWER_LAW,
        low=low,
        high=high,
        location=0.0,
        scale=-1.0 / exponent,
        first=0.0,
        span=1.0 - (low / high) ** exponent,
    )


def truncated_weibull(shape: float, scale: float, low: float, high: float) -> Distribution:
    """Return the Weibull distribution P(< x) = 1 - exp(-(x/scale)^shape), truncated to two bounds.

    shape, scale > 0, 0 <= low < high. With shape 1 the distribution is exponential, with shape 2 it is a Rayleigh
    distribution. Rosin and Rammler 1933 used this law for ground coal; today the law is also used for block sizes.
    """
    first, last = (_weibull(bound, shape, scale) for bound in (low, high))
    return Distribution(
        kind=WEIBULL, low=low, high=high, location=1.0 / shape, scale=scale, first=first, span=last - first
    )


def triangular_between(low: float, mode: float, high: float) -> Distribution:
    """Return the triangular distribution between two bounds, densest at its mode; low <= mode <= high, low < high."""
    share = (mode - low) / (high - low)
    return Distribution(kind=TRIANGULAR, low=low, high=high, location=mode, scale=high - low, first=0.0, span=share)


@kernel
def quantile(d: Distribution, u: float) -> float:
    """Return the number below which a draw from a distribution lies with probability u, 0 <= u < 1.

    If u is a uniform random number, the result is a draw from the distribution.
    """
    if d.kind == FIXED:
        return d.location
    if d.kind == UNIFORM:
        x = d.location + u * d.scale
    elif d.kind == POWER_LAW:
        x = d.low * (1.0 - u * d.span) ** d.scale
    elif d.kind == WEIBULL:
        x = d.scale * (-math.log1p(-min(d.first + u * d.span, COMMONEST))) ** d.location
    elif d.kind == TRIANGULAR:
        x = _triangular(d, u)
    else:
        x = d.location + d.scale * normal_quantile(d.first + u * d.span)
        if d.kind == LOGNORMAL:
            x = math.exp(x)
    return min(max(x, d.low), d.high)


@kernel
def _triangular(d: Distribution, u: float) -> float:
    """Return the quantile of a triangular distribution at the probability u, in [0, 1).

    d : a distribution from `triangular_between`: `span` is the share (-) below the mode, `scale` the width
    """
    if u < d.span:
        return d.low + d.scale * math.sqrt(u * d.span)
    return d.high - d.scale * math.sqrt((1.0 - u) * (1.0 - d.span))


@kernel
def standard_normal(u: float) -> float:
    """Return a standard normal random number, between -8.3 and 8.3, from a uniform number u in [0, 1)."""
    return normal_quantile(max(u, RAREST))


class Measured(NamedTuple):
    """A list of measured numbers, from which numbers are drawn with replacement: each with the same probability.

    values : (N,) in ascending order, N >= 1
    """

    values: NDArray[np.float64]

    @property
    def low(self) -> float:
        """The smallest number, in the unit of the values."""
        return float(self.values[0])

    @property
    def high(self) -> float:
        """The largest number, in the unit of the values."""
        return float(self.values[-1])


def quantiles(distribution: Distribution | Measured, u: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return random numbers (N,) of a distribution, in its unit, from uniform numbers u (N,) in [0, 1).

    The bits of each number do not depend on N. NumPy's logarithm of a whole array is not used, because its last bit
    depends on the machine and on the length of the array.
    """
    if isinstance(distribution, Measured):
        count = len(distribution.values)  # u * count may be rounded up to count
        return distribution.values[np.minimum((u * count).astype(np.int64), count - 1)]
    x = np.empty(len(u))
    if len(u) <= FEW:
        _quantile_all.py_func(distribution, u.tolist(), x)  # type: ignore[attr-defined]
    else:
        _quantile_all(distribution, u, x)
    return x


@loop
def _quantile_all(distribution: Distribution, u: NDArray[np.float64], x: NDArray[np.float64]) -> None:
    """Write into x (N,) the random number that belongs to each uniform number u (N,)."""
    for i in range(len(x)):
        x[i] = quantile(distribution, u[i])


def _weibull(x: float, shape: float, scale: float) -> float:
    """Return the probability that a Weibull number stays below x >= 0, to truncate distributions."""
    if x == 0.0:
        return 0.0
    exponent = min(shape * math.log(x / scale), LARGEST_EXPONENT)
    return -math.expm1(-math.exp(exponent))


def _normal(z: float) -> float:
    """Return the probability that a standard normal number stays below z, to truncate distributions."""
    return 0.5 * math.erfc(-z / math.sqrt(2.0))
