"""The impact of a rigid sphere that spins: restitution along the normal, Coulomb friction across it.

With v_c = v_t + w x (-R n) the slip of the contact point, v_n the speed into the ground and per unit of mass:
    normal impulse      (1 + e) v_n
    tangential impulse  k = min((1 + e_t) 2/7 |v_c|, mu (1 + e) v_n), against v_c
The first of the two is the impulse that sticks (2/7 = 1 / (1 + m R^2 / I) of a solid sphere), the second the most that
friction gives while the sphere slips. e_t turns part of the slip round: 0 leaves the sphere rolling, 1 with enough
friction is the super-ball. k <= 4/7 |v_c|, so v^2 + 2/5 (R w)^2 never rises for e and e_t in [0, 1].

Derived from rigid-body mechanics (physics reference 2.3); e_t = 0 for rock: Leine et al. 2014, Multibody Syst. Dyn.
32:241-271, doi 10.1007/s11044-013-9393-4.
"""

from typing import NamedTuple

from rpf3d_core.compiling import kernel
from rpf3d_core.kinetics.rebound import Rest, rebound, rest_of_bounces
from rpf3d_core.materials.falling import Falling
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import ZERO, Motion, Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale, subtract, without

STICKS = 2.0 / 7.0
"""Impulse, over mass and slip, that stops the slip of a solid sphere: 1 / (1 + m R^2 / I) with I = 2/5 m R^2."""
MATERIALS_OWN = -1.0
"""Stands for an impact friction that is the material's: the tangent of its friction angle."""


class CoulombSphere(NamedTuple):
    """A rigid sphere; e is the material's R_n, and its R_t plays no part.

    impact_friction : mu (-), or MATERIALS_OWN; tangential_restitution : e_t (-), in [0, 1]
    damping : share (-) of tangential speed and spin that is left after an impact, in [0, 1]
    """

    impact_friction: float
    tangential_restitution: float
    damping: float

    @property
    def asks_rock(self) -> bool:
        """Its rules ask for the radius."""
        return True

    @property
    def spins(self) -> bool:
        """Its rules change the spin."""
        return True


@kernel
def slip_of(v: Vec, w: Vec, n: Vec, radius: float) -> Vec:
    """Velocity (m/s) of the point of a sphere that touches a ground of unit normal n, along the ground."""
    return without(add(v, scale(-radius, cross(w, n))), n)


@kernel
def kicked(motion: Motion, n: Vec, radius: float, k: float, slip: Vec) -> Motion:
    """The motion after an impulse k (m/s, per mass) against a slip (3,) m/s of some speed, at the contact."""
    speed = norm(slip)
    if speed == 0.0 or k == 0.0:
        return motion
    push = scale(-k / speed, slip)
    turn = scale(-2.5 / radius, cross(n, push))
    return Motion(motion.t, motion.x, add(motion.v, push), add(motion.w, turn))


@rebound.rule(CoulombSphere)
def sphere_rebound(model: CoulombSphere, surface: Surface, motion: Motion, n: Vec, falling: Falling) -> Motion:
    """Stick or slip, whichever needs the smaller impulse."""
    rock = falling.rock
    radius, into = rock.radius, max(-dot(motion.v, n), 0.0)  # type: ignore[union-attr]  # it asks for the rock
    mu = model.impact_friction if model.impact_friction >= 0.0 else surface.mu
    slip, push = slip_of(motion.v, motion.w, n, radius), (1.0 + surface.R_n) * into
    stick = (1.0 + model.tangential_restitution) * STICKS * norm(slip)
    after = kicked(motion, n, radius, min(stick, mu * push), slip)
    out, along = scale(surface.R_n * into, n), without(after.v, n)
    v, w = add(out, scale(model.damping, along)), scale(model.damping, after.w)
    return Motion(motion.t, motion.x, v, w)


@rest_of_bounces.rule(CoulombSphere)
def sphere_rest(
    model: CoulombSphere, surface: Surface, motion: Motion, n: Vec, gravity: float, falling: Falling
) -> Rest:
    """They end where they are, below `smallest_bounce`: on average dying bounces push like a sphere that lies there."""
    v = subtract(motion.v, scale(dot(motion.v, n), n))
    return Rest(ZERO, ZERO, v, 0.0, surface.R_n < 1.0)
