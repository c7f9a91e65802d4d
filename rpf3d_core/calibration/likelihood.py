"""The likelihood of all parameter sets, the noise of this likelihood, and weights of the sets that include the noise.

The likelihood follows from the densities of the observations. The density of a set is averaged over sets that are near
in z, the space of `normal_space`, with a kernel that is narrow compared with the posterior. The remaining noise is
measured by drawing the groups of releases again with replacement. All sets of a round fly the same releases, so each
draw is used for all sets of the round; other rounds have other draws. The weights are the mean over these draws, so
intervals include the noise.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.density import GROUPS
from rpf3d_core.calibration.population import normalised

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ASTRAY = 0.01
"""Share (-) of observations that may come from anywhere in the range, so that one odd block cannot decide alone."""
NEAR = 0.3
"""Standard deviation of the kernel over parameter sets, relative to the posterior's (-).

The kernel widens the posterior by less than NEAR^2 / 2 = 5 %.
"""
REDRAWS = 16
"""Number of times that the groups of releases are drawn again, to measure the noise of the likelihood."""


class Densities(NamedTuple):
    """Densities of C observations under S parameter sets and M misfits, by group of releases.

    values : (S, GROUPS, M, C) densities; rounds : (S,) number of the round of each set
    counts : (C,) number of observed rocks behind each observation
    anywhere : (C,) density of an observation that does not come from the model but from anywhere in the possible range,
        in the unit of its density; 0 if all observations come from the model
    """

    values: FloatArray
    rounds: IntArray
    counts: FloatArray
    anywhere: FloatArray


class Weighed(NamedTuple):
    """The log densities of C observations, from which the log-likelihood of S parameter sets and its noise follow.

    log_densities : (D, S, M, C) logarithms of the averaged densities: at index 0 with equal weights of all groups, at
        each further index of D with the weights of one draw of groups (`group_shares`)
    counts : (C,) number of observed rocks behind each observation
    """

    log_densities: FloatArray
    counts: FloatArray


def group_shares(rounds: int, seed: int, redraws: int = REDRAWS) -> FloatArray:
    """Return D draws of the weights of the groups of rocks in each of T rounds: (D, T, GROUPS).

    The weights of a draw in a round have the sum 1. In the first draw, all groups have equal weights. In each other
    draw, groups are drawn with replacement (bootstrap); the spread over these draws shows the noise of the likelihood.

    rounds : number of rounds T; seed : of the random draws; redraws : number of random draws, D - 1
    """
    random = np.random.Generator(np.random.Philox(key=[seed, 2**32]))
    drawn = random.multinomial(GROUPS, np.full(GROUPS, 1.0 / GROUPS), size=(redraws, rounds)) / GROUPS
    return np.concatenate([np.full((1, rounds, GROUPS), 1.0 / GROUPS), drawn])


def nearness(z: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the weights (S, S) with which densities are averaged around each parameter set; each row has the sum 1.

    Row i has the weights of all sets in the average around set i; these weights fall with the distance in z.

    z : (S, U) U unknowns of S sets as standard normal numbers (`normal_space`)
    covariance : (U, U) of the posterior in z
    """
    scaled = np.linalg.solve(np.linalg.cholesky(covariance) * NEAR, z.T).T
    squares = (scaled**2).sum(1)[:, None] + (scaled**2).sum(1)[None, :] - 2.0 * scaled @ scaled.T
    kernel = np.exp(-0.5 * np.maximum(squares, 0.0))
    return np.asarray(kernel / kernel.sum(axis=1, keepdims=True))


def weighed(densities: Densities, near: FloatArray, shares: FloatArray) -> Weighed:
    """Return the log densities of C observations under S parameter sets, for each draw of groups of rocks.

    Before the logarithm, the densities of a set are averaged over its neighbouring sets.

    near : (S, S) from `nearness`; shares : (D, T, GROUPS) from `group_shares`
    """
    astray = ASTRAY * densities.anywhere
    kept = np.where(densities.anywhere > 0.0, 1.0 - ASTRAY, 1.0)
    shape = densities.values.shape[0], *densities.values.shape[2:]
    logs = [
        np.log(np.maximum(kept * (near @ _mixed(densities, share)).reshape(shape) + astray, 1e-300)) for share in shares
    ]
    return Weighed(log_densities=np.stack(logs), counts=densities.counts)


def _mixed(densities: Densities, share: FloatArray) -> FloatArray:
    """Return the densities (S, M * C) of each parameter set, averaged over its groups of rocks.

    share : (T, GROUPS) weights of the groups in each round: one draw of `group_shares`
    """
    mixed = np.einsum("sg,sgk->sk", share[densities.rounds], densities.values.reshape(*densities.values.shape[:2], -1))
    return np.asarray(mixed)


def log_likelihoods(weighed: Weighed, kept: NDArray[np.bool_] | None = None) -> FloatArray:
    """Return the log-likelihood (D, S, M) for each of D draws of groups of rocks, S parameter sets and M misfits.

    weighed : log densities of the C observations; kept : (C,) True for the observations that count, None for all
    """
    counts = weighed.counts if kept is None else np.where(kept, weighed.counts, 0.0)
    return np.asarray(weighed.log_densities @ counts)


def over_misfits(log_likelihood: FloatArray) -> FloatArray:
    """Return the logarithm (..., S) of the mean over M misfits of likelihoods whose logarithms are (..., S, M)."""
    return np.asarray(np.logaddexp.reduce(log_likelihood, axis=-1) - np.log(log_likelihood.shape[-1]))


def posterior_weights(log_ratio: FloatArray, log_likelihood: FloatArray) -> FloatArray:
    """Return the posterior weight (S, M) of each of S parameter sets with each of M misfits; the sum of weights is 1.

    The weights are the mean over the random draws of groups of rocks, so they include the noise of the likelihood. The
    draw at index 0, with equal weights of all groups, does not count.

    log_ratio : (S,) from `population.log_importance`; log_likelihood : (D, S, M) from `log_likelihoods`
    """
    each = np.stack([normalised(log_ratio[:, None] + table) for table in log_likelihood[1:]])
    return np.asarray(each.mean(axis=0))


def noise_of(log_likelihood: FloatArray, weights: FloatArray) -> float:
    """Return the standard deviation (-) of a set's log-likelihood that is due to the finite number of rocks.

    The variances of the sets are averaged with the posterior weights. Noise that all sets have in common does not
    count, because this noise does not change a weight.

    log_likelihood : (D, S) for D draws of groups and S sets, from `over_misfits`
    weights : (S,) posterior weights of the sets, sum 1
    """
    centred = log_likelihood[1:] - (log_likelihood[1:] @ weights)[:, None]
    deviations = centred - centred.mean(axis=0)
    return float(np.sqrt((deviations**2).mean(axis=0) @ weights))
