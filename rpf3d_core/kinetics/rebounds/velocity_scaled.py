"""Rebound with a normal restitution that falls with the speed into the ground.

A hard impact breaks, dents and heats more than a soft impact. R_n of the material is the value for slow impacts:
v_n' = -R_n v_n / (1 + (v_n / K)^2), K = 9.144 m/s (Pfeiffer & Bowen 1989, Bull. AEG 26:135-146, as in the public
programs PlatRock and pyrockfall). RocFall offers this rule for the lumped mass.
"""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import RemainingBounces, lumped, rebound, rest_of_bounces, sum_of_bounces
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import dot


class VelocityScaled(NamedTuple):
    """Rebound model with an R_n that falls with the speed into the ground.

    K : speed into the ground (m/s) at which R_n is half of the material's R_n
    """

    K: float


@kernel
def halved(x: float) -> float:
    """Return the factor 1 / (1 + x^2) that reduces R_n.

    x : speed into the ground or mass of the rock, divided by the value at which R_n is halved (-)
    """
    return 1.0 / (1.0 + x * x)


@rebound.rule(VelocityScaled)
def velocity_scaled(model: VelocityScaled, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a lumped mass after an impact, with R_n scaled by the rock's speed into the ground.

    Energy never rises.

    n : (3,) unit normal of the ground
    """
    return lumped(surface.R_n * halved(dot(motion.v, n) / model.K), surface.R_t, motion, n)


@rest_of_bounces.rule(VelocityScaled)
def velocity_scaled_rest(
    model: VelocityScaled, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return the sum of all remaining bounces with the material's R_n, which is the limit for slow bounces.

    n : (3,) normal of the plane; gravity : m/s^2, above 0

    For a bounce that rises by at most h, v_n^2 is at most 2 g h. The relative error of R_n is therefore at most
    2 g h / K^2 (2.3e-4 at 1 mm). The relative error of the stop's time and place is at most 1 / (1 - R_n) times the
    error of R_n.
    """
    return sum_of_bounces(surface.R_n, surface.R_t, motion, n, gravity)
