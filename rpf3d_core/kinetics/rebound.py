"""The motion of a rock after an impact: one rule per rebound model.

This module has the constant model; the other models are in the folder `rebounds/`.

Convention of the thesis (equations 3-1 to 3-3), written as vectors: n is the unit normal of the facet turned against
the velocity, v_n = (v . n) n and v_t = v - v_n. The rock leaves with v' = -R_n v_n + R_t v_t.
"""

from typing import NamedTuple

from rpf3d_core.arc import gravity_along
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import ZERO, Motion, Vec
from rpf3d_core.vectors import add, dot, norm, scale, without

LEVEL = 1e-9
"""Ratio (-) of the speed off a facet to the whole speed, up to which a rock without restitution stays on the facet.

Without restitution, this ratio is about 1e-16: a rounding error of either sign, which must not decide about a bounce.
Larger ratios occur after a rebound with a tilted normal.
"""


class ConstantRestitution(NamedTuple):
    """The rebound model with the material's R_n and R_t, independent of speed and angle."""


class RemainingBounces(NamedTuple):
    """All remaining bounces of a rock on one plane together: displacement, time and final velocity of the rock.

    along : (3,) m, displacement due to the speed along the facet; down : (3,) m, displacement due to gravity
    v : (3,) m/s along the facet after the last bounce; t : total time of the bounces (s)
    ends : False if the bounces never die out or have no known sum. Each bounce is then computed as a flight, until a
        bounce rises by less than a millionth of `smallest_bounce`
    """

    along: Vec
    down: Vec
    v: Vec
    t: float
    ends: bool


@model_function
def rebound(model: object, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a rock just after an impact on ground of unit normal n; one rule per rebound model.

    model : parameters of the rebound model; surface : coefficients of the ground at the impact
    motion : just before the impact, with v . n <= 0
    A rule returns a motion with v . n >= 0.
    """


@model_function
def rest_of_bounces(
    model: object, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return the sum of all further bounces of a rock, so that small bounces need not be simulated one by one.

    One rule per rebound model.

    model : parameters of the rebound model; surface : coefficients of the ground
    motion : just after an impact on a plane of normal n (3,), n_z > 0; gravity : m/s^2, above 0
    """


@rebound.rule(ConstantRestitution)
def constant_restitution(
    model: ConstantRestitution, surface: Surface, motion: Motion, n: Vec, rock: RockContext
) -> Motion:
    """Return the motion of a lumped mass after an impact with constant restitution.

    n : (3,) unit normal of the facet
    Source: thesis, equations 3-1 to 3-3.
    """
    return lumped(surface.R_n, surface.R_t, motion, n)


@kernel
def lumped(R_n: float, R_t: float, motion: Motion, n: Vec) -> Motion:
    """Return the motion of a lumped mass after an impact, from restitution R_n and R_t (-); the spin is unchanged.

    n : (3,) unit normal of the facet
    """
    v_n = dot(motion.v, n)
    v = add(scale(-R_n * v_n, n), scale(R_t, without(motion.v, n)))
    return Motion(t=motion.t, x=motion.x, v=v, w=motion.w)


@rest_of_bounces.rule(ConstantRestitution)
def constant_rest(
    model: ConstantRestitution, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return the sum of all remaining bounces on a plane of normal n (3,), for constant R_n and R_t of the material.

    gravity : m/s^2, above 0
    """
    return sum_of_bounces(surface.R_n, surface.R_t, motion, n, gravity)


@kernel
def sum_of_bounces(r: float, q: float, motion: Motion, n: Vec, gravity: float) -> RemainingBounces:
    """Return the sum of all remaining bounces on a plane for constant R_n = r and R_t = q: a geometric series.

    For R_n >= 1 the result has `ends` False. For 0 < R_n < 1 and R_t < 1, a rock that leaves the plane has lost all its
    speed after the last bounce.

    r, q : R_n and R_t (-); motion : just after an impact on a plane of normal n (3,), n_z > 0
    gravity : m/s^2, above 0

    Bounce k takes the time T_k = T_0 R_n^k and starts with the velocity u_k along the facet. With g_t the gravity along
    the facet, u_{k+1} = R_t (u_k + g_t T_k). The displacement by all bounces is
    x = u_0 T_0 / (1 - R_n R_t) + g_t T_0^2 [R_n R_t / ((1 - R_n R_t)(1 - R_n^2)) + 1 / (2 (1 - R_n^2))].
    This form also holds for R_t = R_n, unlike the form with R_t - R_n in the denominator. At R_n = 0 there is no
    further bounce: the rock keeps its speed along the facet. But a rock may leave the facet even at R_n = 0, if
    the rebound was computed with a tilted normal. Then there is one more bounce: x = u_0 T_0 + g_t T_0^2 / 2, and
    u_1 = R_t (u_0 + g_t T_0).
    """
    if r >= 1.0:
        return endless(motion)
    if r == 0.0 and dot(motion.v, n) <= LEVEL * norm(motion.v):
        return at_once(motion, n)
    g_n = gravity * n[2]
    g_t = gravity_along(n, gravity)
    u = without(motion.v, n)
    T = 2.0 * max(dot(motion.v, n), 0.0) / g_n
    if T == 0.0:
        return RemainingBounces(along=ZERO, down=ZERO, v=u, t=0.0, ends=True)
    weight = (r * q / (1.0 - r * q) + 0.5) / (1.0 - r * r)
    t = T / (1.0 - r)
    v = scale(q, add(u, scale(t, g_t))) if q == 1.0 or r == 0.0 else ZERO
    return RemainingBounces(along=scale(T / (1.0 - r * q), u), down=scale(weight * T * T, g_t), v=v, t=t, ends=True)


@kernel
def endless(motion: Motion) -> RemainingBounces:
    """Return `RemainingBounces` with `ends` False: the bounces never die out, or their sum is unknown.

    The caller then computes each bounce as a flight.

    motion : just after an impact
    """
    return RemainingBounces(along=ZERO, down=ZERO, v=motion.v, t=0.0, ends=False)


@kernel
def at_once(motion: Motion, n: Vec) -> RemainingBounces:
    """Return `RemainingBounces` without any bounce: the rock stays on the ground and keeps its speed along the ground.

    motion : just after an impact on a plane of normal n (3,)
    """
    return RemainingBounces(along=ZERO, down=ZERO, v=without(motion.v, n), t=0.0, ends=True)


@rest_of_bounces.otherwise
def no_sum(
    model: object, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return `RemainingBounces` without any bounce, for a rebound model whose bounces have no sum in closed form.

    The rock stays on the ground and keeps its speed along the ground.

    n : (3,) normal of the ground; gravity : not used
    """
    return at_once(motion, n)
