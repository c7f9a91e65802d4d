"""Rebound with constant restitution, but never losing more speed along the ground than Coulomb friction allows.

With v_n and v_t the velocities into and along the ground:

    normal     v_n' = -R_n v_n
    along      |v_t'| = max(R_t |v_t|, |v_t| - mu (1 + R_n) |v_n|) in the direction of v_t

R_n, R_t and mu, the tangent of the friction angle, belong to the material. An impact changes the speed along the normal
by (1 + R_n) |v_n|. So its normal impulse is m (1 + R_n) |v_n|, and Coulomb friction gives at most mu times this impulse
along the ground (Stronge 2000, Impact Mechanics, section 5: gross slip). R_t alone has no limit of this kind: a very
small bounce, with a very small impulse, would take the same share of the speed along the ground as a hard impact.
Kinetic energy never rises.

Bounces on a plane: a rock leaves the plane with the speed w along the normal and the velocity u along the plane.
Bounce k takes the time T_k = T R_n^k, T = 2 w / g_n. In the impact at the end of bounce k, the rock keeps the share
s_k of its speed along the plane:

    s_k = max(R_t, 1 - c T_k / |u_k + g_t T_k|),    c = mu (1 + R_n) g_n / 2,

so u_{k+1} = s_k (u_k + g_t T_k), with g_n and g_t the gravity normal to the plane and along the plane. All velocities
along the plane are a_k u_0 + b_k g_t with a_{k+1} = s_k a_k and b_{k+1} = s_k (b_k + T_k). a_k and b_k are never
negative, so the displacement grows along u_0 and along g_t. Two regimes have closed forms, for all bounces from one
bounce on:

    friction only   |u| is much larger than all remaining changes of u together, (|g_t| + c) T / (1 - R_n): each
                    further impact reduces |u| by c T_k, and the direction no longer changes
    R_t only        R_t <= R_n and |u| / T is so small that friction never limits the loss: the series of the constant
                    model

Other bounces are summed one after the other.
"""

from typing import NamedTuple

from rpf3d_core.arc import gravity_along
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import RemainingBounces, at_once, endless, lumped, rebound, rest_of_bounces
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import add, dot, norm, scale, without

STEADY = 1e-6
"""Remaining change of the speed along the ground, divided by this speed (-), up to which a closed form is used.

The closed form leaves out the square of this share: 1e-12 of the speed.
"""

SPENT = 1e-12
"""Share (-) of the first bounce's time below which later bounces are left out, because their length is negligible.

The length of these bounces, divided by the length of the first bounce, is about the square of this share.
"""

MOST_BOUNCES = 2000
"""Largest number of bounces that are summed one after the other; enough for R_n up to 0.986."""


class CoulombLimited(NamedTuple):
    """Rebound model with R_n, R_t and the friction angle of the material."""


class SummedBounces(NamedTuple):
    """The sum of some bounces of a rock on a plane: the velocity is a u_0 + b g_t, the displacement A u_0 + B g_t.

    u_0 is the velocity along the plane at the start (m/s), g_t the gravity along the plane (m/s^2).
    a (-), b (s), A (s), B (s^2); T : s, time of the next bounce
    """

    a: float
    b: float
    A: float
    B: float
    T: float


class Plane(NamedTuple):
    """The quantities that are the same for all bounces of a rock on one plane.

    r, q : R_n and R_t (-); u : (3,) m/s along the plane at the start; g_t : (3,) m/s^2, gravity along the plane
    pull : |g_t| (m/s^2); c : m/s^2, after a bounce of T seconds friction reduces the speed along the plane by c T
    """

    r: float
    q: float
    u: Vec
    g_t: Vec
    pull: float
    c: float


