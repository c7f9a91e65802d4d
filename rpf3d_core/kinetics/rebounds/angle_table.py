"""Rebound with a restitution that depends on the angle of impact, from the user's own table.

The angle is between velocity and surface: 90 degrees for a rock that falls straight onto the surface. Tests show that
R_n falls and R_t rises with this angle (Heidenreich 2004, EPFL thesis 3084; Wang et al. 2018, NHESS 18:3045). At small
angles R_n may be above 1: a rock that hits the ground at a low angle trips over its corners, and turns speed along the
ground and spin into height. A lumped mass has no energy of spin. The model therefore limits the energy gained along the
normal to the energy lost along the ground: kinetic energy never rises.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import RemainingBounces, endless, rebound, rest_of_bounces
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import add, dot, norm, scale, without

DEGREES = 180.0 / math.pi


class AngleTable(NamedTuple):
    """Rebound model with a table of restitution over the angle of impact.

    angle : (N,) degrees, ascending, 0 to 90; R_n, R_t : (N,) (-), linear between the angles, constant beyond them
    """

    angle: Any
    R_n: Any
    R_t: Any


@rebound.rule(AngleTable)
def by_angle(model: AngleTable, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a lumped mass after an impact with R_n and R_t of the table.

    R_n and R_t of the material are not used.

    n : (3,) unit normal of the ground
    """
    R_n, R_t = restitution_at(model, impact_angle(motion, n))
    return no_faster(R_n, R_t, motion, n)


@kernel
def impact_angle(motion: Motion, n: Vec) -> float:
    """Return the angle between a rock's velocity and the surface of normal n (3,) that it hits, 0 to 90 degrees."""
    return math.atan2(abs(dot(motion.v, n)), norm(without(motion.v, n))) * DEGREES


@kernel
def restitution_at(table: AngleTable, angle: float) -> tuple[float, float]:
    """Return R_n and R_t (-) of a table at an impact angle (degrees), linear between the angles of the table.

    Beyond the first or last angle, the values of this angle are returned.
    """
    last = len(table.angle) - 1
    if angle <= table.angle[0]:
        return float(table.R_n[0]), float(table.R_t[0])
    for i in range(last):
        low, high = float(table.angle[i]), float(table.angle[i + 1])
        if angle <= high:
            share = (angle - low) / (high - low)
            return _between(table.R_n, i, share), _between(table.R_t, i, share)
    return float(table.R_n[last]), float(table.R_t[last])


@kernel
def _between(column: Any, i: int, share: float) -> float:
    """Return the value in a column of a table between row i and the next row, linear in `share` (0 to 1).

    If both rows are equal, the result is exactly their value.
    """
    low = float(column[i])
    return low + share * (float(column[i + 1]) - low)


@kernel
def no_faster(R_n: float, R_t: float, motion: Motion, n: Vec) -> Motion:
    """Return the motion of a lumped mass after an impact with any R_n >= 0, without a gain of kinetic energy.

    The rock leaves the ground with the speed min(R_n v_n, sqrt(v_n^2 + (1 - R_t^2) v_t^2)) along the normal, v_n and
    v_t its speeds into and along the ground before the impact. R_t must be at most 1.
    n : (3,) unit normal of the ground
    """
    v_n, v_t = -dot(motion.v, n), without(motion.v, n)
    away = R_n * v_n
    if R_n > 1.0:
        away = min(away, math.sqrt(v_n * v_n + (1.0 - R_t * R_t) * dot(v_t, v_t)))
    return Motion(t=motion.t, x=motion.x, v=add(scale(away, n), scale(R_t, v_t)), w=motion.w)


@rest_of_bounces.rule(AngleTable)
def by_angle_rest(
    model: AngleTable, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return `RemainingBounces` with `ends` False, which means that the sum of the remaining bounces is unknown.

    Each bounce changes the next impact angle; after impacts at a small angle, bounces may even grow. So each bounce is
    computed as a flight.
    """
    return endless(motion)
