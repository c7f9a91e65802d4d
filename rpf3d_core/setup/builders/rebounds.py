"""Rebound models whose parameters are not simply the numbers of the scene."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.offers import loaded
from rpf3d_core.scene.rebounds import AngleTableSpec, MassScaledSpec, StochasticMatrixSpec
from rpf3d_core.terrain.facets import Terrain

Floats = NDArray[np.float64]


WYLLIE = "rpf3d_core.kinetics.rebounds.wyllie:Wyllie"


def mass_scaled(offer: MassScaledSpec, scene: Scene, terrain: Terrain) -> Any:
    """The model, with no scaling by speed where the scene names no K."""
    return offer.physics()(offer.C, math.inf if offer.K is None else offer.K)


def angle_table(offer: AngleTableSpec, scene: Scene, terrain: Terrain) -> Any:
    """The table of the scene, or the law that it names."""
    if offer.rows is None:
        return loaded(WYLLIE)()
    return offer.physics()(*(np.ascontiguousarray(column) for column in np.array(offer.rows, dtype=float).T))


def stochastic_matrix(offer: StochasticMatrixSpec, scene: Scene, terrain: Terrain) -> Any:
    """The means, and the Cholesky factor of the covariance."""
    return offer.physics()(np.array(offer.mean, dtype=float), cholesky(np.array(offer.covariance, dtype=float)))


def cholesky(covariance: Floats) -> Floats:
    """The lower triangular L (N, N) with L L^T = covariance (N, N), which may be singular.

    Where a variable has no variance left beside those before it, its column is zero (NumPy's own factor refuses that).
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
