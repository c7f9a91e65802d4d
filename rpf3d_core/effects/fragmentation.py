"""The condition for an impact to break a rock, and the new surface that the impact creates, after RockGIS.

Source: the program RockGIS (docs/explanation/physics.md, "How does a rock break?").

    E_n = 1/2 M (k_n v_n)^2            k_n v_n: the rock's speed off the ground after the rebound; M, V: mass and volume
    A_new = a E_n^e                      new surface, m2; A_0 = 6 V^(2/3); r = A_new / (A_new + A_0)
    the rock breaks if r > least_ratio (1 + spread U)        U: uniform in [-1, 1), drawn for each impact

Formulas and figures come from RockGIS' source code and defaults, not from the papers. UNCONFIRMED: `least_ratio`,
and the use of a and e with other rebound models than that of RockGIS, whose k_n is 0.19 in a head-on impact. A greater
k_n gives a greater E_n for the same fall.

The sizes of the fragments (`fragment_sizes.py`) differ from RockGIS' source code, where b = max(1, 2.4875 - 1.6125 r),
q = 1 - 0.5125 r, D = 3 + ln(1 - q) / ln(b) and V_k = q V k^(-1 / D). That law applies an exponent of lengths to
volumes. Its D falls again beyond r = 0.46 and is negative below 0.19 and above 0.65, so harder impacts give fewer
fragments (23 at r = 0.5, 5 at 0.6, 2 from 0.64). The surface of these fragments does not depend on A_new.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.effects.hooks import breaks
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.materials.streams import Purpose, uniform_at
from rpf3d_core.values import Motion, Rock, Vec
from rpf3d_core.vectors import dot

TWO_FRAGMENTS = 8.0
"""Least volume of a rock that may break, as a multiple of `least_volume` (-).

In a much smaller rock, no second fragment would reach `least_volume`: the second largest fragment has at most 0.154 of
the rock's volume.
"""
BREAKING = int(Purpose.BREAKING)


class Fragmentation(NamedTuple):
    """The parameters that decide when a rock breaks and how its fragments move.

    surface_factor, surface_exponent : a (m2 / J^e) and e (-) of the new surface A_new = a E_n^e of an impact, with the
        energy E_n (J) of the rock's speed off the ground after the rebound
    least_ratio : mean limit of the ratio r (`new_surface_ratio`) above which a rock breaks (-)
    spread : largest deviation of the limit of an impact from least_ratio, as a share of least_ratio (-)
    least_volume : m3, volume of the smallest fragment that flies
    speed_kept : share (-) of the rock's speed after the impact that its fragments have
    cone : rad, half angle of the cone of fragment directions; its axis is the rock's velocity after the impact
    least_angle : rad, least angle between the path of a fragment and the ground
    generations : number of times that a rock may break: first the rock, then its fragments, and so on
    """

    surface_factor: float
    surface_exponent: float
    least_ratio: float
    spread: float
    least_volume: float
    speed_kept: float
    cone: float
    least_angle: float
    generations: int

    @property
    def asks_rock(self) -> bool:
        """True: the rules for breaking need mass and radius of the rock."""
        return True

    @property
    def draws(self) -> bool:
        """True: the rules draw a random number, the limit of the ratio r above which a rock breaks."""
        return True


@kernel
def volume_of(rock: Rock) -> float:
    """Return the volume (m3) of a rock, from the radius of the sphere of equal volume."""
    return 4.0 / 3.0 * math.pi * rock.radius * rock.radius * rock.radius


@kernel
def surface_created(effect: Fragmentation, rock: Rock, off: float) -> float:
    """Return A_new / A_0 (-): the surface that an impact creates, divided by the surface of the rock.

    off : k_n v_n, speed off the ground after the rebound (m/s)
    """
    energy = 0.5 * rock.mass * off * off
    new = effect.surface_factor * energy**effect.surface_exponent
    return float(new / (6.0 * volume_of(rock) ** (2.0 / 3.0)))


@kernel
def new_surface_ratio(effect: Fragmentation, rock: Rock, off: float) -> float:
    """Return the ratio r = A_new / (A_new + A_0) (-); an impact breaks the rock if r exceeds a random limit.

    A_new is the surface (m2) that the impact creates; A_0 is the surface (m2) of the rock, a cube of equal volume.

    off : k_n v_n, speed off the ground after the rebound (m/s)
    """
    created = surface_created(effect, rock, off)
    return created / (1.0 + created)


@breaks.rule(Fragmentation)
def breaks_by_energy(effect: Fragmentation, before: Motion, after: Motion, n: Vec, rock: RockContext) -> bool:
    """Return True if an impact breaks the rock: the ratio r exceeds a limit drawn at random.

    A rock too small to give two fragments does not break.
    before : not used by this effect; after : motion just after the impact; n : unit normal of the ground
    """
    body: Any = rock.rock  # asks_rock and draws: neither rock nor key is None
    key: Any = rock.key
    if volume_of(body) < TWO_FRAGMENTS * effect.least_volume:
        return False
    u = 2.0 * uniform_at(key.seed, key.source, key.rock, BREAKING, rock.impacts + 1) - 1.0
    return new_surface_ratio(effect, body, max(dot(after.v, n), 0.0)) > effect.least_ratio * (1.0 + effect.spread * u)


def unbroken(effect: Any) -> Any:
    """Return an effect as it applies to fragments that may not break again.

    In `Fragmentation`, the limit of the ratio r becomes infinite; any other effect is returned unchanged.
    """
    return effect._replace(least_ratio=math.inf) if isinstance(effect, Fragmentation) else effect
