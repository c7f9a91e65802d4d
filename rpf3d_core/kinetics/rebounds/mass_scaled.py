"""Rebound with a normal restitution that falls with the mass of the rock.

v_n' = -R_n v_n / ((1 + (m / C)^2) (1 + (v_n / K)^2)), m the mass of the rock, v_n its velocity into the ground, and
C = 1000 kg (as in the public program pyrockfall). K is a speed; without scaling by speed, K is infinite. RocFall can
scale R_n by mass and by speed (RocFall's help pages), but the formula is not published. It is UNCONFIRMED that
RocFall's formula is the formula above.
"""

from typing import NamedTuple

from rpf3d_core.kinetics.rebound import RemainingBounces, lumped, rebound, rest_of_bounces, sum_of_bounces
from rpf3d_core.kinetics.rebounds.velocity_scaled import halved
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import dot


class MassScaled(NamedTuple):
    """Rebound model with an R_n that falls with the mass and the speed of the rock.

    C : mass (kg) at which R_n is half of the material's R_n
    K : speed into the ground (m/s) at which R_n is half of the material's R_n; inf for no scaling by speed
    """

    C: float
    K: float
    asks_rock = True  # type: ignore[misc]


@rebound.rule(MassScaled)
def mass_scaled(model: MassScaled, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a lumped mass after an impact, with R_n scaled by mass and speed. Energy never rises.

    n : (3,) unit normal of the ground
    """
    R_n = surface.R_n * halved(rock.rock.mass / model.C)  # type: ignore[union-attr]  # asks_rock
    return lumped(R_n * halved(dot(motion.v, n) / model.K), surface.R_t, motion, n)


@rest_of_bounces.rule(MassScaled)
def mass_scaled_rest(
    model: MassScaled, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return the sum of all remaining bounces on a plane of normal n (3,), with R_n scaled by mass but not by speed.

    `velocity_scaled_rest` states the error that the missing scaling by speed causes.

    gravity : m/s^2, above 0
    """
    R_n = surface.R_n * halved(rock.rock.mass / model.C)  # type: ignore[union-attr]  # asks_rock
    return sum_of_bounces(R_n, surface.R_t, motion, n, gravity)