@rebound.rule(CoulombLimited)
def coulomb_limited(model: CoulombLimited, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a lumped mass after an impact, with a loss along the ground limited by Coulomb friction.

    The speed along the ground falls by the loss due to R_t, but not by more than friction allows.
    n : (3,) unit normal of the ground
    """
    most = surface.mu * (1.0 + surface.R_n) * -dot(motion.v, n)
    return lumped(surface.R_n, share_kept(surface.R_t, norm(without(motion.v, n)), most), motion, n)


@kernel
def share_kept(R_t: float, speed: float, most: float) -> float:
    """Return the share (-) of the speed along the ground that a rock keeps in an impact: R_t, or more at low friction.

    speed : along the ground before the impact (m/s); most : largest loss of this speed that friction allows (m/s)
    """
    return R_t if speed * (1.0 - R_t) <= most else 1.0 - most / speed


@rest_of_bounces.rule(CoulombLimited)
def coulomb_limited_rest(
    model: CoulombLimited, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return the sum of all remaining bounces on a plane of normal n (3,), with losses limited by Coulomb friction.

    Bounces are added one by one until a closed form is valid for the rest. The error of the velocity is below 1e-10 of
    the largest speed, the error of the displacement below 1e-10 of this speed times the total time. The result has
    `ends` False, so that each bounce is computed as a flight, in two cases: if R_n is 1 or more, or if no closed form
    is valid after MOST_BOUNCES (2000) bounces, which is possible for R_n above 0.986.

    gravity : m/s^2, above 0
    """
    r, q = surface.R_n, surface.R_t
    if r >= 1.0:
        return endless(motion)
    g_n, g_t = gravity * n[2], gravity_along(n, gravity)
    T = 2.0 * max(dot(motion.v, n), 0.0) / g_n
    if T == 0.0:
        return at_once(motion, n)
    c = 0.5 * surface.mu * (1.0 + r) * g_n if q < 1.0 else 0.0
    plane = Plane(r=r, q=q, u=without(motion.v, n), g_t=g_t, pull=norm(g_t), c=c)
    before = one_by_one(plane, SummedBounces(a=1.0, b=0.0, A=0.0, B=0.0, T=T))
    if not (_settled(plane, before) or before.T <= SPENT * T):
        return endless(motion)
    end = _summed(plane, before)
    return RemainingBounces(
        along=scale(end.A, plane.u), down=scale(end.B, g_t), v=_speed(plane, end), t=T / (1.0 - r), ends=True
    )


@kernel
def one_by_one(plane: Plane, first: SummedBounces) -> SummedBounces:
    """Return the sum `first` with further bounces added one by one, until a closed form can sum all that remain.

    At most MOST_BOUNCES (2000) bounces are added. The function also ends when a bounce takes less than SPENT (1e-12)
    times the time of the first bounce.
    """
    state = first
    for _ in range(MOST_BOUNCES):
        if _settled(plane, state) or state.T <= SPENT * first.T:
            return state
        state = _next(plane, state)
    return state


@kernel
def _settled(plane: Plane, state: SummedBounces) -> bool:
    """Return True if a closed form gives the sum of all bounces after the bounces in `state`."""
    speed = norm(_speed(plane, state))
    return _limited_for_good(plane, speed, state.T) or _constant_for_good(plane, speed, state.T)


@kernel
def _speed(plane: Plane, state: SummedBounces) -> Vec:
    """Return the velocity (3,) m/s of a rock along the plane after the bounces in `state`."""
    return add(scale(state.a, plane.u), scale(state.b, plane.g_t))


@kernel
def _next(plane: Plane, state: SummedBounces) -> SummedBounces:
    """Return the sum `state` plus one more bounce and the impact at the end of this bounce."""
    T = state.T
    flown = SummedBounces(
        a=state.a, b=state.b + T, A=state.A + state.a * T, B=state.B + (state.b + 0.5 * T) * T, T=plane.r * T
    )
    kept = share_kept(plane.q, norm(_speed(plane, flown)), plane.c * T)
    return SummedBounces(a=kept * flown.a, b=kept * flown.b, A=flown.A, B=flown.B, T=flown.T)


@kernel
def _limited_for_good(plane: Plane, speed: float, T: float) -> bool:
    """Return True if from now on friction alone brakes the rock, or nothing (c = 0), so that a closed form is valid.

    Friction then reduces the speed by c T_k at every further impact, and the total of these losses is small.

    speed : along the plane (m/s); T : time of the next bounce (s)
    """
    change = (plane.pull + plane.c) * T / (1.0 - plane.r)
    steady = change <= STEADY * speed and plane.c * T <= (1.0 - plane.q) * (speed - change)
    return plane.c == 0.0 or steady


@kernel
def _constant_for_good(plane: Plane, speed: float, T: float) -> bool:
    """Return True if from now on only R_t brakes the rock, at every further impact: the closed form of R_t is valid.

    This is so if the loss due to R_t is smaller than friction allows: x_k = |u_k + g_t T_k| / T_k must be at most
    c / (1 - R_t). The first x_k is at most |u| / T + |g_t|, and x_{k+1} <= (R_t / R_n) x_k + |g_t|. So x_k is at most
    the larger one of its first value and |g_t| R_n / (R_n - R_t).

    speed : along the plane (m/s); T : time of the next bounce (s)
    """
    lost = 1.0 - plane.q
    first = lost * (speed + plane.pull * T) <= plane.c * T
    return first and plane.q <= plane.r and lost * plane.pull * plane.r <= plane.c * (plane.r - plane.q)


@kernel
def _summed(plane: Plane, state: SummedBounces) -> SummedBounces:
    """Return the sum of all bounces: the bounces in `state`, and all remaining bounces by a closed form.

    There are two closed forms, one for bounces that only friction brakes, and one for bounces that only R_t brakes. If
    neither is valid, the remaining bounces are left out.

    The remaining bounces take the time t = T / (1 - R_n). For friction only, to first order of c t / |u|:
    a = 1 - c t / |u|, b = t, A = t - (c / |u|) sum(t_k T_k), B = t^2 / 2. Bounce k begins after the time t_k and takes
    T_k, so sum(t_k T_k) = T^2 R_n / ((1 - R_n) (1 - R_n^2)). For R_t only, the sums are those of `sum_of_bounces`.
    """
    r, T, speed = plane.r, state.T, norm(_speed(plane, state))
    t = T / (1.0 - r)
    if _limited_for_good(plane, speed, T):
        slowing = plane.c / speed if speed > 0.0 else 0.0
        lost = slowing * T * T * r / ((1.0 - r) * (1.0 - r * r))
        return _joined(state, SummedBounces(a=1.0 - slowing * t, b=t, A=t - lost, B=0.5 * t * t, T=0.0))
    if not _constant_for_good(plane, speed, T):
        return state
    q = plane.q
    weight = (r * q / (1.0 - r * q) + 0.5) / (1.0 - r * r)
    return _joined(state, SummedBounces(a=0.0, b=0.0, A=T / (1.0 - r * q), B=weight * T * T, T=0.0))


@kernel
def _joined(first: SummedBounces, then: SummedBounces) -> SummedBounces:
    """Return the total of two consecutive sums of bounces; `then` starts with the velocity at the end of `first`."""
    return SummedBounces(
        a=then.a * first.a,
        b=then.a * first.b + then.b,
        A=first.A + then.A * first.a,
        B=first.B + then.A * first.b + then.B,
        T=then.T,
    )
