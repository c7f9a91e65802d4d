"""The unknowns as independent standard normal numbers z: the space in which the sampler moves.

Each unknown is a quantile of its prior, u = Phi(z). In z every prior is a standard normal distribution, so bounds need
no special treatment, and a posterior at the edge of a prior appears as a large |z|.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.materials.distributions import Distribution, quantiles
from rpf3d_core.materials.normal_quantile import normal_quantile

FloatArray = NDArray[np.float64]

LOG_ROOT_TAU = 0.5 * math.log(2.0 * math.pi)
"""Logarithm of the normalising constant of the standard normal density."""


def probability_below(z: FloatArray) -> FloatArray:
    """Return the standard normal probability below each z (...), from 0 to 1, exact in both tails."""
    z = np.asarray(z, dtype=float)
    flat = [0.5 * math.erfc(-value / math.sqrt(2.0)) for value in z.ravel().tolist()]
    return np.array(flat).reshape(z.shape)


def normal_of(u: FloatArray) -> FloatArray:
    """Return the standard normal quantile z (...) of each probability u (...), 0 < u < 1."""
    u = np.asarray(u, dtype=float)
    return np.array([normal_quantile(value) for value in u.ravel().tolist()]).reshape(u.shape)


def values_of(priors: Sequence[Distribution], z: FloatArray) -> FloatArray:
    """Return the values (S, U) of U unknowns in S parameter sets, in the units of the scene.

    priors : of the unknowns; z : (S, U) the unknowns as standard normal numbers
    """
    u = probability_below(z)
    return np.stack([quantiles(prior, u[:, k]) for k, prior in enumerate(priors)], axis=1)


def log_prior(z: FloatArray) -> FloatArray:
    """Return the logarithm (S,) of the prior density at z (S, U): the sum over U standard normal log densities."""
    return np.asarray(-0.5 * (z * z).sum(axis=1) - z.shape[1] * LOG_ROOT_TAU)
