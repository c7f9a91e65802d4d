"""Normal restitution from a single speed: R_n = v_half / (|v_n| + v_half).

A soft impact is elastic, a hard one is not; at v_half, half of the speed into the ground is left. After Bourrier and
Dorren, as PlatRock 2 has it (CC; it allows 0 to 50 m/s and proposes 10; physics reference 1.11). R_n of the material
is not used.
"""

from typing import NamedTuple

from rpf3d_core.kinetics.rebound import Rest, at_once, lumped, rebound, rest_of_bounces
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import dot


class VHalf(NamedTuple):
    """speed : v_half, m/s into the ground at which half of that speed is given back, above 0."""

    speed: float


@rebound.rule(VHalf)
def half_at_v_half(model: VHalf, surface: Surface, motion: Motion, n: Vec, falling: RockContext) -> Motion:
    """A lumped mass with the material's R_t. Energy never rises."""
    return lumped(model.speed / (abs(dot(motion.v, n)) + model.speed), surface.R_t, motion, n)


@rest_of_bounces.rule(VHalf)
def v_half_rest(model: VHalf, surface: Surface, motion: Motion, n: Vec, gravity: float, falling: RockContext) -> Rest:
    """The bouncing ends where it is: here it has no end of its own, for R_n tends to 1.

    1 / v_k = 1 / v_0 + k / v_half, so the times of all bounces add up to no finite number, and a rise of 1 mm is
    reached after some v_half / (0.14 m/s) of them. What is left out has a finite length: with T_0 the time of the first
    bounce left out and v_0 the speed that it begins with, no more than u_0 T_0 / (1 - R_t) along its speed u_0 and
    g_t (1/2 + R_t / (1 - R_t)) (T_0^2 + 4 v_half v_0 / g_n^2) down the slope.
    """
    return at_once(motion, n)
