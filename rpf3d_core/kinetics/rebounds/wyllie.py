"""Wyllie's law of normal restitution, as an `angle_table` without a table.

Wyllie 2014, Rock Fall Engineering: R_n = 19.5 theta^-1.03, theta in degrees between velocity and surface; figures as
RockGIS has them, which cuts R_n off at 2 (CC; physics reference 1.6). R_t is the material's. Kinetic energy never rises
(`no_faster`).
"""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import Rest, endless, rebound, rest_of_bounces
from rpf3d_core.kinetics.rebounds.angle_table import impact_angle, no_faster
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec

FACTOR = 19.5
EXPONENT = -1.03
MOST = 2.0
"""R_n at which the law is cut off, which it reaches at 9.1 degrees."""
FLAT = 1.0
"""Degrees below which no power need be taken: far below where the law is cut off."""


class Wyllie(NamedTuple):
    """R_n from the angle, R_t from the material."""


@rebound.rule(Wyllie)
def wyllie(model: Wyllie, surface: Surface, motion: Motion, n: Vec, falling: RockContext) -> Motion:
    """A lumped mass with R_n of Wyllie's law; that of the material is not used."""
    return no_faster(wyllie_R_n(impact_angle(motion, n)), surface.R_t, motion, n)


@kernel
def wyllie_R_n(angle: float) -> float:
    """R_n (-) at an angle (degrees)."""
    return min(MOST, FACTOR * float(max(angle, FLAT) ** EXPONENT))


@rest_of_bounces.rule(Wyllie)
def wyllie_rest(model: Wyllie, surface: Surface, motion: Motion, n: Vec, gravity: float, falling: RockContext) -> Rest:
    """Not summed, as `by_angle_rest`."""
    return endless(motion)
