"""Convert Rockyfor3D's ground codes to coefficients of restitution.

All numbers in this file are unconfirmed, because the manual (Dorren 2016, Rockyfor3D (v5.2) revealed) was not
available. The numbers are written into the scene file, where the user must check them. No kernel contains these
numbers.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rpf3d_core.terrain.frame import FloatArray

MOH_SHARES = (0.70, 0.20, 0.10)
"""Shares (-) of impacts that are on an obstacle of height rg70, rg20 and rg10. Unconfirmed."""
VARIATION = 0.1
"""Largest relative change (-) of R_t, up or down, between impacts; the variation is uniform. Unconfirmed."""
LEAST_R_T, MOST_R_T = 0.1, 0.99
"""Smallest and largest R_t (-), Rockyfor3D's tangential coefficient. Unconfirmed."""
STEPS = 1000
"""Number of evenly spaced values for a mean over a uniform distribution; the error of the mean is below 1e-6."""


class Soil(NamedTuple):
    """A soil type of Rockyfor3D: its description and its range of R_n (-), the normal restitution."""

    name: str
    low: float
    high: float


SOILS = (
    Soil(name="river, swamp or other ground that a block goes into whole", low=0.0, high=0.0),
    Soil(name="fine soil, deeper than about 1 m", low=0.21, high=0.25),
    Soil(name="fine soil of less than about 1 m, or a mix of sand and gravel", low=0.25, high=0.31),
    Soil(name="scree below about 10 cm, soil with small fragments of rock, or forest road", low=0.30, high=0.36),
    Soil(name="talus above about 10 cm, or compact soil with large fragments of rock", low=0.34, high=0.42),
    Soil(name="bedrock with a thin cover of weathered material", low=0.39, high=0.47),
    Soil(name="bedrock", low=0.48, high=0.58),
    Soil(name="asphalt road", low=0.32, high=0.39),
)
"""Soil types of Rockyfor3D, by code.

Codes and descriptions are confirmed by another program that writes them; R_n is unconfirmed.
"""

SWALLOWS = 0
"""Soil code of ground in which rocks sink and stop, such as a swamp."""


class CoefficientSpread(NamedTuple):
    """The distribution of a coefficient (-) in the scene: mean, standard deviation, smallest and largest value."""

    mean: float
    sd: float
    low: float
    high: float


def energy_share(moh: Sequence[float], radius: float) -> FloatArray:
    """Return R_t (3,) (-) of Rockyfor3D, the share of energy that a rock keeps, for three heights of obstacles.

    R_t is 1 / (1 + MOH / R), unconfirmed, with obstacle height MOH (rg70, rg20, rg10) and block radius R.

    In Rockyfor3D, the obstacle height MOH includes the penetration depth of the block. This depth is ignored here,
    because the depth depends on the speed.

    moh : (3,) m, obstacle heights; radius : of the block, m
    """
    return np.asarray(1.0 / (1.0 + np.array(moh) / radius))


def tangential_restitution(moh: Sequence[float], radius: float) -> CoefficientSpread:
    """Return the tangential restitution (-) for the scene, a ratio of speeds, that corresponds to Rockyfor3D's R_t.

    In Rockyfor3D v_t' = sqrt(R^2 (I w^2 + m v_t^2) R_t / (I + m R^2)): v_t and v_t' are the speeds along the ground
    before and after an impact, w is the spin, m the mass, I the moment of inertia and R the radius. So R_t is a share
    of energy: a rolling sphere, w = v_t / R, keeps sqrt(R_t) of its speed. (The formula is unconfirmed; the square root
    follows from the formula.)

    moh : (3,) m, obstacle heights; radius : of the block, m
    """
    share = energy_share(moh, radius)[:, None]
    evenly = 1.0 + VARIATION * ((2.0 * np.arange(STEPS) + 1.0) / STEPS - 1.0)
    drawn = np.sqrt(np.clip(share * evenly, LEAST_R_T, MOST_R_T))
    ends = np.sqrt(np.clip(share * (1.0 + VARIATION * np.array([-1.0, 1.0])), LEAST_R_T, MOST_R_T))
    weights = np.array(MOH_SHARES)
    mean = float(weights @ drawn.mean(axis=1))
    variance = float(weights @ ((drawn - mean) ** 2).mean(axis=1))
    low, high = float(ends.min()), float(ends.max())
    return CoefficientSpread(mean=min(max(mean, low), high), sd=variance**0.5, low=low, high=high)
