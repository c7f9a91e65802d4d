"""Gamma-distributed random numbers for the diameters of trees, from counter-based uniform numbers."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.materials.streams import Purpose, uniform

ATTEMPTS = 60
"""Largest number of attempts for each random number; an attempt uses one normal and one uniform number.

At most one attempt in twenty is rejected, so the chance that all 60 attempts are rejected is only 1e-78.
"""
LEAST_SD = 1e-6
"""Largest ratio (-) of standard deviation to mean for which every random number is the mean itself."""


def gamma_of(seed: int, purpose: Purpose, number: NDArray[np.int64], mean: float, sd: float) -> NDArray[np.float64]:
    """Return gamma-distributed random numbers (N,) with a mean > 0 and a standard deviation, in the unit of the mean.

    If sd is at most a millionth of the mean, every number is the mean.

    Each result is a function of the seed, the purpose and its own `number` (N,). Method: Marsaglia and Tsang 2000 (ACM
    Transactions on Mathematical Software 26(3):363-372, doi 10.1145/358407.358414). A rejected number is drawn again;
    each attempt has its own streams of random numbers, so no result depends on another result.
    """
    if sd <= LEAST_SD * mean:
        return np.full(len(number), mean)
    shape, scale = (mean / sd) ** 2, sd * sd / mean
    d = (shape + 1.0 if shape < 1.0 else shape) - 1.0 / 3.0
    c = 1.0 / np.sqrt(9.0 * d)
    drawn = np.full(len(number), d)
    left = np.arange(len(number))
    for attempt in range(ATTEMPTS):
        x = _normal(seed, purpose, number[left], 3 * attempt + 1)
        u = uniform(seed, 3 * attempt + 3, number[left], purpose)
        v = (1.0 + c * x) ** 3
        with np.errstate(invalid="ignore", divide="ignore"):
            kept = (v > 0.0) & (np.log(u) < 0.5 * x * x + d - d * v + d * np.log(v))
        drawn[left[kept]] = d * v[kept]
        left = left[~kept]
        if not len(left):
            break
    if shape < 1.0:
        drawn *= (1.0 - uniform(seed, 0, number, purpose)) ** (1.0 / shape)
    return np.asarray(scale * drawn)


def _normal(seed: int, purpose: Purpose, number: NDArray[np.int64], source: int) -> NDArray[np.float64]:
    """Return standard normal random numbers (N,), each from two uniform numbers (Box and Muller 1958).

    number : (N,) number of each result; source : first of the two streams of uniform numbers, `source` and `source` + 1
    """
    radius = np.sqrt(-2.0 * np.log1p(-uniform(seed, source, number, purpose)))
    return np.asarray(radius * np.cos(2.0 * np.pi * uniform(seed, source + 1, number, purpose)))
