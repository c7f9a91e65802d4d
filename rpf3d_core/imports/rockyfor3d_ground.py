"""What Rockyfor3D's ground codes mean (physics reference 1.9).

All numbers here are unconfirmed, for its manual was not read. They go into the scene file as values to be looked at,
never into a kernel.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rpf3d_core.terrain.frame import FloatArray

MOH_SHARES = (0.70, 0.20, 0.10)
"""How often a rock meets an obstacle of the height rg70, rg20 and rg10. Unconfirmed."""
VARIATION = 0.1
"""R_t varies by this share to either side, evenly. Unconfirmed."""
LEAST_R_T, MOST_R_T = 0.1, 0.99
"""What R_t is cut off at. Unconfirmed."""
STEPS = 1000
"""Numbers that stand for an even variation in a mean: its error is below 1e-6."""


class Soil(NamedTuple):
    """A soil type: what it is, and the range of R_n (-)."""

    name: str
    low: float
    high: float


SOILS = (
    Soil("river, swamp or other ground that a block goes into whole", 0.0, 0.0),
    Soil("fine soil, deeper than about 1 m", 0.21, 0.25),
    Soil("fine soil of less than about 1 m, or a mix of sand and gravel", 0.25, 0.31),
    Soil("scree below about 10 cm, soil with small fragments of rock, or forest road", 0.30, 0.36),
    Soil("talus above about 10 cm, or compact soil with large fragments of rock", 0.34, 0.42),
    Soil("bedrock with a thin cover of weathered material", 0.39, 0.47),
    Soil("bedrock", 0.48, 0.58),
    Soil("asphalt road", 0.32, 0.39),
)
"""By their code. The codes and what they stand for are confirmed by another program that writes them; R_n is not."""

SWALLOWS = 0
"""The code of ground that blocks stop in."""


class CoefficientSpread(NamedTuple):
    """Mean, standard deviation, least and largest of a coefficient (-)."""

    mean: float
    sd: float
    low: float
    high: float


def energy_share(moh: Sequence[float], radius: float) -> FloatArray:
    """R_t (3,) (-) of obstacles of heights rg70, rg20 and rg10 (m) for a block (m): 1 / (1 + MOH / R). Unconfirmed.

    The depth that a block sinks in, which belongs to MOH there, is left out: it depends on the speed.
    """
    return np.asarray(1.0 / (1.0 + np.array(moh) / radius))


def tangential_restitution(moh: Sequence[float], radius: float) -> CoefficientSpread:
    """The coefficient (-) of speed along the ground that goes with Rockyfor3D's R_t; radius and heights in m.

    There v_t' = sqrt(R^2 (I w^2 + m v_t^2) R_t / (I + m R^2)), so R_t is a share of energy: a sphere that rolls,
    w = v_t / R, keeps sqrt(R_t) of its speed. (The formula is unconfirmed; the root follows from it.)
    """
    share = energy_share(moh, radius)[:, None]
    evenly = 1.0 + VARIATION * ((2.0 * np.arange(STEPS) + 1.0) / STEPS - 1.0)
    drawn = np.sqrt(np.clip(share * evenly, LEAST_R_T, MOST_R_T))
    ends = np.sqrt(np.clip(share * (1.0 + VARIATION * np.array([-1.0, 1.0])), LEAST_R_T, MOST_R_T))
    weights = np.array(MOH_SHARES)
    mean = float(weights @ drawn.mean(axis=1))
    variance = float(weights @ ((drawn - mean) ** 2).mean(axis=1))
    low, high = float(ends.min()), float(ends.max())
    return CoefficientSpread(min(max(mean, low), high), variance**0.5, low, high)
