"""The rebound of the Colorado Rockfall Simulation Program: a sphere that leaves every impact rolling.

Pfeiffer & Bowen 1989, Bull. AEG 26:135-146; the public programs PlatRock and pyrockfall have the same constants and
equations. With v_n and v_t the speeds into and along the ground, w the spin, R the radius and s the speed at which the
rock's lowest point slips:

    normal     v_n' = R_n v_n / (1 + (v_n / K)^2)                       K = 9.144 m/s  (30 ft/s)
    friction   f = R_t + (1 - R_t) / ((s / A)^2 + 1.2)                  A = 6.096 m/s  (20 ft/s)
    scaling    F = R_t / ((v_n / (B R_n))^2 + 1)                        B = 76.2 m/s  (250 ft/s)
    along      v_t' = sqrt(R^2 (I w^2 + m v_t^2) f F / (I + m R^2)),    I = 2/5 m R^2
    spin       w' = v_t' / R

R_n and R_t are values for slow impacts, and R_t multiplies energy: values for a lumped mass are different. In three
dimensions s = |v_t + w x (-R n)|, and w is the spin about axes along the ground. v_t' points along v_t or, if v_t is
zero, in the direction in which the spin rolls. w' = n x v_t' / R, and the spin about n is kept. For contacts, the rock
is a point, as a lumped mass. Kinetic energy, of translation and rotation together, never rises.
"""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import RemainingBounces, rebound, rest_of_bounces, sum_of_bounces
from rpf3d_core.kinetics.rebounds.spin import heading
from rpf3d_core.kinetics.rebounds.velocity_scaled import halved
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import SPHERE_INERTIA_RATIO, Motion, Vec
from rpf3d_core.vectors import add, along, cross, dot, norm, scale, subtract

AT_REST = 1.2
"""Constant 1.2 (-) of CRSP's friction function, which keeps the function finite without slip."""


class PfeifferBowen(NamedTuple):
    """Rebound model of a rolling sphere by the equations of CRSP (Colorado Rockfall Simulation Program).

    K, A, B : m/s, reference speeds of the normal restitution, of the friction function and of the scaling factor
    """

    K: float
    A: float
    B: float
    asks_rock = True  # type: ignore[misc]
    spins = True  # type: ignore[misc]


@rebound.rule(PfeifferBowen)
def pfeiffer_bowen(model: PfeifferBowen, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a sphere after an impact by CRSP's equations (Pfeiffer & Bowen 1989): the sphere then rolls.

    n : (3,) unit normal of the ground, which may be tilted for rough ground, with v . n <= 0
    """
    radius = rock.rock.radius  # type: ignore[union-attr]  # asks_rock
    v_n, v_t = -dot(motion.v, n), along(motion.v, n)
    w_n = scale(dot(motion.w, n), n)
    w_t = subtract(motion.w, w_n)
    rolling = scale(radius, cross(w_t, n))  # the velocity of a sphere that rolls with this spin
    slip = norm(subtract(v_t, rolling))
    share = friction(surface.R_t, slip / model.A) * scaling(surface.R_n, surface.R_t, v_n, model.B)
    energy = SPHERE_INERTIA_RATIO * dot(rolling, rolling) + dot(v_t, v_t)  # twice the energy along the ground, per kg
    speed = math.sqrt(energy * share / (SPHERE_INERTIA_RATIO + 1.0))
    away = surface.R_n * halved(v_n / model.K) * v_n
    kept = scale(speed, heading(v_t, rolling))
    return Motion(t=motion.t, x=motion.x, v=add(scale(away, n), kept), w=add(w_n, scale(1.0 / radius, cross(n, kept))))


@kernel
def friction(R_t: float, x: float) -> float:
    """Return CRSP's friction function f = R_t + (1 - R_t) / (x^2 + 1.2) (-).

    x : speed at which the rock's lowest point slips, divided by the reference speed A (-)
    """
    return R_t + (1.0 - R_t) / (x * x + AT_REST)


@kernel
def scaling(R_n: float, R_t: float, v_n: float, B: float) -> float:
    """Return CRSP's scaling factor F = R_t / ((v_n / (B R_n))^2 + 1) (-), computed without dividing by R_n.

    If v_n is 0, F is R_t. If only R_n is 0, F is 0.

    v_n : speed into the ground (m/s); B : reference speed (m/s)
    """
    reach = B * R_n
    below = v_n * v_n + reach * reach
    return R_t * (reach * reach / below) if below > 0.0 else R_t


@rest_of_bounces.rule(PfeifferBowen)
def pfeiffer_bowen_rest(
    model: PfeifferBowen, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return the sum of all remaining bounces, as if every impact kept the shares of speed that a slow impact keeps.

    Of the speed along the normal, a slow impact keeps the share r, the material's R_n. Of the speed along the ground, a
    slow impact of a rolling rock keeps the share q = sqrt(R_t f(0)). For a bounce that rises by h, the relative errors
    of r and q are about 2 g h / K^2 and (8 g h tan^2(slope)) / A^2. The sum assumes that the spin follows the speed
    that gravity adds in flight. So the displacement down the slope is too long, by at most
    8 h tan(slope) r q / ((1 - r q) (1 - r^2)): millimetres for bounces of 1 mm.

    n : (3,) normal of the plane; gravity : g, m/s^2, above 0
    """
    q = math.sqrt(surface.R_t * friction(surface.R_t, 0.0))
    return sum_of_bounces(surface.R_n, q, motion, n, gravity)
