"""Rebound with a normal restitution from a single speed: R_n = v_half / (|v_n| + v_half).

A slow impact is nearly elastic, a fast impact is not. At v_half, the rock keeps half of its speed along the normal.
After Bourrier and Dorren, as in PlatRock 2, which allows a v_half of 0 to 50 m/s and proposes 10 m/s. R_n of the
material is not used.
"""

from typing import NamedTuple

from rpf3d_core.kinetics.rebound import RemainingBounces, at_once, lumped, rebound, rest_of_bounces
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import dot


class VHalf(NamedTuple):
    """Rebound model with R_n from the speed into the ground.

    speed : v_half > 0, the speed into the ground (m/s) at which R_n is 1/2
    """

    speed: float


@rebound.rule(VHalf)
def half_at_v_half(model: VHalf, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a lumped mass after an impact, with the material's R_t, and R_n from the rock's speed.

    Energy never rises.

    n : (3,) unit normal of the ground
    """
    return lumped(model.speed / (abs(dot(motion.v, n)) + model.speed), surface.R_t, motion, n)


@rest_of_bounces.rule(VHalf)
def v_half_rest(
    model: VHalf, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return `RemainingBounces` without any bounce: the rock stays on the ground and keeps its speed along the ground.

    The remaining bounces have no finite total time, because R_n tends to 1 for small bounces: bounce k starts with the
    speed v_k off the ground (m/s), and 1 / v_k = 1 / v_0 + k / v_half. After about v_half / (0.14 m/s) bounces, a
    bounce rises only 1 mm.

    If R_t < 1, the bounces that are left out have a finite length. With
        T_0       time of the first of these bounces (s)
        v_0, u_0  speed off the ground and velocity along the ground at the start of this bounce (m/s)
        g_n, g_t  gravity normal to the ground and along the ground (m/s^2)
    the length is at most u_0 T_0 / (1 - R_t) along u_0, and
    g_t (1/2 + R_t / (1 - R_t)) (T_0^2 + 4 v_half v_0 / g_n^2) down the slope.
    """
    return at_once(motion, n)
