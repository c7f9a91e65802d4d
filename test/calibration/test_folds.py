"""Tests of scores on kept-out observations: folds, the curve without physics, ranks and coverage."""

from math import erf, gamma, pi, prod, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rpf3d_core.calibration.density import Stops
from rpf3d_core.calibration.findings import _ranks
from rpf3d_core.calibration.folds import (
    covered,
    curve_score,
    folds_of,
    misfit_weights,
    predictive_score,
    ranks,
    weights_without,
)
from rpf3d_core.calibration.likelihood import ASTRAY, Weighed

RANDOM = np.random.default_rng(3)


def test_each_observation_is_kept_out_once_in_folds_of_equal_size() -> None:
    folds = folds_of(41, seed=1)
    assert sorted(np.bincount(folds).tolist()) == [8, 8, 8, 8, 9]
    assert folds_of(3, seed=1).max() == 2


ANYWHERE = 1e-4


def student(z: float, count: int, sd: float) -> float:
    """Return Student's predictive density, with count - 1 degrees of freedom, of one more stop at z from the mean.

    sd : standard deviation of the `count` stops
    """
    n, scale = count - 1, sd * sqrt(1 + 1 / count)
    return gamma((n + 1) / 2) / (gamma(n / 2) * sqrt(n * pi) * scale) * (1 + (z / scale) ** 2 / n) ** (-(n + 1) / 2)


@pytest.mark.parametrize("count", [3, 20])
def test_the_curve_is_fitted_without_the_fold_that_it_predicts(count: int) -> None:
    seen = RANDOM.normal(10.0, 2.0, (count, 2))
    folds = folds_of(count, seed=2)
    score = curve_score(seen, folds, 0.5, ANYWHERE)
    for k in range(count):
        rest = seen[folds != folds[k]]
        mean, sd = rest.mean(axis=0), np.maximum(rest.std(axis=0, ddof=1), 0.5)
        density = prod(student(seen[k, d] - mean[d], len(rest), sd[d]) for d in range(2))
        assert score.each[k] == pytest.approx(np.log((1 - ASTRAY) * density + ASTRAY * ANYWHERE))


def test_a_curve_is_not_surer_than_the_measurement() -> None:
    """For stops on one line across the slope, the curve of this axis has the measuring error, at least 0.1 m."""
    line = np.stack([RANDOM.normal(0.0, 5.0, 20), np.zeros(20)], axis=1)
    folds = folds_of(20, seed=2)
    along = curve_score(line[:, :1], folds, 0.5, 0.0).each
    for error, sd in ((0.5, 0.5), (0.0, 0.1)):
        across = np.log(student(0.0, 16, sd))
        np.testing.assert_allclose(curve_score(line, folds, error, 0.0).each, along + across)


def test_one_odd_stop_cannot_decide_the_score_of_a_curve() -> None:
    seen = np.concatenate([RANDOM.normal(0.0, 1.0, (99, 2)), [[1e6, 1e6]]])
    assert curve_score(seen, folds_of(100, seed=1), 0.5, ANYWHERE).each[-1] == pytest.approx(np.log(ASTRAY * ANYWHERE))


def test_counts_do_not_tell_a_fold_about_the_stops_that_it_keeps_out() -> None:
    """Of two sets, the stops favour none, and a count (the last observation) the second; folds ignore the count."""
    logs = np.zeros((3, 2, 1, 5))
    logs[:, 1, 0, 4] = 3.0
    weighed = Weighed(log_densities=logs, counts=np.array([1.0, 1.0, 1.0, 1.0, 10.0]))
    folds = np.array([0, 1, 0, 1])
    blind = weights_without(np.zeros(2), weighed, folds, np.array([4]))
    np.testing.assert_allclose(blind[:, :, 0], 0.5)
    assert weights_without(np.zeros(2), weighed, folds, np.array([], dtype=int))[0, 1, 0] > 0.99


