"""Score on kept-out observations: folds, log scores, a curve without physics, and coverage of predictive intervals."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.density import LEAST_KERNEL, Stops, kernel_widths
from rpf3d_core.calibration.likelihood import ASTRAY, Weighed, log_likelihoods, posterior_weights
from rpf3d_core.calibration.population import normalised

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FOLDS = 5
"""Number of folds; fewer if there are fewer observations."""
NEGLIGIBLE = 0.01
"""Weight of a set, relative to the mean weight of all sets (-), below which ranks leave the stops of the set out."""
RANKED, LEAST_RANKED = 100_000, 50
"""Limits of the number of stopped rocks from which ranks are computed; more would not change the ranks noticeably.

RANKED : of all sets together; LEAST_RANKED : of each set, even if all sets together then exceed RANKED
"""
LEAST_STOPPED = 1e-3
"""An observed block has no prediction if at most this share (-) of the simulated rocks like this block stopped."""
LEAST_VALUES = 3
"""Smallest number of observations from which some can be kept out."""


class Score(NamedTuple):
    """The log scores (N,) of observations, each from a prediction that was made without the observation."""

    each: FloatArray

    @property
    def mean(self) -> float:
        """The mean of the log scores of all observations."""
        return float(self.each.mean())


def folds_of(count: int, seed: int) -> IntArray:
    """Divide N observations at random into folds; return the number (N,) of each observation's fold, from 0.

    There are FOLDS (5) folds, or N if N is less; their sizes differ by at most 1.

    count : number N of observations; seed : of the random order
    """
    folds = min(FOLDS, count)
    order = np.random.Generator(np.random.Philox(key=[seed, 2**32 + 1])).permutation(count)
    return np.asarray(np.argsort(order) % folds)


def weights_without(log_ratio: FloatArray, weighed: Weighed, folds: IntArray, counts: IntArray) -> FloatArray:
    """Return the weights (F, S, M) of S sets and M misfits for each of F folds, from the observations outside the fold.

    log_ratio : (S,) from `population.log_importance`; weighed : log densities of all observations
    folds : (N,) fold of each of the first N observations
    counts : (K,) indices of the observations that are counts of rocks. No fold uses these, because a count may
        include rocks whose stops are kept out
    """
    rows = []
    for fold in range(int(folds.max()) + 1):
        kept = np.ones(weighed.log_densities.shape[-1], dtype=bool)
        kept[np.flatnonzero(folds == fold)] = False
        kept[counts] = False
        rows.append(posterior_weights(log_ratio, log_likelihoods(weighed, kept)))
    return np.stack(rows)


def predictive_score(weights: FloatArray, densities: FloatArray, anywhere: float) -> Score:
    """Return the log scores of N observations under a mixture of parameter sets and misfits.

    weights : (N, S, M) of S sets and M misfits for each observation, or (1, S, M) for all observations
    densities : (S, M, N) of the observations under each set with each misfit
    anywhere : density of an observation that may lie anywhere, as in `likelihood.Densities`; for all, or (N,) for each
    """
    mixed = np.einsum("nsm,smn->n", np.broadcast_to(weights, (densities.shape[2], *weights.shape[1:])), densities)
    return Score(np.log((1.0 - ASTRAY) * mixed + ASTRAY * anywhere))


def misfit_weights(densities: FloatArray, folds: IntArray, anywhere: float | FloatArray) -> FloatArray:
    """Return, for each of N observations, the weights (N, 1, M) of M misfits of one parameter set.

    The weights for an observation follow from the observations in the other folds. They are estimated as in a
    calibration, in which all misfits are equally likely beforehand.

    densities : (M, N) of the N observations under the set; folds : (N,) fold of each observation
    anywhere : density of an observation that may lie anywhere, as in `likelihood.Densities`; for all, or (N,) for each
    """
    logs = np.log(np.maximum((1.0 - ASTRAY) * densities + ASTRAY * anywhere, 1e-300))
    rows = [normalised(logs[:, folds != fold].sum(axis=1)) for fold in range(int(folds.max()) + 1)]
    return np.asarray(np.stack(rows)[folds][:, None, :])


def curve_score(observed: FloatArray, folds: IntArray, error: float, anywhere: float) -> Score:
    """Return the log scores of N observations under normal curves, which are a prediction without any physics.

    For each fold, a curve is fitted to the observations in the other folds. The curve is scored by the rules for a
    calibration, so that both scores can be compared. Mean and variance of the curve are not known, like the unknowns of
    a scene, so the prediction is Student's t distribution. A share ASTRAY of the observations may come from anywhere.

    observed : (N, D), each axis with its own mean and standard deviation; axes are independent
    error : measuring error, in the unit of `observed`: the smallest standard deviation that a curve can have, but at
        least LEAST_KERNEL
    anywhere : density of an observation that may lie anywhere, as in `likelihood.Densities`
    """
    each = np.empty(len(observed))
    for fold in range(int(folds.max()) + 1):
        out = folds == fold
        each[out] = np.prod(_student_density(observed[out], observed[~out], max(error, LEAST_KERNEL)), axis=1)
    return Score(np.log((1.0 - ASTRAY) * each + ASTRAY * anywhere))


def _student_density(x: FloatArray, sample: FloatArray, least: float) -> FloatArray:
    """Return the predictive density (K, D) at x (K, D) of a normal distribution that is known only from a sample.

    sample : (N, D), N > 1; the D axes are independent
    least : a smaller standard deviation of the sample counts as this value, in the unit of the sample

    Source: Gelman et al. 2013, Bayesian Data Analysis, section 3.2, with the prior 1 / variance.
    """
    count, free = len(sample), len(sample) - 1
    scale = np.maximum(sample.std(axis=0, ddof=1), least) * np.sqrt(1.0 + 1.0 / count)
    peak = math.exp(math.lgamma(0.5 * count) - math.lgamma(0.5 * free)) / (math.sqrt(free * math.pi) * scale)
    return np.asarray(peak * (1.0 + ((x - sample.mean(axis=0)) / scale) ** 2 / free) ** (-0.5 * count))


def ranks(
    stops: list[Stops], weights: FloatArray, observed: FloatArray, errors: FloatArray, alike: FloatArray | None = None
) -> FloatArray:
    """Return the predicted probability (N, 2) that a rock stops at a smaller coordinate than each observed stop.

    The two coordinates are the distances along and across the slope.

    Rocks that left the terrain or did not stop are left out. The result is NaN for a block without a prediction: of the
    rocks that have a weight for this block (`alike`), at most LEAST_STOPPED (0.1 %) stopped. If all sets together have
    many rocks, only the first rocks of each set are used; this is a fair selection, because their order is random.

    stops : of each of S sets; observed : (N, 2) m, the N observed stops
    weights : (N, S, M) weights of the S sets and M errors for each observed stop
    errors : (M,) m, standard deviations of the difference between a simulated stop and an observed stop
    alike : (N, R) weight of each rock in the prediction for each observed block, >= 0; None if all weights are equal
    """
    below, total, in_all = np.zeros(observed.shape), np.zeros((len(observed), 1)), np.zeros((len(observed), 1))
    most = max(RANKED // len(stops), LEAST_RANKED)
    for number, one in enumerate(stops):
        standing = np.ones((1, len(one.place))) if alike is None else alike
        chosen = np.flatnonzero(one.deposited)[:most]
        places, of_rocks = one.place[chosen], standing[:, chosen]
        stopped = (standing @ one.deposited / np.maximum(standing.sum(axis=1), 1e-300))[:, None]
        ranked = np.where(of_rocks.sum(axis=1, keepdims=True) > 0.0, stopped, 0.0)
        for error, share in zip(errors.tolist(), weights[:, number].T, strict=True):
            if not len(chosen) or share.max() < NEGLIGIBLE / len(stops):
                continue
            z = (observed[:, None, :] - places[None, :, :]) / kernel_widths(places, error)
            part = share[:, None] * ranked
            below += part * _weighted_mean(_probabilities(z), of_rocks)
            total += part
            in_all += share[:, None] * stopped
    known = (in_all > LEAST_STOPPED) & (total > 0.0)
    return np.where(known, below / np.maximum(total, 1e-300), np.nan)


def _weighted_mean(values: FloatArray, of_rocks: FloatArray) -> FloatArray:
    """Return the weighted mean (N, D) of values over R rocks; 0 where all weights are 0.

    values : (N, R, D); of_rocks : (N, R) or (1, R), weights of the rocks
    """
    shares = of_rocks / np.maximum(of_rocks.sum(axis=1, keepdims=True), 1e-300)
    return np.asarray((values * shares[:, :, None]).sum(axis=1))


def covered(rank: FloatArray, share: float, blocks: int) -> FloatArray:
    """Return, for each of D axes, the share (D,) of all observed blocks that lie within their predictive intervals.

    A block without a prediction counts as outside its interval.

    rank : (K, D) from `ranks`, of the blocks that have a prediction; blocks : number of all blocks, at least K
    share : probability of the central predictive interval, such as 0.9 (-)
    """
    edge = 0.5 * (1.0 - share)
    return np.asarray(((rank >= edge) & (rank <= 1.0 - edge)).sum(axis=0) / blocks)


def _probabilities(z: FloatArray) -> FloatArray:
    """Return the standard normal probability below each z, with an error of less than 1e-7; z : of any shape.

    Source: Abramowitz & Stegun 1964, Handbook of Mathematical Functions, formula 26.2.17.
    """
    t = 1.0 / (1.0 + 0.2316419 * np.abs(z))
    series = t * (0.319381530 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))))
    upper = np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi) * series
    return np.asarray(np.where(z >= 0.0, 1.0 - upper, upper))
