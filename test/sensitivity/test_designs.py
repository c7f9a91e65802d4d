"""Tests of the estimators of Morris and Sobol, on functions with known effects and indices."""

import numpy as np

from rpf3d_core.sensitivity.morris import LEVELS, STEP, effects_of, trajectories
from rpf3d_core.sensitivity.sobol import design, indices_of


def test_each_step_of_a_trajectory_moves_one_unknown_and_stays_in_the_cube() -> None:
    paths = trajectories(50, 5, seed=3)
    steps = np.diff(paths, axis=1)
    assert ((np.abs(steps) > 0).sum(axis=2) == 1).all()
    np.testing.assert_allclose(np.abs(steps).max(axis=2), LEVELS / (2 * (LEVELS - 1)), rtol=1e-12)
    assert sorted(np.argmax(np.abs(steps[0]), axis=1)) == [0, 1, 2, 3, 4]
    assert paths.min() >= 0.0
    assert paths.max() <= 1.0 + 1e-12


def test_effects_of_a_linear_function_are_its_slopes_times_the_step() -> None:
    slopes = np.array([[3.0, 0.0], [-7.0, 2.0], [0.5, 0.0]])
    paths = trajectories(8, 3, seed=1)
    found = effects_of(paths, paths @ slopes + 4.0, seed=1)
    np.testing.assert_allclose(found.size, np.abs(slopes) * STEP, atol=1e-12)
    np.testing.assert_allclose(found.spread, 0.0, atol=1e-12)
    np.testing.assert_allclose([found.low, found.high], [np.abs(slopes) * STEP] * 2, atol=1e-12)


def test_an_interaction_shows_as_spread() -> None:
    paths = trajectories(200, 2, seed=2)
    found = effects_of(paths, np.prod(paths, axis=2)[..., None], seed=2)
    # Of u v the effect of u is v: on average 1/2 over the levels 0, 1/3, 2/3, 1, with variance 5/36.
    np.testing.assert_allclose(found.size[:, 0], 0.5 * STEP, atol=4 * (5 / 36 / 200) ** 0.5)
    np.testing.assert_allclose(found.spread[:, 0], STEP * (5 / 36) ** 0.5, rtol=0.1)


def test_no_effect_is_larger_than_the_range_of_the_result() -> None:
    paths = trajectories(40, 2, seed=4)
    found = effects_of(paths, (paths[..., :1] > 0.5).astype(float), seed=4)
    assert found.size[0, 0] == found.high[0, 0] == 1.0 and found.size[1, 0] == 0.0


def ishigami(u: np.ndarray) -> np.ndarray:
    """Return the function of Ishigami & Homma 1990 with a = 7 and b = 0.1; u : (..., 3), in the unit cube."""
    x = np.pi * (2.0 * u - 1.0)
    return np.sin(x[..., 0]) + 7.0 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])


def test_indices_of_ishigamis_function_are_those_of_the_closed_form() -> None:
    a, b, pi = 7.0, 0.1, np.pi
    first = np.array([0.5 * (1 + b * pi**4 / 5) ** 2, a**2 / 8, 0.0])
    both = 8 * b**2 * pi**8 / 225
    variance = first.sum() + both
    total = first + both * np.array([1.0, 0.0, 1.0])
    found = indices_of(ishigami(design(4096, 3, seed=5))[..., None], seed=5)
    np.testing.assert_allclose(found.first[:, 0], first / variance, atol=0.02)
    np.testing.assert_allclose(found.total[:, 0], total / variance, atol=0.02)
    assert (found.first_ends[0] <= found.first).all()
    assert (found.first <= found.first_ends[1]).all()


def test_a_result_that_nothing_moves_has_no_indices() -> None:
    found = indices_of(np.full((16, 5, 1), 2.5), seed=1)
    assert np.isnan(found.total).all()
    assert np.isnan(found.first_ends).all()
