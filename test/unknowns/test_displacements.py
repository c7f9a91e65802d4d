"""Tests that displacements of parameter sets are normal, evenly spread, and independent of the parameters."""

import numpy as np
import pytest

from rpf3d_core.unknowns.displacements import displacements
from rpf3d_core.unknowns.parameter_sets import parameter_sets
from rpf3d_core.unknowns.points import spread_points

SETS, MISFIT = 256, 3.0


def moves(seed: int = 1, count: int = SETS, misfit: float = MISFIT) -> np.ndarray:
    values = spread_points(count, 2, seed)
    return displacements(parameter_sets(["a.b", "a.c"], values), misfit, seed)


def test_displacements_are_normal_in_both_directions() -> None:
    found = np.sort(moves(), axis=0)
    shares, quantiles = (0.025, 0.25, 0.5, 0.75, 0.975), (-1.960, -0.6745, 0.0, 0.6745, 1.960)
    for column in found.T / MISFIT:
        assert np.quantile(column, shares).tolist() == pytest.approx(quantiles, abs=0.2)
    assert found.std(axis=0) == pytest.approx(MISFIT, rel=0.05)


def test_displacements_do_not_follow_the_parameters_or_each_other() -> None:
    values = spread_points(SETS, 2, 1)
    correlation = np.corrcoef(np.hstack([values, moves()]).T)
    assert abs(correlation - np.eye(4)).max() < 0.12


def test_displacements_scale_with_the_misfit_and_depend_on_the_seed_alone() -> None:
    assert moves(misfit=6.0) == pytest.approx(2.0 * moves())
    assert moves().tobytes() == moves().tobytes() != moves(seed=2).tobytes()
    assert moves(count=64).tobytes() == moves()[:64].tobytes()
