"""Rebound by the velocity transform of the thesis, exactly as printed; only for the reproduction of its results."""

import math
from typing import NamedTuple

from rpf3d_core.kinetics.rebound import RemainingBounces, at_once, rebound, rest_of_bounces
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import add, dot, scale


class ThesisLiteral(NamedTuple):
    """Rebound model with the thesis' equations 2-3 to 2-8 as printed, for reproduction only."""


@rebound.rule(ThesisLiteral)
def thesis_literal(model: ThesisLiteral, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a rock after an impact by equations 2-3 to 2-8 of the thesis exactly as printed.

    These equations transform the velocity to axes along the ground, and back to x, y, z. Equations 3-1 to 3-3 multiply
    the velocity by R_n and R_t between the two transforms. theta and phi are the slopes of the ground along x and y,
    positive where the ground rises: only in this reading is 2-3 equal to v . n for a plane that dips along one axis.
    The printed transform is not orthonormal (docs/explanation/physics.md, "How does a rock rebound?"). At R_n = R_t = 1
    a rock loses speed on a slope along one axis; on a slope along both axes, it may rebound with up to three times its
    energy. If the transform would send the rock into the ground, the speed into the ground is dropped.

    n : (3,) unit normal of the ground
    """
    theta, phi = math.atan2(-n[0], n[2]), math.atan2(-n[1], n[2])
    st, ct, sp, cp = math.sin(theta), math.cos(theta), math.sin(phi), math.cos(phi)
    vx, vy, vz = motion.v
    v_n = surface.R_n * (vz * ct * cp - vx * st - vy * sp)
    v_tx = surface.R_t * (vz * st * cp + vx * ct)
    v_ty = surface.R_t * (vz * sp * ct + vy * cp)
    v = (v_tx * ct + v_n * sp * ct, v_ty * cp + v_n * st * cp, v_tx * st + v_ty * sp - v_n * ct * cp)
    return Motion(t=motion.t, x=motion.x, v=add(v, scale(max(-dot(v, n), 0.0), n)), w=motion.w)


@rest_of_bounces.rule(ThesisLiteral)
def thesis_rest(
    model: ThesisLiteral, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return `RemainingBounces` without any bounce, because the sum of the remaining bounces has no closed form.

    The rock stays on the ground and keeps its speed along the ground.
    """
    return at_once(motion, n)
