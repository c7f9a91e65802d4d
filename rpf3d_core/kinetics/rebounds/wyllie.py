"""Rebound by Wyllie's law: R_n is a power of the impact angle (for a table of angles, see `angle_table`).

Wyllie 2014, Rock Fall Engineering: R_n = 19.5 theta^-1.03, theta in degrees between velocity and surface. The constants
are those in the source code of RockGIS, which limits R_n to 2. R_t is the material's. Kinetic energy never rises
(`no_faster`).
"""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import RemainingBounces, endless, rebound, rest_of_bounces
from rpf3d_core.kinetics.rebounds.angle_table import impact_angle, no_faster
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec

FACTOR = 19.5
EXPONENT = -1.03
MOST = 2.0
"""Largest R_n (-) of Wyllie's law, reached at 9.1 degrees and below."""
FLAT = 1.0
"""Angle (degrees) below which the power is not evaluated; R_n reaches its largest value far above this angle."""


class Wyllie(NamedTuple):
    """Rebound model with R_n from the impact angle and R_t from the material."""


@rebound.rule(Wyllie)
def wyllie(model: Wyllie, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a lumped mass after an impact with R_n of Wyllie's law; R_n of the material is not used.

    n : (3,) unit normal of the ground
    """
    return no_faster(wyllie_R_n(impact_angle(motion, n)), surface.R_t, motion, n)


@kernel
def wyllie_R_n(angle: float) -> float:
    """Return R_n (-) by Wyllie's law at an impact angle (degrees), limited to 2, its value at 9.1 degrees and below."""
    return min(MOST, FACTOR * float(max(angle, FLAT) ** EXPONENT))


@rest_of_bounces.rule(Wyllie)
def wyllie_rest(
    model: Wyllie, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return `RemainingBounces` with `ends` False, which means that the sum of the remaining bounces is unknown.

    Each bounce changes the next impact angle. So each bounce is computed as a flight.
    """
    return endless(motion)
