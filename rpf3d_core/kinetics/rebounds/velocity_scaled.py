"""Normal restitution that falls with the speed into the ground.

A hard impact breaks, dents and heats more than a soft one. R_n of the material is that of slow impacts:
v_n' = -R_n v_n / (1 + (v_n / K)^2), K = 9.144 m/s (Pfeiffer & Bowen 1989, Bull. AEG 26:135-146, as public
implementations have it; RocFall offers it for the lumped mass; physics reference 1.2 and 1.4, CC).
"""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import Rest, lumped, rebound, rest_of_bounces, sum_of_bounces
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import dot


class VelocityScaled(NamedTuple):
    """K : m/s into the ground at which half of the material's R_n is left."""

    K: float


@kernel
def halved(x: float) -> float:
    """1 / (1 + x^2): the share that is left of a coefficient, half of it at x = 1."""
    return 1.0 / (1.0 + x * x)


@rebound.rule(VelocityScaled)
def velocity_scaled(model: VelocityScaled, surface: Surface, motion: Motion, n: Vec, falling: RockContext) -> Motion:
    """A lumped mass with the material's R_t, and R_n scaled by its speed into the ground. Energy never rises."""
    return lumped(surface.R_n * halved(dot(motion.v, n) / model.K), surface.R_t, motion, n)


@rest_of_bounces.rule(VelocityScaled)
def velocity_scaled_rest(
    model: VelocityScaled, surface: Surface, motion: Motion, n: Vec, gravity: float, falling: RockContext
) -> Rest:
    """The series with the material's R_n, which slow bounces tend to.

    Of a bounce that rises by h at most, v_n^2 = 2 g h: R_n is told too high by a share 2 g h / K^2, 2.3e-4 at 1 mm,
    and time and place of the stop by no more than 1 / (1 - R_n) times that share of what is summed.
    """
    return sum_of_bounces(surface.R_n, surface.R_t, motion, n, gravity)