def test_a_score_is_the_log_of_the_mean_density_over_sets() -> None:
    densities = np.array([[[0.2, 0.4]], [[0.6, 0.0]]])  # two sets, one misfit, two observations
    weights = np.array([[[0.25], [0.75]]])
    expected = (1 - ASTRAY) * np.array([0.5, 0.1]) + ASTRAY * 0.01
    np.testing.assert_allclose(predictive_score(weights, densities, 0.01).each, np.log(expected))


def test_ranks_are_predicted_probabilities_and_ignore_lost_rocks() -> None:
    place = RANDOM.normal(0.0, 1.0, (20_000, 2))
    lost = Stops(np.full((50, 2), 1e6), np.zeros(50, dtype=bool))
    seen = np.array([[-1.0, 0.5], [0.0, 2.0]])
    found = ranks([Stops(place, np.ones(len(place), dtype=bool)), lost], np.full((2, 2, 1), 0.5), seen, np.zeros(1))
    expected = [[0.5 * (1 + erf(x / sqrt(2))) for x in row] for row in seen]
    np.testing.assert_allclose(found, expected, atol=0.012)


def test_a_block_is_predicted_by_the_rocks_that_stand_for_it() -> None:
    """Two kinds of rocks stop 10 m apart, and most of the second leave; a block is compared with its own kind only."""
    near, far = (RANDOM.normal(mean, 1.0, (20_000, 2)) for mean in (0.0, 10.0))
    deposited = np.concatenate([np.ones(20_000, dtype=bool), np.arange(20_000) % 4 == 0])
    kind = np.repeat([0, 1], 20_000)
    alike = (kind[None, :] == np.array([[0], [1], [0]])).astype(float)
    seen = np.array([[-1.0, 0.5], [9.0, 10.5], [9.0, 10.5]])
    stops = [Stops(np.concatenate([near, far]), deposited)]
    found = ranks(stops, np.ones((3, 1, 1)), seen, np.zeros(1), alike)
    expected = [0.5 * (1 + erf(x / sqrt(2))) for x in seen[0]]
    np.testing.assert_allclose(found[:2], [expected, expected], atol=0.015)
    np.testing.assert_allclose(found[2], 1.0, atol=1e-6)


def test_sets_count_by_the_share_of_a_blocks_own_rocks_that_stopped() -> None:
    """In one set all rocks of a block stop at 0 m, in the other half of them at 10 m: two of three stops are at 0 m."""
    half = np.arange(20_000) % 2 == 0
    stops = [Stops(RANDOM.normal(0.0, 0.1, (20_000, 2)), np.ones(20_000, dtype=bool)),
             Stops(RANDOM.normal(10.0, 0.1, (20_000, 2)), half)]  # fmt: skip
    for alike in (None, np.ones((1, 20_000))):
        found = ranks(stops, np.full((1, 2, 1), 0.5), np.full((1, 2), 5.0), np.zeros(1), alike)
        np.testing.assert_allclose(found, 2.0 / 3.0, atol=1e-9)


def test_a_block_whose_own_rocks_all_left_has_no_prediction() -> None:
    """All rocks of the second kind left; rank 0 would mean that all of them went farther than the block."""
    kind = np.repeat([0, 1], 100)
    stops = [Stops(RANDOM.normal(0.0, 1.0, (200, 2)), kind == 0)] * 2
    alike = (kind[None, :] == np.array([[0], [1]])).astype(float)
    found = ranks(stops, np.full((2, 2, 1), 0.5), np.zeros((2, 2)), np.zeros(1), alike)
    assert (np.abs(found[0] - 0.5) < 0.2).all() and np.isnan(found[1]).all()
    little = np.where(kind[None, :] == np.array([[0], [1]]), 1.0, 1e-9)  # weights of unlike masses are never exactly 0
    assert np.isnan(ranks(stops, np.full((2, 2, 1), 0.5), np.zeros((2, 2)), np.zeros(1), little)[1]).all()


