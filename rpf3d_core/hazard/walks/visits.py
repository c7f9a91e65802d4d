"""What one rock does in each cell that it comes to, gathered while its path is walked.

A cell is a number: of a square of the raster, a facet, a zone or an area. Visits are scratch of one thread; a batch
of rocks fills them, then they are folded into a `Tally`, under its lock.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.hazard.walks.tracks import Track, top_energy2
from rpf3d_core.hazard.walks.ways import begin_way
from rpf3d_core.jit.dispatch import kernel

FIRST, UNTIL = 0, 1
SPEED2, HEIGHT = 0, 1
PASSAGES, IMPACTS, DEPOSITS = 0, 1, 2
USED, OF_ROCK, FULL = 0, 1, 2
JOINED = 1e-9
"""Stays nearer in time than this (s) are one: a rock that bounces on the border of a cell is there all the time."""


class Visits(NamedTuple):
    """Room for N visits to C cells; those of one rock stand together.

    mark : (C,) where a cell's visit may stand: valid only if that visit is the rock's and names the cell, so that
        nothing need be cleared between rocks
    cell : (N,); times : (N, 2) s, first arrival and the end of the last stay
    most : (N, 2) the rock's largest squared speed (m^2/s^2) and height (m) in the cell
    counts : (N, 3) passages, impacts, deposits
    mass : (N,) kg, of the rock
    way : (N,) length of the rock's way in plan inside the cell, in cell widths; None where no map asks for it
    energy2 : (N,) twice the rock's largest kinetic energy in the cell, J/kg; None where rocks do not spin and the
        squared speed is all of it
    state : (3,) visits used, the first of the rock at hand, whether room has run out
    """

    mark: Any
    cell: Any
    times: Any
    most: Any
    counts: Any
    mass: Any
    state: Any
    way: Any = None
    energy2: Any = None


def empty_visits(cells: int, room: int, ways: bool = False, spins: bool = False) -> Visits:
    """No visits to C cells yet, with room for N.

    ways : whether the lengths of ways are gathered; spins : whether energies count rotation
    """
    return Visits(
        np.zeros(cells, dtype=np.int32), np.empty(room, dtype=np.int32), np.empty((room, 2)), np.empty((room, 2)),
        np.empty((room, 3), dtype=np.int32), np.empty(room), np.zeros(3, dtype=np.int64),
        np.empty(room) if ways else None, np.empty(room) if spins else None,
    )  # fmt: skip


@kernel
def next_rock(visits: Visits) -> None:
    """From here on another rock is at hand."""
    visits.state[OF_ROCK] = visits.state[USED]


@kernel
def take_back(visits: Visits) -> None:
    """Forget the visits of the rock at hand, which found no room."""
    visits.state[USED] = visits.state[OF_ROCK]
    visits.state[FULL] = 0


@kernel
def visited(visits: Visits, cell: int) -> int:
    """The rock's visit to a cell, -1 if it has not been there."""
    k = visits.mark[cell]
    there = visits.state[OF_ROCK] <= k < visits.state[USED] and visits.cell[k] == cell
    return int(k) if there else -1


@kernel
def visit(visits: Visits, cell: int, t: float, mass: float) -> int:
    """The rock's visit to a cell, begun at t (s) if it is the first; -1 where there is no room left."""
    k = visited(visits, cell)
    if k >= 0:
        return k
    k = int(visits.state[USED])
    if k == len(visits.cell):
        visits.state[FULL] = 1
        return -1
    visits.state[USED] = k + 1
    visits.mark[cell], visits.cell[k] = k, cell
    visits.times[k, FIRST], visits.times[k, UNTIL] = t, -math.inf
    visits.most[k, SPEED2], visits.most[k, HEIGHT], visits.mass[k] = 0.0, 0.0, mass
    visits.counts[k, PASSAGES], visits.counts[k, IMPACTS], visits.counts[k, DEPOSITS] = 0, 0, 0
    begin_way(visits.way, k)
    _begin_energy(visits.energy2, k)
    return k


@kernel
def note_stay(visits: Visits, k: int, begin: float, end: float, speed2: float) -> None:
    """The rock was in the cell of visit k from begin to end (s), at no more than some squared speed (m^2/s^2).

    A stay that begins when the last one ended, bounce or no bounce, is the same passage.
    """
    if k < 0:
        return
    if begin > visits.times[k, UNTIL] + JOINED:
        visits.counts[k, PASSAGES] += 1
    visits.times[k, FIRST] = min(visits.times[k, FIRST], begin)
    visits.times[k, UNTIL] = max(visits.times[k, UNTIL], end)
    visits.most[k, SPEED2] = max(visits.most[k, SPEED2], speed2)


@kernel
def _begin_energy(energy2: Any, k: int) -> None:
    """Begin visit k without energy; nothing where squared speeds are all of it (None)."""
    if energy2 is None:
        return
    energy2[k] = 0.0


@kernel
def note_energy2(energy2: Any, k: int, value: float) -> None:
    """The rock had as much as this of twice its kinetic energy (J/kg) in the cell of visit k."""
    if energy2 is None:
        return
    if k >= 0 and value > energy2[k]:
        energy2[k] = value


@kernel
def energy2_of(energy2: Any, visits: Visits, k: int) -> float:
    """Twice the rock's largest kinetic energy (J/kg) in the cell of visit k."""
    if energy2 is None:
        return float(visits.most[k, SPEED2])
    return float(energy2[k])


@kernel
def note_height(visits: Visits, k: int, height: float) -> None:
    """The rock was as high as this (m) above the ground in the cell of visit k."""
    if k >= 0 and height > visits.most[k, HEIGHT]:
        visits.most[k, HEIGHT] = height


@kernel
def visit_for(visits: Visits, cell: int, t: float, until: float, speed2: float, height: float, mass: float) -> int:
    """The rock was in a cell between two times (s), no faster and no higher than told (m^2/s^2, m); its visit."""
    k = visit(visits, cell, t, mass)
    note_stay(visits, k, t, until, speed2)
    note_height(visits, k, height)
    return k


@kernel
def note_track_energy(energy2: Any, k: int, track: Track, low: float, high: float) -> None:
    """Note the largest energy between two times of the walk of a track (s); nothing where rocks do not spin (None)."""
    if energy2 is None:
        return
    note_energy2(energy2, k, top_energy2(track, low, high))


@kernel
def note_count(visits: Visits, k: int, which: int) -> None:
    """One more impact or deposit in the cell of visit k."""
    if k >= 0:
        visits.counts[k, which] += 1
