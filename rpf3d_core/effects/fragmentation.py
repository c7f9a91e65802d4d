"""When an impact breaks a rock, and how much new surface it creates, after RockGIS (physics reference 6.2).

    E_n = 1/2 M (k_n v_n)^2            k_n v_n: the speed off the ground that the rebound model leaves
    A_new = a E_n^e                      new surface, m2; A_0 = 6 V^(2/3); r = A_new / (A_new + A_0)
    it breaks if r > least_ratio (1 +- spread U)

Formulas and figures were read in RockGIS' source and defaults (CC), not in the papers. UNCONFIRMED: `least_ratio`, and
that a and e hold with other rebounds than RockGIS' own, whose k_n is 0.19 at a head-on impact: the greater k_n, the
greater E_n of the same fall.

The sizes of the fragments (`fragment_sizes.py`) are not those of RockGIS' source, where b = max(1, 2.4875 - 1.6125 r),
q = 1 - 0.5125 r, D = 3 + ln(1 - q) / ln(b) and V_k = q V k^(-1 / D). That puts an exponent of lengths on volumes. Its D
falls again beyond r = 0.46 and is negative below 0.19 and above 0.65, so harder impacts give fewer fragments (23 at
r = 0.5, 5 at 0.6, 2 from 0.64). Their surface has nothing to do with A_new.
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
"""Least volumes that a rock must have to break: the second of its fragments has at most 0.154 of it."""
BREAKING = int(Purpose.BREAKING)


class Fragmentation(NamedTuple):
    """When a rock breaks, and what of.

    surface_factor : a, m2 / J^e; surface_exponent : e (-); least_ratio : of r, beyond which a rock breaks (-)
    spread : of least_ratio from impact to impact, as a share of it; least_volume : m3 of a piece that flies
    speed_kept : share of the speed after the impact; cone : rad, half of the angle about it that pieces fly in
    least_angle : rad, of a piece's way off the ground; generations : how often a rock and its pieces may break in turn
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
        """Its rules ask for mass and radius."""
        return True

    @property
    def draws(self) -> bool:
        """The ratio beyond which a rock breaks is drawn."""
        return True


@kernel
def volume_of(rock: Rock) -> float:
    """Volume (m3) of a rock."""
    return 4.0 / 3.0 * math.pi * rock.radius * rock.radius * rock.radius


@kernel
def surface_created(effect: Fragmentation, rock: Rock, off: float) -> float:
    """Return A_new / A_0, the surface that an impact creates over the rock's own; off : k_n v_n, m/s."""
    energy = 0.5 * rock.mass * off * off
    new = effect.surface_factor * energy**effect.surface_exponent
    return float(new / (6.0 * volume_of(rock) ** (2.0 / 3.0)))


@kernel
def new_surface_ratio(effect: Fragmentation, rock: Rock, off: float) -> float:
    """Return r, new surface over all surface; off : k_n v_n, m/s."""
    created = surface_created(effect, rock, off)
    return created / (1.0 + created)


@breaks.rule(Fragmentation)
def breaks_by_energy(effect: Fragmentation, before: Motion, after: Motion, n: Vec, falling: RockContext) -> bool:
    """Whether the new surface is more than the rock can stand; a rock too small to give two pieces stays whole."""
    rock: Any = falling.rock  # there is one, and a key: it asks for them
    key: Any = falling.key
    if volume_of(rock) < TWO_FRAGMENTS * effect.least_volume:
        return False
    u = 2.0 * uniform_at(key.seed, key.source, key.rock, BREAKING, falling.impacts + 1) - 1.0
    return new_surface_ratio(effect, rock, max(dot(after.v, n), 0.0)) > effect.least_ratio * (1.0 + effect.spread * u)


def unbroken(effect: Any) -> Any:
    """The same effect for rocks that may not break any more; others as they are."""
    return effect._replace(least_ratio=math.inf) if isinstance(effect, Fragmentation) else effect
