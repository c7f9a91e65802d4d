"""Impact of a spinning rigid sphere on the ground, with restitution, Coulomb friction and a rolling moment.

A sphere of radius R hits ground of normal n with the speed v_n into the ground, the velocity v_t along the ground and
the spin w. The slip of its contact point is v_c = v_t + w x (-R n). Per unit of mass, the ground gives
    normal impulse      P = (1 + e) v_n, e the normal restitution
    tangential impulse  at most mu P, against the slip, mu the friction
    angular impulse     at most mu_r R P, against the spin, mu_r the material's rolling friction
`rolling_moment` finds the tangential and the angular impulse together. Without rolling friction the tangential impulse
is the smaller of (1 + e_t) 2/7 |v_c| and mu P, e_t the tangential restitution. If the first value is smaller, the
contact sticks (2/7 = 1 / (1 + m R^2 / I) of a solid sphere), else the contact slips.

An impact removes slip and spin, and e_t returns part of both with opposite sign. With e_t = 0 the sphere rolls after
the impact; with e_t = 1, enough friction and no rolling friction the sphere is a super-ball. The impulses are computed
in two steps: first for e_t = 0 with the limits mu P / (1 + e_t) and mu_r R P / (1 + e_t), then multiplied by 1 + e_t.
As a function of this factor, kinetic energy is quadratic, with its minimum at a factor of at least 1. So
v^2 + 2/5 (R w)^2 never rises for e and e_t in [0, 1].

The losses are proportional to the impulse, so they stay finite when impacts become many and small. In sustained contact
for a time t, the impulses P add up to N t, N the push of the ground per unit of mass. Rolling friction then brakes the
sphere by 5/7 mu_r N, as in `sphere_ground`.

Derived from rigid-body mechanics; e_t = 0 for rock: Leine et al. 2014, Multibody Syst. Dyn. 32:241-271, doi
10.1007/s11044-013-9393-4.
"""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import RemainingBounces, rebound, rest_of_bounces
from rpf3d_core.kinetics.rolling_moment import STICKS, impulses_of
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import ZERO, Motion, Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale, subtract, without

MATERIALS_OWN = -1.0
"""Value of `impact_friction` that means: use the material's friction, the tangent of its friction angle."""


class CoulombSphere(NamedTuple):
    """Rebound model of a rigid sphere with friction and spin.

    The normal restitution e is the R_n of the material, mu_r the rolling friction of the material. The material's R_t
    is not used.

    impact_friction : mu (-); MATERIALS_OWN (-1) for the friction of each material
    tangential_restitution : e_t (-), in [0, 1]
    """

    impact_friction: float
    tangential_restitution: float

    @property
    def asks_rock(self) -> bool:
        """True: the rules for the sphere need the radius of the rock."""
        return True

    @property
    def spins(self) -> bool:
        """True: the rules change the spin, so spins are recorded."""
        return True


@kernel
def slip_of(v: Vec, w: Vec, n: Vec, radius: float) -> Vec:
    """Return the slip (3,) m/s of a sphere: the velocity of its contact point along the ground with unit normal n.

    v : (3,) m/s, velocity of the centre; w : (3,) rad/s, spin; radius : of the sphere, m
    """
    return without(add(v, scale(-radius, cross(w, n))), n)


@kernel
def kicked(motion: Motion, n: Vec, radius: float, k: float, slip: Vec) -> Motion:
    """Return the motion of a sphere after a friction impulse at its contact point, against the slip.

    k : size of the impulse, per unit of mass (m/s); slip : (3,) m/s, from `slip_of`
    n : (3,) unit normal of the ground; radius : of the sphere, m
    """
    speed = norm(slip)
    if speed == 0.0 or k == 0.0:
        return motion
    push = scale(-k / speed, slip)
    turn = scale(-2.5 / radius, cross(n, push))
    return Motion(t=motion.t, x=motion.x, v=add(motion.v, push), w=add(motion.w, turn))


@rebound.rule(CoulombSphere)
def sphere_rebound(model: CoulombSphere, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a sphere after an impact, with a rolling moment if the ground has rolling friction.

    surface : gives normal restitution, rolling friction and, if the model has no impact_friction, the friction
    motion : just before the impact, with v . n <= 0
    n : (3,) unit normal of the ground
    """
    body = rock.rock
    radius, into = body.radius, max(-dot(motion.v, n), 0.0)  # type: ignore[union-attr]  # the model asks for the rock
    mu = model.impact_friction if model.impact_friction >= 0.0 else surface.mu
    push, e_t = (1.0 + surface.R_n) * into, model.tangential_restitution
    if surface.mu_r > 0.0:
        after = _braked(motion, n, radius, mu * push, surface.mu_r * push, e_t)
    else:
        slip = slip_of(motion.v, motion.w, n, radius)
        after = kicked(motion, n, radius, min((1.0 + e_t) * STICKS * norm(slip), mu * push), slip)
    v = add(scale(surface.R_n * into, n), without(after.v, n))
    return Motion(t=motion.t, x=motion.x, v=v, w=after.w)


@kernel
def _braked(motion: Motion, n: Vec, radius: float, friction: float, moment: float, e_t: float) -> Motion:
    """Return the motion of a sphere after the friction impulse and the rolling moment of an impact.

    friction : largest friction impulse, per mass (m/s); moment : largest rolling moment, per mass and radius (m/s)
    e_t : tangential restitution (-)
    n : (3,) unit normal of the ground
    """
    u, s, factor = without(motion.v, n), scale(radius, cross(motion.w, n)), 1.0 + e_t
    given = impulses_of(u, s, friction / factor, moment / factor)
    turn = scale(2.5 / radius * factor, cross(n, subtract(given.moment, given.push)))
    return Motion(t=motion.t, x=motion.x, v=add(motion.v, scale(factor, given.push)), w=add(motion.w, turn))


@rest_of_bounces.rule(CoulombSphere)
def sphere_rest(
    model: CoulombSphere, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return `RemainingBounces` without any bounce: the sphere stays on the ground, with its speed along the ground.

    On average, small bounces press on the ground as much as a sphere that stays on the ground, so friction brakes both
    equally. If R_n is 1 or more, the bounces never die out, and `ends` is False.

    n : (3,) unit normal of the ground; gravity : not used
    """
    v = subtract(motion.v, scale(dot(motion.v, n), n))
    return RemainingBounces(along=ZERO, down=ZERO, v=v, t=0.0, ends=surface.R_n < 1.0)
