"""Tests of principal moments and axes, against mpmath with 50 digits."""

import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rpf3d_core.shapes.principal_axes import principal_axes


def symmetric(seed):
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    moments = np.sort(np.random.default_rng(seed).uniform(0.2, 0.39, 3))
    tensor = turn @ np.diag(moments) @ turn.T
    return (tensor + tensor.T) / 2


@pytest.mark.parametrize("seed", range(20))
def test_moments_and_axes_agree_with_50_digits(seed):
    tensor = symmetric(seed)
    moments, axes = principal_axes(tensor.tolist())
    with mpmath.workdps(50):
        exact, vectors = mpmath.eigsy(mpmath.matrix(tensor.tolist()))
        assert moments == pytest.approx([float(value) for value in exact], rel=1e-14)
        for k in range(3):
            cosine = sum(vectors[i, k] * axes[k][i] for i in range(3))
            assert abs(abs(cosine) - 1) < 1e-13
    assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-14)
    assert np.asarray(axes) @ np.transpose(axes) == pytest.approx(np.eye(3), abs=1e-14)


@pytest.mark.parametrize("order", [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)])
def test_a_diagonal_tensor_keeps_the_axes_of_the_input(order):
    diagonal = np.array([1.0, 2.0, 2.5])[list(order)]
    tensor = np.diag(diagonal) + 1e-13 * (np.ones((3, 3)) - np.eye(3))
    moments, axes = principal_axes(tensor.tolist())
    assert moments == (1.0, 2.0, 2.5)
    assert np.array_equal(np.abs(axes).argmax(axis=1), np.argsort(order))
    assert set(np.abs(axes).ravel()) == {0.0, 1.0}
    assert np.linalg.det(axes) == 1.0


@pytest.mark.parametrize("rounding", [0.0, 2e-16, -2e-16, 1e-13, -1e-13])
def test_moments_that_are_equal_to_rounding_become_equal_and_keep_their_order(rounding):
    moments, axes = principal_axes(np.diag([1.0, 1.0 + rounding, 1.0]).tolist())
    assert moments[0] == moments[1] == moments[2]
    assert axes == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def test_moments_that_differ_by_more_than_rounding_stay_different():
    moments, _ = principal_axes(np.diag([1.0 + 1e-9, 1.0, 1.5]).tolist())
    assert moments == (1.0, 1.0 + 1e-9, 1.5)


def test_two_equal_moments_in_turned_axes_are_found():
    turn = Rotation.from_rotvec([0.3, -0.7, 1.1]).as_matrix()
    moments, axes = principal_axes((turn @ np.diag([0.2, 0.2, 0.3]) @ turn.T).tolist())
    assert moments == pytest.approx((0.2, 0.2, 0.3), rel=1e-14)
    assert moments[0] == moments[1]
    assert abs(np.dot(axes[2], turn[:, 2])) == pytest.approx(1.0, abs=1e-14)
