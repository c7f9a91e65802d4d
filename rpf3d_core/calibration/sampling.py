"""The rounds of a calibration: which parameter sets to fly next, and the posterior from all flown sets.

All results of this module are functions of the flown sets only. So a calibration that is interrupted and continued has
the same result, bit for bit, as a calibration without interruption.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.likelihood import (
    Densities,
    Weighed,
    group_shares,
    log_likelihoods,
    nearness,
    noise_of,
    over_misfits,
    posterior_weights,
    weighed,
)
from rpf3d_core.calibration.population import (
    Mixture,
    covariance_of,
    draw,
    effective_samples,
    log_importance,
    next_mixture,
    prior_mixture,
)

FloatArray = NDArray[np.float64]

FIRST_SETS = 60
"""Number of parameter sets of the first round for each unknown."""
FURTHER_SETS = 100
"""Number of parameter sets of each further round."""
MOST_ROUNDS = 20
"""Largest number of rounds: more would repeat what is known."""
ENOUGH = 300.0
"""Smallest effective number of samples (-) with which a calibration may end before its last round."""
FLOOR = 50.0
"""Effective number of samples (-) below which a calibration is refused: the parameters are not determined."""
MOST_NOISE = 1.0
"""Noise of the log-likelihood (-) up to which a calibration may end before its last round."""


class FlownRound(NamedTuple):
    """The flown parameter sets of one round.

    z : (S, U) U unknowns of S sets as standard normal numbers (`normal_space`)
    densities : (S, GROUPS, M, C) of C observations under each set, for each group of rocks and each of M misfits
    """

    z: FloatArray
    densities: FloatArray


class Observed(NamedTuple):
    """The properties of the C observations that the likelihood depends on, apart from their densities.

    counts : (C,) number of observed rocks behind each observation: the power of its density in the likelihood
    anywhere : (C,) density of an observation that may lie anywhere in the possible range, such as on the whole terrain
    """

    counts: FloatArray
    anywhere: FloatArray


class Proposed(NamedTuple):
    """The proposals of all rounds, including the next round.

    mixtures : proposal of each round; power : power of the likelihood with which the last proposal was made
    covariance : (U, U) of the U unknowns of the flown sets, as standard normal numbers, with the weights of the last
        proposal
    """

    mixtures: tuple[Mixture, ...]
    power: float
    covariance: FloatArray


class Posterior(NamedTuple):
    """The posterior from all S flown sets.

    z : (S, U) U unknowns as standard normal numbers (`normal_space`); weights : (S,) of the sets, sum 1
    misfits : (M,) probabilities of the M misfits; log_ratio : (S,) from `population.log_importance`
    weighed : log densities with their noise; effective : effective samples
    noise : standard deviation of a set's log-likelihood that is due to the finite number of rocks
    """

    z: FloatArray
    weights: FloatArray
    misfits: FloatArray
    log_ratio: FloatArray
    weighed: Weighed
    effective: float
    noise: float


def sets_of_round(number: int, unknowns: int) -> int:
    """Return the number of parameter sets of round `number`, from 0, for a number of unknowns."""
    return FIRST_SETS * unknowns if number == 0 else FURTHER_SETS


def first_proposal(unknowns: int) -> Proposed:
    """Return the proposals before any flight: only the proposal of the first round, which is the prior."""
    return Proposed(mixtures=(prior_mixture(unknowns),), power=0.0, covariance=np.eye(unknowns))


def drawn_sets(proposed: Proposed, number: int, seed: int) -> FloatArray:
    """Draw the parameter sets of round `number`, from 0, as standard normal numbers z (S sets, U unknowns).

    proposed : the proposal of each round, from which its sets are drawn; seed : of the calibration
    """
    mixture = proposed.mixtures[number]
    return draw(mixture, sets_of_round(number, mixture.root.shape[0]), seed, number)


def with_next(proposed: Proposed, rounds: Sequence[FlownRound], observed: Observed, seed: int) -> Proposed:
    """Return the given proposals and the proposal of the next round, which is computed from all rounds flown so far.

    proposed : proposals of the flown rounds; rounds : the flown sets of these rounds; seed : of the calibration
    """
    z, log_ratio = _together(rounds, proposed.mixtures)
    densities = _densities(rounds, observed)
    both = weighed(densities, nearness(z, proposed.covariance), group_shares(len(rounds), seed, 0))
    logs = over_misfits(log_likelihoods(both)[0])
    mixture, power = next_mixture(z, log_ratio, logs)
    covariance = covariance_of(z, mixture.shares)
    return Proposed(mixtures=(*proposed.mixtures, mixture), power=power, covariance=covariance)


def posterior_of(proposed: Proposed, rounds: Sequence[FlownRound], observed: Observed, seed: int) -> Posterior:
    """Return the posterior from all flown sets; the last round may be incomplete.

    proposed : proposals of the rounds; rounds : the flown sets of each round; seed : of the calibration
    """
    z, log_ratio = _together(rounds, proposed.mixtures)
    both = weighed(_densities(rounds, observed), nearness(z, proposed.covariance), group_shares(len(rounds), seed))
    logs = log_likelihoods(both)
    joint = posterior_weights(log_ratio, logs)
    weights = joint.sum(axis=1)
    return Posterior(
        z=z, weights=weights, misfits=joint.sum(axis=0), log_ratio=log_ratio, weighed=both,
        effective=effective_samples(weights), noise=noise_of(over_misfits(logs), weights),
    )  # fmt: skip


def is_enough(posterior: Posterior, power: float) -> bool:
    """Return True if a calibration may end before its last round, because enough is known.

    "Enough" means: the full likelihood was used, there are at least ENOUGH (300) effective samples, and the noise of
    the log-likelihood is at most MOST_NOISE (1).

    power : power of the likelihood with which the last proposal was made; 1 for the full likelihood
    """
    return power == 1.0 and posterior.effective >= ENOUGH and posterior.noise <= MOST_NOISE


def _together(rounds: Sequence[FlownRound], mixtures: Sequence[Mixture]) -> tuple[FloatArray, FloatArray]:
    """Return the sets z (S, U) of all rounds, and the logarithm of the importance (S,) of each set.

    mixtures : proposal of each round
    """
    z = np.concatenate([one.z for one in rounds])
    return z, log_importance(z, mixtures[: len(rounds)], [len(one.z) for one in rounds])


def _densities(rounds: Sequence[FlownRound], observed: Observed) -> Densities:
    values = np.concatenate([one.densities for one in rounds])
    numbers = np.repeat(np.arange(len(rounds)), [len(one.z) for one in rounds])
    return Densities(values=values, rounds=numbers, counts=observed.counts, anywhere=observed.anywhere)
