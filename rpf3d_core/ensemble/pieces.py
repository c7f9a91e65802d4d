"""Make the fragments of rocks that broke, as new releases that fly like rocks.

All fragments of a rock form a family. A fragment has the source and the rock number of this rock, and a number within
the family. Numbers count from 1 in the order in which fragments are made: by generation, then by parent, then by size.
The random numbers of a fragment use the key source + SOURCES * number. This key is unique while there are at most
SOURCES (65,536) sources.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from rpf3d_core.effects.fragment_sizes import Cascade, cascade_of, count_from, share_at
from rpf3d_core.effects.fragmentation import Fragmentation, surface_created, unbroken, volume_of
from rpf3d_core.effects.hooks import chain_of, links_of
from rpf3d_core.ensemble.broken import DUST_UNITS, NONE_BROKEN, SOURCES, Broken, rows_of_broken
from rpf3d_core.ensemble.releases import FloatArray, IntArray, Releases
from rpf3d_core.errors import InputError
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.materials.streams import Purpose, uniform_at
from rpf3d_core.values import Rock, Vec
from rpf3d_core.vectors import add, along, cross, dot, norm, scale

TILT, TURN = int(Purpose.PIECE_TILT), int(Purpose.PIECE_TURN)
"""Purposes of the two random numbers that select a fragment's direction in a cone about the direction of the rock.

