"""Population Monte Carlo: draw new parameter sets near sets of high weight, and weigh the sets of all rounds together.

The first round is spread over the prior. Each further round draws from a mixture of kernels at the sets flown so far,
and a share of its sets from the prior. The weight of a set is the prior density times the likelihood, divided by the
density with which all rounds together propose the set. So the sets of all rounds count in the result.

Sources
-------
Cappe, Guillin, Marin & Robert 2004, J. Comput. Graph. Stat. 13:907-929: population Monte Carlo.
Cornuet, Marin, Mira & Robert 2012, Scand. J. Stat. 39:798-812: weights over the mixture of all proposals.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.normal_space import LOG_ROOT_TAU, log_prior, normal_of
from rpf3d_core.unknowns.points import SMALLEST, spread_points

FloatArray = NDArray[np.float64]

FROM_PRIOR = 0.1
"""Share (-) of the sets of each later round that is drawn from the prior, so that no weight can grow without bound."""
WIDENING = 1.5
"""Factor (-) by which the kernels of a mixture are wider than the rule for density estimates recommends."""
LEAST_KEPT = 25.0
"""Least effective number of parameter sets behind a proposal, or 8 for each unknown if this is more.

If there are fewer, the likelihood is raised to a smaller power (`flattened`).
"""


class Mixture(NamedTuple):
    """The proposal of a round: a mixture of K normal kernels, and the prior with the share FROM_PRIOR (10 %).

    centres : (K, U) of the kernels, for U unknowns, in the space of `normal_space`; shares : (K,) of the kernels, sum 1
    root : (U, U) lower triangular root of the covariance, which is the same for all kernels

    A mixture without centres (K = 0) is the prior alone.
    """

    centres: FloatArray
    shares: FloatArray
    root: FloatArray


def prior_mixture(unknowns: int) -> Mixture:
    """Return the proposal of the first round: the prior alone; unknowns : number of unknowns."""
    return Mixture(centres=np.empty((0, unknowns)), shares=np.empty(0), root=np.eye(unknowns))


def draw(mixture: Mixture, count: int, seed: int, number: int) -> FloatArray:
    """Return parameter sets drawn from the proposal of a round: z (N, U) (-), as in `normal_space`.

    The random numbers depend only on the seed and on the number of the round. The sets of the first round are
    quasi-random, that is evenly spread.

    count : number N of the parameter sets; seed : of the calibration; number : of the round, from 0
    """
    unknowns = mixture.centres.shape[1]
    if not len(mixture.centres):
        return normal_of(np.clip(spread_points(count, unknowns, seed), SMALLEST, 1.0 - SMALLEST))
    random = np.random.Generator(np.random.Philox(key=[seed, number]))
    normal, kind = random.standard_normal((count, unknowns)), random.random(count)
    which = random.choice(len(mixture.centres), size=count, p=mixture.shares)
    near = mixture.centres[which] + normal @ mixture.root.T
    return np.asarray(np.where((kind < FROM_PRIOR)[:, None], normal, near))


def log_density(mixture: Mixture, z: FloatArray) -> FloatArray:
    """Return the logarithm (S,) of the density with which a proposal draws S sets z (S, U) of U unknowns."""
    prior = log_prior(z)
    if not len(mixture.centres):
        return prior
    scaled, centres = (np.linalg.solve(mixture.root, x.T).T for x in (z, mixture.centres))
    squares = (scaled**2).sum(1)[:, None] + (centres**2).sum(1)[None, :] - 2.0 * scaled @ centres.T
    size = z.shape[1] * LOG_ROOT_TAU + np.log(np.diag(mixture.root)).sum()
    kernels = np.log(np.exp(-0.5 * np.maximum(squares, 0.0)) @ mixture.shares + 1e-300) - size
    return np.asarray(np.logaddexp(np.log(FROM_PRIOR) + prior, np.log1p(-FROM_PRIOR) + kernels))


def log_importance(z: FloatArray, mixtures: Sequence[Mixture], counts: Sequence[int]) -> FloatArray:
    """Return the logarithm (S,) of the importance of each set: its prior density divided by its proposal density.

    The proposal density is the mean density of the proposals of all rounds, weighted by their numbers of sets.

    z : (S, U) (-), S sets of U unknowns, as in `normal_space`
    mixtures : proposal of each round; counts : number of sets of each round
    """
    total = np.full(len(z), -np.inf)
    for mixture, count in zip(mixtures, counts, strict=True):
        if count:
            total = np.logaddexp(total, np.log(count / len(z)) + log_density(mixture, z))
    return np.asarray(log_prior(z) - total)


def normalised(log_weights: FloatArray) -> FloatArray:
    """Return the weights (S,) of S parameter sets, scaled so that their sum is 1.

    log_weights : (S,) natural logarithms of the weights; a common summand of all logarithms does not matter
    """
    weights = np.exp(log_weights - log_weights.max())
    return np.asarray(weights / weights.sum())


def effective_samples(weights: FloatArray) -> float:
    """Return the effective number of samples (-) of weights (S,) whose sum is 1: from 1 to S.

    Source: Kish 1965, Survey Sampling; Kong 1992, University of Chicago technical report 348.
    """
    return float(1.0 / (weights**2).sum())


def flattened(log_ratio: FloatArray, log_likelihood: FloatArray, least: float) -> tuple[FloatArray, float]:
    """Return weights (S,) with at least `least` effective samples, and the power of the likelihood in these weights.

    The power is 1 if the full likelihood has enough effective samples; otherwise a smaller power is found by bisection.
    If even the power 0 has too few effective samples, the power is 0, and the weights have fewer than `least`.

    log_ratio : (S,) from `log_importance`; log_likelihood : (S,)
    """
    full = normalised(log_ratio + log_likelihood)
    if effective_samples(full) >= least:
        return full, 1.0
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        enough = effective_samples(normalised(log_ratio + middle * log_likelihood)) >= least
        low, high = (middle, high) if enough else (low, middle)
    return normalised(log_ratio + low * log_likelihood), low


def next_mixture(z: FloatArray, log_ratio: FloatArray, log_likelihood: FloatArray) -> tuple[Mixture, float]:
    """Return the proposal of the next round, and the power (0 to 1) of the likelihood in the weights of its kernels.

    z : (S, U) (-) all S sets so far, of U unknowns, as in `normal_space`
    log_ratio : (S,) (-) from `log_importance`; log_likelihood : (S,) (-)

    Source of the kernels' width: Silverman 1986, Density Estimation, equation 4.14, times WIDENING.
    """
    unknowns = z.shape[1]
    least = max(LEAST_KEPT, 8.0 * unknowns)
    weights, power = flattened(log_ratio, log_likelihood, min(least, 0.9 * len(z)))
    width = WIDENING * (4.0 / ((unknowns + 2) * effective_samples(weights))) ** (1.0 / (unknowns + 4))
    root = width * np.linalg.cholesky(covariance_of(z, weights))
    return Mixture(centres=z, shares=weights, root=root), power


def covariance_of(z: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the covariance (U, U) (-) of parameter sets z (S, U) with weights (S,) whose sum is 1.

    A small number is added to the diagonal (a ridge), so that the matrix has an inverse.
    """
    centred = z - weights @ z
    covariance = (centred * weights[:, None]).T @ centred
    return np.asarray(covariance + 1e-4 * np.eye(z.shape[1]))
