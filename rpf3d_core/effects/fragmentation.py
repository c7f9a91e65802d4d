"""Rocks that break at an impact, after RockGIS (Matas et al. 2017 and 2020; physics reference 6.2).

The formulas and figures were read in RockGIS' source and defaults (CC), not in the papers; all are editable:

    E_n = 1/2 M (k_n v_n)^2          k_n v_n: the speed off the ground that the rebound model leaves
    A_new = a E_n^e                    new surface, m2; A_0 = 6 V^(2/3); r = A_new / (A_new + A_0)
    it breaks if r > least_ratio (1 +- spread U)
    b = max(1, 2.4875 - 1.6125 r), q = 1 - 0.5125 r
    V_k = q V k^(-1 / D), D = 3 + ln(1 - q) / ln(b), for k = 1, 2, ... until all of V is dealt or a piece is too small

What is left is the last piece; it or the first that is too small is dust. Doubtful in the source itself: the exponent
-1 / D stands on volumes where a function beside it cubes lengths; below r = 0.19 and above 0.65 D is negative, and a
rock then breaks in two, however hard it was hit.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.compiling import kernel
from rpf3d_core.effects.hooks import breaks
from rpf3d_core.materials.falling import Falling
from rpf3d_core.materials.streams import Purpose, uniform_at
from rpf3d_core.values import Motion, Rock, Vec
from rpf3d_core.vectors import dot

STEEP = 1e-2
"""D below which the second piece is none: 2^-100 of the first, or more than all of the rock."""
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
def new_surface_ratio(effect: Fragmentation, rock: Rock, off: float) -> float:
    """r: new surface over all surface; off : k_n v_n, m/s."""
    energy = 0.5 * rock.mass * off * off
    new = effect.surface_factor * energy**effect.surface_exponent
    return float(new / (new + 6.0 * volume_of(rock) ** (2.0 / 3.0)))


@breaks.rule(Fragmentation)
def breaks_by_energy(effect: Fragmentation, before: Motion, after: Motion, n: Vec, falling: Falling) -> bool:
    """Whether the new surface is more than the rock can stand; a rock too small to give a piece stays whole."""
    rock: Any = falling.rock  # there is one, and a key: it asks for them
    key: Any = falling.key
    if volume_of(rock) < effect.least_volume:
        return False
    u = 2.0 * uniform_at(key.seed, key.source, key.rock, BREAKING, falling.impacts + 1) - 1.0
    return new_surface_ratio(effect, rock, max(dot(after.v, n), 0.0)) > effect.least_ratio * (1.0 + effect.spread * u)


def shares_of(ratio: float, least: float) -> tuple[list[float], float]:
    """Shares of a rock's volume that its pieces have, in the order of the power law, and what is dust; together 1.

    ratio : r, within (0, 1); least : share that a piece must have to fly
    """
    b, q = max(1.0, 2.4875 - 1.6125 * ratio), 1.0 - 0.5125 * ratio
    dimension = 3.0 + math.log(1.0 - q) / math.log(b) if b > 1.0 else -math.inf
    shares: list[float] = []
    left, k = 1.0, 1
    while left >= least:
        share = q * k ** (-1.0 / dimension) if abs(dimension) > STEEP else (q if k == 1 else 0.0)
        if share < least:
            break
        shares.append(min(share, left))
        left = max(left - share, 0.0)
        k += 1
    return ([*shares, left], 0.0) if left >= least else (shares, left)


def unbroken(effect: Any) -> Any:
    """The same effect for rocks that may not break any more; others as they are."""
    return effect._replace(least_ratio=math.inf) if isinstance(effect, Fragmentation) else effect
