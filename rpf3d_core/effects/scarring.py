"""Soft ground: a rock drives a scar into the soil, is braked by the displaced soil, and slips out of the scar.

Sources: Lu et al. 2019 (Landslides 16:2353) for the scar, with the depth of Gerber 2019; Leine et al. 2014 (Multibody
Syst. Dyn. 32:241), equations 46 and 47, for the friction. rpf3d derives from these formulas the effect on a sphere
whose contact lasts no time:

1. The rock, a sphere of radius R and mass M, penetrates to the depth d_max in the direction of its velocity. Let a be
   the angle between this direction and the plane of the ground. The speed of the rock changes, but not its direction or
   its spin.
2. The drag F = 1/2 C_d rho A v^2 over a path dl = d(depth) / sin(a) gives v = v_0 exp(-C_d rho V / (2 M)). rho is the
   density of the soil, and V = integral of A dl is the volume of soil that the rock drives through.
3. A is the projected area of the part of the sphere that is in the ground, at a depth d. Seen along the normal, A_n is
   pi (2 R d - d^2), or pi R^2 if the centre is in the ground; seen along the plane, A_t is a segment of a circle. For
   directions in between, A^2 = (sin(a) A_n)^2 + (cos(a) A_t)^2. This is exact for both directions and for a sphere that
   is wholly in the ground. V_n and V_t are the integrals of A_n and A_t over depth; V = sqrt(V_n^2 + (V_t / tan(a))^2).
   V is exact for both directions and at most 3 % too small in between (tested).
4. Friction then reduces the speed along the ground by mu(s) times the speed into the ground, at most to zero, as in an
   impact that stops the whole speed into the ground (Leine: e_N = 0). mu(s) = mu_min + 2 / pi (mu_max - mu_min)
   atan(kappa s), where the slip s is the distance that the rock slips along the plane during the contact: the length of
   the scar. The rebound model acts after this effect, also on the speed into the ground. If the scene sets
   `tangential_restitution: 1`, only this effect reduces the speed along the ground.

Simplifications: Leine's slip s decays in flight by exp(-beta t); with beta from 50 to 200 1/s, 37 to 2 % of s are left
after 0.02 s. Here s starts at 0 in each impact, and there is no parameter beta. Leine's rocks have corners, so friction
makes them rotate; here friction only brakes. Bounces below `smallest_bounce` are summed up without scars, and rocks in
sustained contact make no scars. The speed into the ground is measured along the normal; Lu et al. use the vertical
speed, which is the same on level ground.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.effects.hooks import in_ground
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.slippage import slippage_friction
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Rock, Vec
from rpf3d_core.vectors import dot, norm, scale, subtract, without

KILO = 1e-3
SHALLOW = 1e-5
"""Ratio (-) of depth to radius below which the first term of a series replaces the closed form of a soil volume.

