"""Tests of impacts with random matrices (Bourrier et al. 2009): signs, moments, limits, and streams of draws."""

import numpy as np
import pytest
from flights.rebounds_named import MEAN, SPREAD, energy, falling_rock, flight_with, matrix_of, struck
from flights.scenes_of_facets import engine_over, fly, rough_grid, same_bits, surface

from rpf3d_core.kinetics.rebounds.stochastic_matrix import StochasticMatrix
from rpf3d_core.setup.builders.rebounds import cholesky
from rpf3d_core.values import ZERO, Motion

CERTAIN = matrix_of(0.0)
DRAWS = 4000
SIX_SIGMA = 6.0
"""Largest error of a mean of n draws, in standard errors; a correct mean exceeds it once in a billion."""
BEFORE = (6.0, 0.0, -4.0)
SPIN = (0.0, 5.0, 0.0)
STATE = np.array([6.0, 4.0, 2.5])
"""(v_t, v_n, R w) in m/s of BEFORE and SPIN, for R = 0.5 m."""


def state_after(model, rock):
    """Return (v_t, v_n, R w) in m/s after an impact with BEFORE and SPIN."""
    after = struck(model, surface(), BEFORE, SPIN, rock=rock)
    return np.array([after.v[0], after.v[2], 0.5 * after.w[1]])


def test_without_covariance_the_state_is_multiplied_by_the_mean():
    np.testing.assert_allclose(state_after(CERTAIN, falling_rock()), np.array(MEAN) @ STATE, rtol=1e-14)


def test_a_diagonal_is_a_lumped_mass_that_leaves_without_spin():
    model = matrix_of(0.0, np.diag([0.8, 0.5, 0.0]))
    after = struck(model, surface(), (3.0, 4.0, -5.0), (4.0, -3.0, 2.0))
    assert after.v == pytest.approx((2.4, 3.2, 2.5), rel=1e-14)
    assert after.w == pytest.approx((0.0, 0.0, 2.0), abs=1e-14)


def test_spin_about_the_normal_and_about_the_way_is_kept():
    after = struck(CERTAIN, surface(), BEFORE, (7.0, 5.0, 3.0))
    assert (after.w[0], after.w[2]) == pytest.approx((7.0, 3.0), rel=1e-14)


def test_the_impact_is_the_same_however_the_axes_lie():
    q, r = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    q *= np.sign(np.linalg.det(q))
    v, w = np.array([3.0, 2.0, -4.0]), np.array([1.0, 5.0, -2.0])
    here = struck(matrix_of(), surface(), tuple(v), tuple(w))
    there = struck(matrix_of(), surface(), tuple((q @ v).tolist()), tuple((q @ w).tolist()), tuple(q[:, 2].tolist()))
    np.testing.assert_allclose(there.v, q @ here.v, atol=1e-13)
    np.testing.assert_allclose(there.w, q @ here.w, atol=1e-12)


def test_the_drawn_states_have_the_mean_and_covariance_that_were_asked_for():
    """A x has the mean M x, and the covariance X C X^T if C is that of the coefficients; few draws reach a limit."""
    drawn = np.array([state_after(matrix_of(0.05), falling_rock(rock=i)) for i in range(DRAWS)])
    X = np.kron(np.eye(3), STATE)
    covariance = X @ (0.05**2 * (0.7 * np.eye(9) + 0.3)) @ X.T
    mean = np.array(MEAN) @ STATE
    errors = np.sqrt(np.diag(covariance) / DRAWS)
    np.testing.assert_array_less(np.abs(drawn.mean(0) - mean), SIX_SIGMA * errors)
    spread = np.sqrt((covariance**2 + np.outer(np.diag(covariance), np.diag(covariance))) / DRAWS)
    np.testing.assert_array_less(np.abs(np.cov(drawn.T) - covariance), SIX_SIGMA * spread)


def test_each_impact_of_each_rock_draws_anew_and_the_same_again():
    one = state_after(matrix_of(), falling_rock(impacts=3, rock=5))
    assert np.array_equal(one, state_after(matrix_of(), falling_rock(impacts=3, rock=5)))
    assert not np.array_equal(one, state_after(matrix_of(), falling_rock(impacts=4, rock=5)))
    assert not np.array_equal(one, state_after(matrix_of(), falling_rock(impacts=3, rock=6)))


def test_a_draw_that_would_send_the_rock_into_the_ground_leaves_it_the_means_speed_off_it():
    """v_n' has a mean of 0.1 x 4 m/s and a standard deviation of 4 m/s or more, so about half of the draws do so."""
    wide = StochasticMatrix(np.diag([0.8, 0.1, 0.0]), np.diag([0.0] * 4 + [1.0] + [0.0] * 4))
    away = np.array([state_after(wide, falling_rock(rock=i))[1] for i in range(400)])
    means = np.isclose(away, 0.4, rtol=1e-12)
    assert 120 < means.sum() < 250 and away.min() > 0.0


def test_a_mean_that_drives_the_rock_into_the_ground_leaves_it_on_it():
    after = struck(matrix_of(0.0, np.diag([0.8, -0.5, 0.0])), surface(), BEFORE)
    assert after.v == pytest.approx((4.8, 0.0, 0.0), abs=1e-14)


def test_a_matrix_that_would_make_energy_keeps_it_and_the_direction():
    after = struck(matrix_of(0.0, 2.0 * np.eye(3)), surface(), BEFORE, SPIN)
    assert energy(after) == pytest.approx(energy(Motion(0.0, ZERO, BEFORE, SPIN)), rel=1e-14)
    assert after.v[0] / after.v[2] == pytest.approx(6.0 / 4.0, rel=1e-14)


def test_a_singular_covariance_has_a_factor():
    once = np.ones((9, 9))
    once[4] = once[:, 4] = 0.0
    root = cholesky(once)
    np.testing.assert_allclose(root @ root.T, once, atol=1e-14)
    assert np.array_equal(root, np.tril(root))


@pytest.mark.parametrize("rank", [1, 4, 9])
def test_the_factor_of_a_covariance_gives_it_back(rank):
    some = np.random.default_rng(rank).normal(size=(9, rank))
    covariance = some @ some.T
    root = cholesky(covariance)
    np.testing.assert_allclose(root @ root.T, covariance, atol=1e-12)
    if rank == 9:
        np.testing.assert_allclose(root, np.linalg.cholesky(covariance), atol=1e-10)


def test_the_same_seed_flies_the_same_and_another_does_not():
    over = engine_over("reference", rough_grid(6, 40.0, 0.6, 0.3, seed=2))
    x = np.column_stack([np.linspace(3, 9, 12), np.full(12, 20.0), np.full(12, 6.0)])
    physics = [flight_with(matrix_of(SPREAD), surface(), seed=seed) for seed in (1, 1, 2)]
    one, same, other = (fly(over, p, x) for p in physics)
    assert same_bits(one, same) and not same_bits(one, other)


def test_a_model_that_draws_and_asks_says_so():
    assert StochasticMatrix.draws and StochasticMatrix.asks_rock
