"""Soft ground: a rock goes straight in, is braked by the soil that it pushes aside, and slips out of its scar.

Sources (physics reference 3.1 and 3.4): Lu et al. 2019 (Landslides 16:2353) for the scar, with the depth of Gerber
2019; Leine et al. 2014 (Multibody Syst. Dyn. 32:241), equations 46 and 47, for the friction. All formulas confirmed
(C); what is made of them for a sphere whose contact lasts no time is derived here (D):

1. The rock goes d_max deep, along its velocity, which with the plane makes an angle of sine s and cosine c: the speed
   changes, direction and spin do not.
2. F = 1/2 C_d rho A v^2 over a way dl = d(depth) / s gives v = v_0 exp(-C_d rho V / (2 M)), V = integral of A dl: the
   volume of soil that it drives through.
3. A is the area that a sphere shows, as far as it is in the ground: seen along the normal pi (2 R d - d^2), or pi R^2
   once its middle is in; seen along the plane the segment of a circle. In between A^2 = (s A_n)^2 + (c A_t)^2, which
   is right at both ends and for a sphere that is wholly in. V = sqrt(V_n^2 + (c / s V_t)^2) from the integrals of both
   over depth: exact at both ends, and at most 3 % too small in between (tested).
4. The ground then takes away the speed into it (Leine: e_N = 0) and, by friction, mu(s) times as much along it, never
   more than there is: mu(s) = mu_min + 2 / pi (mu_max - mu_min) atan(kappa s). s is how far the rock slipped along the
   plane while it was in contact: the length of the scar. The rebound model follows; a scene that leaves the
   loss along the ground to this effect says `tangential_restitution: 1`.

Simplified: s decays by exp(-beta t) in flight (beta 50 to 200 1/s: to a few percent in 0.02 s), so it begins at 0 in
each impact, and beta is not asked for. Leine's rocks have corners, which friction turns: here it brakes and turns
nothing. Bounces below `smallest_bounce` are summed up
without their scars, and rocks on the ground make none. Speed into the ground is that along its normal; Lu et al. take
the vertical one, the same on level ground.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.effects.hooks import in_ground
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Rock, Vec
from rpf3d_core.vectors import dot, norm, scale, subtract, without

KILO = 1e-3
SHALLOW = 1e-5
"""Depth over radius where the closed form and its first term are alike right, to 2e-6: at smaller depths the former
loses its digits to a difference."""


class Scarring(NamedTuple):
    """Soft ground, for each of Z zones; every array has Z rows. Hard ground has no drag and no friction.

    stiffness : (Z,) M_E, Pa; drag : (Z,) C_d = C_f + C_s (-); density : (Z,) of the soil, kg/m3
    mu_min, mu_max : (Z,) friction (-); kappa : (Z,) 1/m
    """

    stiffness: Any
    drag: Any
    density: Any
    mu_min: Any
    mu_max: Any
    kappa: Any

    @property
    def asks_rock(self) -> bool:
        """Its rules ask for mass and radius."""
        return True


@kernel
def penetration(mass: float, stiffness: float, speed: float) -> float:
    """How deep (m) a rock goes into the ground: 0.1 M^(1/3) M_E^(-0.4) v^0.8, M_E in kN/m2 (Gerber 2019).

    mass : kg; stiffness : Pa; speed : m/s into the ground
    """
    return float(0.1 * mass ** (1.0 / 3.0) * (KILO * stiffness) ** -0.4 * speed**0.8)


@kernel
def volume_from_above(depth: float, radius: float) -> float:
    """Integral (m3) over depth of the area that a sphere shows along the normal: that of its cap."""
    if depth <= radius:
        return math.pi * depth * depth * (radius - depth / 3.0)
    return math.pi * radius * radius * (depth - radius / 3.0)


@kernel
def volume_from_ahead(depth: float, radius: float) -> float:
    """Integral (m3) over depth of the area that a sphere shows along the plane: of a segment of a circle.

    With cos(phi) = 1 - depth / R the segment is R^2 (phi - sin(phi) cos(phi)); integrated, R^3 (sin(phi) - phi cos(phi)
    - sin(phi)^3 / 3). Where that loses its digits, 8 / 15 sqrt(2 R) d^(5/2) stands for it.
    """
    if depth >= 2.0 * radius:
        return math.pi * radius * radius * (depth - radius)
    if depth < SHALLOW * radius:
        return 8.0 / 15.0 * math.sqrt(2.0 * radius * depth) * depth * depth
    phi = math.acos(1.0 - depth / radius)
    sine = math.sin(phi)
    return radius * radius * radius * (sine - phi * math.cos(phi) - sine * sine * sine / 3.0)


@kernel
def slippage_friction(mu_min: float, mu_max: float, kappa: float, slipped: float) -> float:
    """mu(s) = mu_min + 2 / pi (mu_max - mu_min) atan(kappa s) (Leine et al. 2014, equation 46); slipped : s, m."""
    return mu_min + 2.0 / math.pi * (mu_max - mu_min) * math.atan(kappa * slipped)


@in_ground.rule(Scarring)
def through_the_scar(
    scarring: Scarring, zone: int, surface: Surface, motion: Motion, n: Vec, falling: RockContext
) -> Motion:  # fmt: skip
    """The motion at the end of the scar, less what friction takes."""
    into = -dot(motion.v, n)
    if into <= 0.0:
        return motion
    rock: Rock = falling.rock  # type: ignore[assignment]  # there is one: it asks for it
    depth = penetration(rock.mass, scarring.stiffness[zone], into)
    aside = norm(without(motion.v, n)) / into
    volume = driven_through(depth, aside, rock.radius)
    kept = math.exp(-0.5 * scarring.drag[zone] * scarring.density[zone] * volume / rock.mass)
    mu = slippage_friction(scarring.mu_min[zone], scarring.mu_max[zone], scarring.kappa[zone], aside * depth)
    return slowed_along(Motion(motion.t, motion.x, scale(kept, motion.v), motion.w), n, mu)


@kernel
def driven_through(depth: float, aside: float, radius: float) -> float:
    """Volume of soil (m3) that a sphere drives through on its way to a depth (m).

    aside : metres along the plane for each into it
    """
    ahead = aside * volume_from_ahead(depth, radius)
    above = volume_from_above(depth, radius)
    return math.sqrt(above * above + ahead * ahead)


@kernel
def slowed_along(motion: Motion, n: Vec, mu: float) -> Motion:
    """The motion after Coulomb's impulse of an impact that takes all speed into the ground; it never reverses.

    n : unit normal with v . n <= 0
    """
    along = without(motion.v, n)
    speed, most = norm(along), -mu * dot(motion.v, n)
    if most <= 0.0 or speed == 0.0:
        return motion
    taken = min(most / speed, 1.0)
    return Motion(motion.t, motion.x, subtract(motion.v, scale(taken, along)), motion.w)