At this ratio both are equally accurate, to 2e-6. At smaller depths, the closed form loses digits by cancellation.
"""


class Scarring(NamedTuple):
    """The properties of soft ground in each of Z zones; every array is (Z,).

    In zones of hard ground, drag and friction are 0.

    stiffness : M_E of the soil, Pa; density : of the soil, kg/m3
    drag : drag coefficient C_d (-), the sum of `form_drag` and `soil_drag` of the scene
    mu_min, mu_max : friction (-) without slip, and its limit for a large slip; kappa : 1/m, growth with the slip
    """

    stiffness: Any
    drag: Any
    density: Any
    mu_min: Any
    mu_max: Any
    kappa: Any

    @property
    def asks_rock(self) -> bool:
        """True: the rules for soft ground need mass and radius of the rock."""
        return True


@kernel
def penetration(mass: float, stiffness: float, speed: float) -> float:
    """Return how deep (m) a rock penetrates the soil in an impact: 0.1 M^(1/3) M_E^(-0.4) v^0.8 (Gerber 2019).

    mass : M, kg; stiffness : M_E, Pa (the formula uses kN/m2); speed : v, m/s, into the ground
    """
    return float(0.1 * mass ** (1.0 / 3.0) * (KILO * stiffness) ** -0.4 * speed**0.8)


@kernel
def volume_from_above(depth: float, radius: float) -> float:
    """Return the soil volume (m3) that a sphere displaces when it moves straight down to a depth (m).

    The volume is the integral over depth of A_n, the area of the part of the sphere in the ground, seen along the
    normal. Beyond a depth of one radius A_n is pi R^2.
    """
    if depth <= radius:
        return math.pi * depth * depth * (radius - depth / 3.0)
    return math.pi * radius * radius * (depth - radius / 3.0)


@kernel
def volume_from_ahead(depth: float, radius: float) -> float:
    """Return the integral (m3) over depth of A_t, the area of the part of a sphere in the ground, seen along the plane.

    This integral, times the distance along the ground per metre of depth, is the soil volume that the sphere pushes
    ahead.

    With cos(phi) = 1 - depth / R, the area is R^2 (phi - sin(phi) cos(phi)), and its integral is R^3 (sin(phi) - phi
    cos(phi) - sin(phi)^3 / 3). At depths d where this formula loses digits, 8 / 15 sqrt(2 R) d^(5/2) replaces it.

    depth : of the sphere's lowest point below the ground, m; radius : R, m
    """
    if depth >= 2.0 * radius:
        return math.pi * radius * radius * (depth - radius)
    if depth < SHALLOW * radius:
        return 8.0 / 15.0 * math.sqrt(2.0 * radius * depth) * depth * depth
    phi = math.acos(1.0 - depth / radius)
    sine = math.sin(phi)
    return radius * radius * radius * (sine - phi * math.cos(phi) - sine * sine * sine / 3.0)


@in_ground.rule(Scarring)
def through_the_scar(
    scarring: Scarring, zone: int, surface: Surface, motion: Motion, n: Vec, rock: RockContext
) -> Motion:  # fmt: skip
    """Return the motion of a rock after it has ploughed a scar into soft ground: soil drag and friction have slowed it.

    A rock that does not move into the ground is unchanged.

    motion : at first contact; n : unit normal of the ground; zone : number of the zone; surface : not used
    """
    into = -dot(motion.v, n)
    if into <= 0.0:
        return motion
    body: Rock = rock.rock  # type: ignore[assignment]  # asks_rock: the rock is never None
    depth = penetration(body.mass, scarring.stiffness[zone], into)
    aside = norm(without(motion.v, n)) / into
    volume = driven_through(depth, aside, body.radius)
    kept = math.exp(-0.5 * scarring.drag[zone] * scarring.density[zone] * volume / body.mass)
    mu = slippage_friction(scarring.mu_min[zone], scarring.mu_max[zone], scarring.kappa[zone], aside * depth)
    return slowed_along(Motion(t=motion.t, x=motion.x, v=scale(kept, motion.v), w=motion.w), n, mu)


@kernel
def driven_through(depth: float, aside: float, radius: float) -> float:
    """Return the volume of soil (m3) that a sphere displaces on its path down to a depth (m).

    aside : distance along the plane of the ground per metre of depth (-); radius : of the sphere, m
    """
    ahead = aside * volume_from_ahead(depth, radius)
    above = volume_from_above(depth, radius)
    return math.sqrt(above * above + ahead * ahead)


@kernel
def slowed_along(motion: Motion, n: Vec, mu: float) -> Motion:
    """Return the motion after friction has reduced the speed along the ground, at most to zero.

    The loss is mu times the speed into the ground, which itself is not changed.
    n : unit normal of the ground with v . n <= 0; mu : friction (-)
    """
    along = without(motion.v, n)
    speed, most = norm(along), -mu * dot(motion.v, n)
    if most <= 0.0 or speed == 0.0:
        return motion
    taken = min(most / speed, 1.0)
    return Motion(t=motion.t, x=motion.x, v=subtract(motion.v, scale(taken, along)), w=motion.w)
