"""What an impact does to a rock's motion: one rule per model.

Convention of the thesis (equations 3-1 to 3-3), restated as vectors: with n the unit normal of the facet turned
against the velocity, v_n = (v . n) n and v_t = v - v_n, the rock leaves with v' = -R_n v_n + R_t v_t.
"""

import math
from typing import NamedTuple

from rpf3d_core.arc import gravity_along
from rpf3d_core.compiling import model_function
from rpf3d_core.materials.falling import Falling
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import ZERO, Motion, Vec
from rpf3d_core.vectors import add, dot, scale, without


class ConstantRestitution(NamedTuple):
    """R_n and R_t of the material, whatever the speed and the angle."""


class ThesisLiteral(NamedTuple):
    """The thesis' equations 2-3 to 2-8 as printed, for reproduction only."""


class Rest(NamedTuple):
    """The rest of the bouncing on one plane, summed to its end.

    along : (3,) m, displacement owed to the speed along the facet; down : (3,) m, that owed to gravity
    v : (3,) m/s at the end, along the facet; t : s it takes; ends : False where the bouncing never dies out
    """

    along: Vec
    down: Vec
    v: Vec
    t: float
    ends: bool


@model_function
def rebound(model: object, surface: Surface, motion: Motion, n: Vec, falling: Falling) -> Motion:
    """Motion just after an impact; n is the unit normal with v . n <= 0. The result has v . n >= 0."""


@model_function
def rest_of_bounces(
    model: object, surface: Surface, motion: Motion, n: Vec, gravity: float, falling: Falling
) -> Rest:
    """Where the infinitely many bounces after `motion`, which has just left the plane of normal n, come to an end."""


@rebound.rule(ConstantRestitution)
def constant_restitution(
    model: ConstantRestitution, surface: Surface, motion: Motion, n: Vec, falling: Falling
) -> Motion:
    """Constant restitution of a lumped mass (thesis, equations 3-1 to 3-3; physics reference 1.1)."""
    v_n = dot(motion.v, n)
    v = add(scale(-surface.R_n * v_n, n), scale(surface.R_t, without(motion.v, n)))
    return Motion(motion.t, motion.x, v, motion.w)


@rest_of_bounces.rule(ConstantRestitution)
def constant_rest(
    model: ConstantRestitution, surface: Surface, motion: Motion, n: Vec, gravity: float, falling: Falling
) -> Rest:
    """The geometric series of bounces on a plane (validation reference 2.2), as vectors along the facet.

    The k-th bounce takes T_k = T_0 R_n^k; the speed along the facet goes u_{k+1} = R_t (u_k + g_t T_k). Summed:
    x = u_0 T_0 / (1 - R_n R_t) + g_t T_0^2 [R_n R_t / ((1 - R_n R_t)(1 - R_n^2)) + 1 / (2 (1 - R_n^2))],
    which, unlike the form with R_t - R_n below the line, holds for R_t = R_n. At R_n = 0 there is no further bounce:
    the rock keeps the speed along the facet that its one impact left it.
    """
    r, q = surface.R_n, surface.R_t
    if r >= 1.0:
        return Rest(ZERO, ZERO, motion.v, 0.0, False)
    g_n = gravity * n[2]
    g_t = gravity_along(n, gravity)
    u = without(motion.v, n)
    T = 2.0 * max(dot(motion.v, n), 0.0) / g_n
    if T == 0.0:
        return Rest(ZERO, ZERO, u, 0.0, True)
    weight = (r * q / (1.0 - r * q) + 0.5) / (1.0 - r * r)
    t = T / (1.0 - r)
    v = add(u, scale(t, g_t)) if q == 1.0 else ZERO
    return Rest(scale(T / (1.0 - r * q), u), scale(weight * T * T, g_t), v, t, True)


@rebound.rule(ThesisLiteral)
def thesis_literal(model: ThesisLiteral, surface: Surface, motion: Motion, n: Vec, falling: Falling) -> Motion:
    """Equations 2-3 to 2-8 of the thesis exactly as printed, with 3-1 to 3-3 in between.

    theta and phi are taken as the slopes of the ground along x and y, positive where it rises: the only reading under
    which 2-3 is v . n for a plane that dips along one axis. The printed transform is not orthonormal: it loses speed
    at R_n = R_t = 1 on a slope along one axis (physics reference 0.1), and gains
    up to three times its energy on one along both. Where it would send the rock into the ground, the speed into the
    ground is dropped.
    """
    theta, phi = math.atan2(-n[0], n[2]), math.atan2(-n[1], n[2])
    st, ct, sp, cp = math.sin(theta), math.cos(theta), math.sin(phi), math.cos(phi)
    vx, vy, vz = motion.v
    v_n = surface.R_n * (vz * ct * cp - vx * st - vy * sp)
    v_tx = surface.R_t * (vz * st * cp + vx * ct)
    v_ty = surface.R_t * (vz * sp * ct + vy * cp)
    v = (v_tx * ct + v_n * sp * ct, v_ty * cp + v_n * st * cp, v_tx * st + v_ty * sp - v_n * ct * cp)
    return Motion(motion.t, motion.x, add(v, scale(max(-dot(v, n), 0.0), n)), motion.w)


@rest_of_bounces.otherwise
def no_sum(model: object, surface: Surface, motion: Motion, n: Vec, gravity: float, falling: Falling) -> Rest:
    """Of a model for which no closed form is known: the bouncing ends where it is, below `smallest_bounce`."""
    return Rest(ZERO, ZERO, without(motion.v, n), 0.0, True)


REBOUND_MODELS = {"constant": ConstantRestitution(), "thesis_literal": ThesisLiteral()}
"""Rebound models by the name that a scene gives them."""
