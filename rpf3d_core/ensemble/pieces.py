"""The pieces of rocks that broke, as releases of their own.

A piece has its parent's source and number, and a number of its own within this family, from 1 in the order in which
pieces come to be: generation by generation, by parent, by the power law. Its draws are those of the source's number
plus SOURCES times its own: no other rock, piece or not, has that, as long as there are fewer than SOURCES sources.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from rpf3d_core.effects.fragmentation import Fragmentation, new_surface_ratio, shares_of, unbroken, volume_of
from rpf3d_core.effects.hooks import chain_of, links_of
from rpf3d_core.ensemble.broken import DUST_UNITS, SOURCES, Broken
from rpf3d_core.ensemble.releases import FloatArray, Releases
from rpf3d_core.materials.streams import Purpose, uniform_at
from rpf3d_core.values import Rock

TILT, TURN = int(Purpose.PIECE_TILT), int(Purpose.PIECE_TURN)


class Breaking:
    """Pieces of the rocks of one block, generation by generation.

    flight : what governs the pieces that were made last: those of the last generation break no more
    """

    def __init__(self, flight: Any) -> None:
        """Take the effect from what flies (`batches.Flight`)."""
        self.flight = flight
        self._links = links_of(flight.models.effects)
        self._effect = next(effect for effect in self._links if isinstance(effect, Fragmentation))
        self._left = self._effect.generations
        self._numbered: dict[Any, int] = {}

    @property
    def goes_on(self) -> bool:
        """Whether rocks that fly now may break."""
        return self._left > 0

    def pieces_of(self, releases: Releases, broken: Broken) -> tuple[Releases, int]:
        """The next generation, of rocks or pieces that flew, and its dust in DUST_UNITS."""
        self._left -= 1
        if not self._left:
            whole = chain_of([unbroken(effect) for effect in self._links])
            self.flight = replace(self.flight, models=self.flight.models._replace(effects=whole))
        return pieces_of(self._effect, self.flight.settings.seed, releases, broken, self._numbered)


def pieces_of(
    effect: Fragmentation, seed: int, releases: Releases, broken: Broken, numbered: dict[Any, int]
) -> tuple[Releases, int]:
    """The pieces of rocks that broke, and the mass of what is too small to fly, in DUST_UNITS.

    releases : of the rocks, or pieces, that flew; numbered : the last number given in each family, which is carried on
    """
    made: list[tuple[Any, ...]] = []
    dust = 0
    for i, row in enumerate(broken.rows):
        rock = Rock(float(releases.mass[row]), float(releases.radius[row]))
        source, number = int(releases.source[row]), int(releases.rock[row])
        v, n = broken.v[i], broken.n[i]
        ratio = new_surface_ratio(effect, rock, max(float(v @ n), 0.0))
        shares, lost = shares_of(ratio, effect.least_volume / volume_of(rock))
        dust += round(rock.mass * lost * DUST_UNITS)
        for share in shares:
            piece = numbered[source, number] = numbered.get((source, number), 0) + 1
            draws = [uniform_at(seed, source + SOURCES * piece, number, purpose, 0) for purpose in (TILT, TURN)]
            size = (rock.mass * share, rock.radius * share ** (1.0 / 3.0))
            made.append((source, number, broken.x[i], thrown(effect, v, n, *draws), *size, piece, broken.t[i]))
    return _released(made), dust


def _released(made: list[tuple[Any, ...]]) -> Releases:
    """Releases of rows (source, rock, x, v, mass, radius, piece, t)."""
    columns: list[Any] = list(zip(*made, strict=True)) or [()] * 8
    source, rock, piece = (np.array(columns[k], dtype=np.int64) for k in (0, 1, 6))
    x, v = (np.array(columns[k], dtype=float).reshape(-1, 3) for k in (2, 3))
    mass, radius, t = (np.array(columns[k], dtype=float) for k in (4, 5, 7))
    return Releases(source, rock, x, v, mass, radius, piece, t)


def thrown(effect: Fragmentation, v: FloatArray, n: FloatArray, tilt: float, turn: float) -> FloatArray:
    """The velocity (3,) of a piece of a rock that left the ground of unit normal n with v.

    Its direction is spread evenly over a cone about v, and raised where it is nearer to the ground than allowed.
    tilt, turn : in [0, 1)
    """
    speed = float(np.linalg.norm(v))
    axis = v / speed if speed > 0.0 else n
    aside = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
    aside /= np.linalg.norm(aside)
    cosine = 1.0 - tilt * (1.0 - np.cos(effect.cone))
    sine, angle = np.sqrt(max(1.0 - cosine * cosine, 0.0)), 2.0 * np.pi * turn
    way = cosine * axis + sine * (np.cos(angle) * aside + np.sin(angle) * np.cross(axis, aside))
    along = way - (way @ n) * n
    if way @ n < np.sin(effect.least_angle):
        flat = np.linalg.norm(along)
        along = along / flat if flat > 0.0 else aside
        way = np.cos(effect.least_angle) * along + np.sin(effect.least_angle) * n
    return np.asarray(effect.speed_kept * speed * way)
