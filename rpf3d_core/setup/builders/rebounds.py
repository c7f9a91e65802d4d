"""Build the rebound models of a scene that need more than copies of numbers in the scene."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.rebounds import AngleTableSpec, MassScaledSpec, StochasticMatrixSpec
from rpf3d_core.scene.models.spec import loaded
from rpf3d_core.terrain.facets import Terrain

Floats = NDArray[np.float64]


WYLLIE = "rpf3d_core.kinetics.rebounds.wyllie:Wyllie"


def mass_scaled(spec: MassScaledSpec, scene: Scene, terrain: Terrain) -> Any:
    """Return the rebound model `mass_scaled`; if the scene gives no K, R_n does not depend on the speed."""
    return spec.physics()(spec.C, math.inf if spec.K is None else spec.K)


def angle_table(spec: AngleTableSpec, scene: Scene, terrain: Terrain) -> Any:
    """Return the rebound model `angle_table` with the scene's table, or the law that the scene names instead."""
    if spec.rows is None:
        return loaded(WYLLIE)()
    return spec.physics()(*(np.ascontiguousarray(column) for column in np.array(spec.rows, dtype=float).T))


def stochastic_matrix(spec: StochasticMatrixSpec, scene: Scene, terrain: Terrain) -> Any:
    """Return the rebound model `stochastic_matrix`, with means and the Cholesky factor for correlated draws."""
    return spec.physics()(np.array(spec.mean, dtype=float), cholesky(np.array(spec.covariance, dtype=float)))


def cholesky(covariance: Floats) -> Floats:
    """Return the lower triangular matrix L (N, N) with L L^T = covariance (N, N), to draw correlated numbers.

    The covariance may be singular, although NumPy's own factor refuses such matrices. If the earlier variables
    determine a variable completely, the column of this variable is zero.
    """
    left = np.array(covariance, dtype=float)
    root = np.zeros_like(left)
    least = len(left) * np.finfo(float).eps * float(np.abs(left).max(initial=0.0))
    for k in range(len(left)):
        if left[k, k] <= least:
            continue
        root[k:, k] = left[k:, k] / math.sqrt(left[k, k])
        left[k:, k:] -= np.outer(root[k:, k], root[k:, k])
    return root