def test_blocks_without_a_prediction_are_counted_apart() -> None:
    kind = np.repeat([0, 1], 100)
    stops = [Stops(RANDOM.normal(0.0, 1.0, (200, 2)), kind == 0)]
    alike = (kind[None, :] == np.array([[0], [1], [0]])).astype(float)
    slope: Any = SimpleNamespace(field=SimpleNamespace(stops=np.zeros((3, 2))), error=0.5, misfits=np.zeros(1),
                                 alike=alike)  # fmt: skip
    found = _ranks(slope, stops, np.ones((3, 1, 1)))
    assert found["rank"].shape == found["whole_rank"].shape == (2, 2) and found["unpredicted"] == 1
    assert np.isfinite(found["rank"]).all()
    slope.alike = (kind[None, :] == np.ones((3, 1))).astype(float)
    none = _ranks(slope, stops, np.ones((3, 1, 1)))
    assert none["unpredicted"] == 3 and none["rank"].shape == none["whole_rank"].shape == (0, 2)


def test_rocks_that_are_not_ranked_count_as_stopped() -> None:
    """Few rocks of one of 25 shapes stopped, and most of these are not among the rocks that ranks use."""
    sets, rocks, shapes = 1000, 500, 25
    kind, deposited = np.arange(rocks) % shapes, np.ones(rocks, dtype=bool)
    stops = []
    for number in range(sets):
        kept = deposited.copy()
        own = np.flatnonzero(kind == 0)
        kept[own] = False
        kept[own[-1]] = number % 6 == 0  # the last rock of the shape, behind the rocks that are ranked
        kept[own[0]] = number % 100 == 0  # rarely the first
        stops.append(Stops(RANDOM.normal(0.0, 1.0, (rocks, 2)), kept))
    alike = (kind == 0).astype(float)[None]
    stopped = np.mean([one.deposited[kind == 0].mean() for one in stops])
    found = ranks(stops, np.full((1, sets, 1), 1.0 / sets), np.zeros((1, 2)), np.zeros(1), alike)
    assert stopped > 5e-3 and np.isfinite(found).all()


def test_book_values_have_the_misfit_that_the_other_folds_show() -> None:
    """Misfit 0 misses all stops, misfit 1 fits them; equal weights would halve the density of a correct prediction."""
    densities = np.array([[1e-6] * 10, [0.1] * 10])
    folds = np.arange(10) % 5
    weights = misfit_weights(densities, folds, ANYWHERE)
    np.testing.assert_allclose(weights[:, 0, 1], 1.0, atol=1e-6)
    two = np.array([[1e-6, 0.1], [0.1, 1e-6]])  # each stop fits another misfit, and must not choose its own misfit
    own = misfit_weights(two, np.array([0, 1]), ANYWHERE)
    for kept_out, other in ((0, 1), (1, 0)):
        logs = np.log((1 - ASTRAY) * two[:, other] + ASTRAY * ANYWHERE)
        np.testing.assert_allclose(own[kept_out, 0], np.exp(logs - np.logaddexp(*logs)))
    assert own[0, 0, 0] > 0.9 and own[1, 0, 1] > 0.9
    np.testing.assert_allclose(misfit_weights(densities[:1], folds, 1e-3), 1.0)


def test_an_error_of_the_model_widens_the_prediction() -> None:
    place = RANDOM.normal(0.0, 1.0, (20_000, 2))
    seen = np.array([[-1.0, 0.5], [0.0, 2.0]])
    weights = np.array([[[0.5, 0.5]], [[0.0, 1.0]]])  # two observations, one set, two errors
    found = ranks([Stops(place, np.ones(len(place), dtype=bool))], weights, seen, np.array([0.0, 3.0]))

    def below(x: float, sd: float) -> float:
        return 0.5 * (1 + erf(x / (sd * sqrt(2))))

    wide = sqrt(1.0 + 9.0)
    np.testing.assert_allclose(found[0], [0.5 * (below(x, 1.0) + below(x, wide)) for x in seen[0]], atol=0.012)
    np.testing.assert_allclose(found[1], [below(x, wide) for x in seen[1]], atol=0.012)


def test_coverage_of_even_ranks_is_the_probability_of_the_interval() -> None:
    even = (np.arange(1000) + 0.5) / 1000
    np.testing.assert_allclose(covered(np.stack([even, np.full(1000, 0.5)], axis=1), 0.9, 1000), [0.9, 1.0], atol=2e-3)
