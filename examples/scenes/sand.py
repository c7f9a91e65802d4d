"""A rebound model of your own: loose sand on the benches of a pit."""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import rebound
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import add, dot, scale, without


class Sand(NamedTuple):
    """A rebound model whose R_n decreases with the speed of the impact.

    speed : speed (m/s) into the ground at which half of the material's R_n is left
    """

    speed: float = 5.0


@kernel
def softened(R_n: float, speed: float, into: float) -> float:
    """Return R_n (-) at an impact.

    R_n : normal restitution (-) of the material, for slow impacts; speed : as in `Sand` (m/s)
    into : speed into the ground at the impact (m/s)
    """
    return R_n / (1.0 + into / speed)


@rebound.rule(Sand)
def rebound_from_sand(model: Sand, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a rock after an impact.

    surface : coefficients of the ground; motion : motion of the rock before the impact
    n : (3,) unit normal of the ground, which points away from the ground; rock : not used here
    """
    into = -dot(motion.v, n)
    along = scale(surface.R_t, without(motion.v, n))
    up = scale(softened(surface.R_n, model.speed, into) * into, n)
    return Motion(motion.t, motion.x, add(up, along), motion.w)