TILT selects the angle from the direction of the rock, TURN the angle around it.
"""
PIECES = 65_536
"""Approximate number of fragments in memory at a time; one rock may have more."""


class Breaking:
    """Makes the fragments of the broken rocks of one block: first of the rocks, then of broken fragments, and so on.

    flight : physics for the fragments of the latest generation; the last allowed generation cannot break again
    compiled : True if compiled code makes the fragments
    """

    def __init__(self, flight: Any, compiled: bool = True) -> None:
        """Find the effect `Fragmentation` in the physics of the rocks.

        flight : a `batches.Flight`; compiled : True if compiled code makes the fragments
        """
        self.flight, self._compiled = flight, compiled
        self._links = links_of(flight.models.effects)
        self._effect = next(effect for effect in self._links if isinstance(effect, Fragmentation))
        self._left = self._effect.generations
        self._numbered: dict[Any, int] = {}

    @property
    def goes_on(self) -> bool:
        """True if the latest generation may break: the rocks themselves at first, later the latest fragments."""
        return self._left > 0

    def pieces_of(self, releases: Releases, broken: Broken) -> Iterator[tuple[Releases, int]]:
        """Yield the fragments of broken rocks, in parts: the releases of a part, and its mass of dust in DUST_UNITS.

        Dust is the fragments that are too small to fly. The parent of a fragment is the rock or fragment that broke.
        Each call makes one generation; the last allowed generation changes `flight`, so that nothing breaks again.
        Each part contains about PIECES fragments, of any number of parents, in the order of the parents.

        releases : releases among which the parents are; broken : the parents, with their state when they broke
        """
        self._left -= 1
        if not self._left:
            whole = chain_of([unbroken(effect) for effect in self._links])
            self.flight = replace(self.flight, models=self.flight.models._replace(effects=whole))
        seed = self.flight.settings.seed
        _, counts = _sized(self._effect, releases, broken, self._compiled)
        for begin, end in _parts(counts, PIECES):
            some = rows_of_broken(broken, slice(begin, end))
            yield pieces_of(self._effect, seed, releases, some, self._numbered, self._compiled)

    def precompile(self) -> None:
        """Compile the functions that make fragments now, so that the first broken rock does not wait."""
        nothing = Releases(*(np.empty(0, np.int64),) * 2, *(np.empty((0, 3)),) * 2, *(np.empty(0),) * 2)
        pieces_of(self._effect, self.flight.settings.seed, nothing, NONE_BROKEN, {}, self._compiled)


def pieces_of(
    effect: Fragmentation, seed: int, releases: Releases, broken: Broken, numbered: dict[Any, int],
    compiled: bool = True,
) -> tuple[Releases, int]:  # fmt: skip
    """Return the fragments of N broken rocks as releases, and the mass of dust (fragments too small to fly).

    The mass of dust is in DUST_UNITS. A family is all fragments of one released rock.

    releases : releases of the rocks or fragments that flew; `broken.rows` are rows of these releases
    numbered : last fragment number used in each family, by source and rock; the function updates this dictionary
    compiled : True if compiled code makes the fragments

    Raises
    ------
    InputError
        A released rock has SOURCES fragments or more.
    """
    source, rock, mass, radius = (getattr(releases, name)[broken.rows] for name in ("source", "rock", "mass", "radius"))
    cascades, counts = _sized(effect, releases, broken, compiled)
    parent = np.repeat(np.arange(len(mass)), counts)
    rank = np.arange(1, len(parent) + 1) - np.repeat(np.cumsum(counts) - counts, counts)
    piece = _last_numbers(source, rock, counts, numbered)[parent] + rank
    v, shares = np.empty((len(parent), 3)), np.empty(len(parent))
    key = source[parent] + SOURCES * piece, rock[parent]
    make: Any = _make_all
    (make if compiled else make.py_func)(effect, seed, (parent, rank), key, (cascades, broken.v, broken.n), v, shares)
    left = np.maximum(1.0 - np.bincount(parent, weights=shares, minlength=len(mass)), 0.0)
    dust = sum(map(round, (mass * left * DUST_UNITS).tolist()))
    sizes = mass[parent] * shares, radius[parent] * np.cbrt(shares)
    made = Releases(source[parent], rock[parent], broken.x[parent], v, *sizes, piece, broken.t[parent])
    return made, dust


def _sized(
    effect: Fragmentation, releases: Releases, broken: Broken, compiled: bool
) -> tuple[FloatArray, IntArray]:  # fmt: skip
    """Return the size law of the fragments of each of N broken rocks (N, 2), and the number of its fragments (N,).

    The size law has two columns, as in `Cascade`: the exponent of the law, and the share (-) of the rock's volume in
    the largest fragment.

    releases : of the parents; broken : the rocks that broke; compiled : True for the compiled engine
    """
    mass, radius = releases.mass[broken.rows], releases.radius[broken.rows]
    cascades, counts = np.empty((len(mass), 2)), np.empty(len(mass), dtype=np.int64)
    size: Any = _size_all
    (size if compiled else size.py_func)(effect, mass, radius, broken.v, broken.n, cascades, counts)
    return cascades, counts


def _parts(counts: IntArray, most: int) -> list[tuple[int, int]]:
    """Divide N broken rocks into ranges (begin, end), each range with about `most` fragments, to limit the memory.

    counts : (N,) number of fragments of each rock
    """
    part = (np.cumsum(counts) - counts) // most
    begins = np.flatnonzero(np.diff(part, prepend=-1)).tolist()
    return list(zip(begins, [*begins[1:], len(counts)], strict=True))


def _last_numbers(source: IntArray, rock: IntArray, counts: IntArray, numbered: dict[Any, int]) -> IntArray:
    """For each of N broken rocks, return the fragment number (N,) after which its new fragments are numbered.

    A family is all fragments of one released rock. The returned number is the last number used in the family of the
    broken rock, 0 if the family has no fragments yet. If several of the N broken rocks belong to one family, their new
    fragments are numbered one broken rock after another.

    source, rock : (N,) numbers that identify the family of each rock; counts : (N,) number of its new fragments
    numbered : last fragment number used in each family, by source and rock; the function updates this dictionary

    Raises
    ------
    InputError
        A family has SOURCES fragments or more.
    """
    last = []
    for place, number, count in zip(source.tolist(), rock.tolist(), counts.tolist(), strict=True):
        last.append(numbered.get((place, number), 0))
        numbered[place, number] = last[-1] + count
    if max(numbered.values(), default=0) >= SOURCES:
        raise InputError(
            f"effects.fragmentation: one rock breaks into more than {SOURCES - 1:,} pieces in all; give a greater "
            "least_volume, fewer generations or a greater least_ratio"
        )
    return np.array(last, dtype=np.int64)


@loop
def _size_all(effect: Fragmentation, mass: Any, radius: Any, v: Any, n: Any, cascades: Any, counts: Any) -> None:
    """Write the size law of the fragments of N rocks into cascades (N, 2), and their number into counts (N,).

    mass, radius : (N,) kg and m; v, n : (N, 3) velocity (m/s) after the impact and normal of the ground
    cascades : columns as in `_sized`
    """
    for i in range(len(mass)):
        rock = Rock(mass[i], radius[i])
        off = v[i, 0] * n[i, 0] + v[i, 1] * n[i, 1] + v[i, 2] * n[i, 2]
        cascade = cascade_of(surface_created(effect, rock, max(off, 0.0)))
        cascades[i, 0], cascades[i, 1] = cascade.exponent, cascade.largest
        counts[i] = count_from(cascade, effect.least_volume / volume_of(rock))


@loop
def _make_all(effect: Fragmentation, seed: int, which: Any, key: Any, parents: Any, v: Any, shares: Any) -> None:
    """Write the velocities v (P, 3) m/s of P fragments, and the share (P,) of the parent's mass in each fragment.

    which : two arrays: (P,) number of the parent, from 0, and (P,) rank by size among its fragments, from 1
    key : two arrays (P,) that select the random numbers: source + SOURCES * fragment number, and rock number
    parents : three arrays for N parents: size laws (N, 2) as in `_sized`, velocities (N, 3) m/s and normals (N, 3)
    """
    parent, rank = which
    source, rock = key
    cascades, before, normal = parents
    for k in range(len(shares)):
        i = parent[k]
        a, b = int(source[k]), int(rock[k])
        tilt, turn = uniform_at(seed, a, b, TILT, 0), uniform_at(seed, a, b, TURN, 0)
        off = (normal[i, 0], normal[i, 1], normal[i, 2])
        way = thrown(effect, (before[i, 0], before[i, 1], before[i, 2]), off, tilt, turn)
        v[k, 0], v[k, 1], v[k, 2] = way
        shares[k] = share_at(Cascade(cascades[i, 0], cascades[i, 1]), rank[k])


@kernel
def thrown(effect: Fragmentation, v: Vec, n: Vec, tilt: float, turn: float) -> Vec:
    """Return the velocity (3,) m/s of a fragment of a rock that broke at an impact.

    The speed is |v| times `effect.speed_kept`. The directions of fragments are spread evenly over a cone about v. A
    direction whose angle to the ground is below `effect.least_angle` is raised to this angle.

    v : m/s, velocity of the rock after the impact; n : unit normal of the ground
    tilt, turn : uniform numbers in [0, 1) that select the direction
    """
    speed = norm(v)
    axis = scale(1.0 / speed, v) if speed > 0.0 else n
    aside = _unit(cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0)))
    cosine = 1.0 - tilt * (1.0 - math.cos(effect.cone))
    sine, angle = math.sqrt(max(1.0 - cosine * cosine, 0.0)), 2.0 * math.pi * turn
    across = add(scale(math.cos(angle), aside), scale(math.sin(angle), cross(axis, aside)))
    way = add(scale(cosine, axis), scale(sine, across))
    if dot(way, n) < math.sin(effect.least_angle):
        flat = along(way, n)
        flat = _unit(flat) if dot(flat, flat) > 0.0 else aside
        way = add(scale(math.cos(effect.least_angle), flat), scale(math.sin(effect.least_angle), n))
    return scale(effect.speed_kept * speed, way)


@kernel
def _unit(a: Vec) -> Vec:
    """Return the unit vector along vector a, whose length is above 0."""
    return scale(1.0 / norm(a), a)
