"""Tests of the sampler against a posterior in closed form: normal prior, normal likelihood."""

import numpy as np
import pytest

from rpf3d_core.calibration.likelihood import group_shares
from rpf3d_core.calibration.normal_space import log_prior, normal_of, probability_below, values_of
from rpf3d_core.calibration.population import (
    Mixture,
    covariance_of,
    draw,
    effective_samples,
    flattened,
    log_density,
    log_importance,
    next_mixture,
    normalised,
    prior_mixture,
)
from rpf3d_core.materials.distributions import uniform_between

MEAN, SD = np.array([1.0, -0.5]), np.array([0.1, 0.3])
"""Mean and standard deviation of the normal likelihood, in the normal scores z."""


def log_likelihood(z: np.ndarray) -> np.ndarray:
    return -0.5 * (((z - MEAN) / SD) ** 2).sum(axis=1)


def test_the_sampler_finds_a_posterior_in_closed_form() -> None:
    mixtures, rounds = [prior_mixture(2)], []
    for number in range(8):
        rounds.append(draw(mixtures[number], 120 if number == 0 else 100, seed=4, number=number))
        z = np.concatenate(rounds)
        ratio = log_importance(z, mixtures, [len(one) for one in rounds])
        mixture, power = next_mixture(z, ratio, log_likelihood(z))
        mixtures.append(mixture)
    assert power == 1.0
    weights = normalised(ratio + log_likelihood(z))
    assert effective_samples(weights) > 150
    variance = 1.0 / (1.0 + SD**-2)  # a standard normal prior
    np.testing.assert_allclose(weights @ z, variance * MEAN / SD**2, atol=4.0 * np.sqrt(variance.max() / 150))
    np.testing.assert_allclose(np.diag(covariance_of(z, weights)) - 1e-4, variance, rtol=0.35)


def test_a_proposal_is_a_density() -> None:
    mixture = Mixture(np.array([[0.5], [-1.0]]), np.array([0.7, 0.3]), np.array([[0.4]]))
    grid = np.linspace(-8.0, 8.0, 4001)[:, None]
    assert np.trapezoid(np.exp(log_density(mixture, grid)), grid[:, 0]) == pytest.approx(1.0, abs=1e-6)
    drawn = draw(mixture, 40_000, seed=1, number=1)
    # prior 0.1, kernels 0.9: mean 0.9 x (0.35 - 0.3)
    assert drawn.mean() == pytest.approx(0.9 * 0.05, abs=0.02)


def test_rounds_are_the_same_for_the_same_seed_and_differ_for_another() -> None:
    mixture = Mixture(np.zeros((1, 2)), np.ones(1), np.eye(2))
    assert (draw(mixture, 9, 1, 3) == draw(mixture, 9, 1, 3)).all()
    assert (draw(mixture, 9, 1, 3) != draw(mixture, 9, 2, 3)).any()
    assert (draw(mixture, 9, 1, 3) != draw(mixture, 9, 1, 4)).any()


def test_effective_samples_of_equal_and_of_single_weights() -> None:
    assert effective_samples(np.full(40, 1 / 40)) == pytest.approx(40.0)
    assert effective_samples(np.array([1.0, 0.0, 0.0])) == 1.0


def test_a_sharp_likelihood_is_flattened_until_enough_sets_carry_weight() -> None:
    z = draw(prior_mixture(2), 300, 1, 0)
    ratio, sharp = np.zeros(300), 40.0 * log_likelihood(z)
    weights, power = flattened(ratio, sharp, 25.0)
    assert 0.0 < power < 1.0
    assert effective_samples(weights) == pytest.approx(25.0, rel=0.05)
    assert flattened(ratio, np.zeros(300), 25.0)[1] == 1.0


def test_normal_numbers_and_values_of_a_prior() -> None:
    z = np.array([[-30.0], [-1.0], [0.0], [2.0]])
    tabled = [0.0, 0.15865525393145707, 0.5, 0.9772498680518208]
    np.testing.assert_allclose(probability_below(z[:, 0]), tabled, atol=1e-15)
    np.testing.assert_allclose(normal_of(probability_below(z[1:, 0])), z[1:, 0], atol=1e-9)
    values = values_of([uniform_between(2.0, 4.0)], z)[:, 0]
    np.testing.assert_allclose(values, [2.0, 2.3173105, 3.0, 3.9544997], atol=1e-6)
    assert log_prior(np.zeros((1, 2)))[0] == pytest.approx(-np.log(2.0 * np.pi))


def test_groups_are_drawn_again_with_equal_expectation() -> None:
    shares = group_shares(3, seed=1, redraws=4000)
    np.testing.assert_allclose(shares.sum(axis=2), 1.0)
    assert (shares[0] == 1.0 / shares.shape[2]).all()
    np.testing.assert_allclose(shares[1:].mean(axis=(0, 1)), 1.0 / shares.shape[2], rtol=0.05)
