"""Visits: one record for each rock in each cell that it reaches, collected while its path is followed.

A cell is given by the number of a square of the raster, of a facet, of a zone or of an area. Each thread has its own
visits: it collects the visits of a batch of rocks, and then adds them to a `CellTally` under the tally's lock.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.hazard.walks.tracks import Track, top_energy2
from rpf3d_core.hazard.walks.ways import begin_length
from rpf3d_core.jit.dispatch import kernel

FIRST, UNTIL = 0, 1
"""Columns of `Visits.times`: first arrival, and end of the last stay."""
SPEED2, HEIGHT = 0, 1
"""Columns of `Visits.most`: largest squared speed and largest height."""
PASSAGES, IMPACTS, DEPOSITS = 0, 1, 2
"""Columns of `Visits.counts`: passages, impacts and deposits."""
USED, OF_ROCK, FULL, ROW = 0, 1, 2, 3
"""Entries of `Visits.state`.

They are the number of visits, the first visit of the current rock, a flag for no more room, and the row of the current
rock in its batch.
"""
JOINED = 1e-9
"""Largest time (s) between two stays in a cell that count as one stay.

So a rock that bounces on the border of a cell counts as staying in the cell.
"""


class Visits(NamedTuple):
    """Memory for N visits to C cells; the visits of one rock are consecutive.

    mark : (C,) index of the last visit to each cell. It is valid only if this visit belongs to the current rock and to
        this cell, so nothing needs to be cleared between rocks.
    cell : (N,) number of the cell; times : (N, 2) s, first arrival and end of the last stay
    most : (N, 2) the rock's largest squared speed (m^2/s^2) and height (m) in the cell
    counts : (N, 3) passages, impacts, deposits
    mass : (N,) kg, of the rock
    way : (N,) length of the rock's path in plan inside the cell, in cell widths; None if no map needs it
    energy2 : (N,) twice the rock's largest kinetic energy in the cell, J/kg; None if rocks do not spin, because the
        squared speed is then enough
    state : (4,) number of visits, first visit of the current rock, 1 if room has run out, row of the current rock
    rock : (N,) row of the rock in its batch; None if nothing is counted for each source

    If only the rocks in each cell are counted, `times`, `most`, `counts` and `mass` are None.
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
    rock: Any = None


def empty_visits(
    cells: int, room: int, ways: bool = False, spins: bool = False, rocks: bool = False, figures: bool = True
) -> Visits:
    """Return empty memory for `room` visits to `cells` cells.

    ways : True to record the lengths of paths; spins : True if energies include rotation
    rocks : True to record which rock each visit belongs to; figures : False to record only which cells a rock reaches
    """
    return Visits(
        mark=np.zeros(cells, dtype=np.int32),
        cell=np.empty(room, dtype=np.int32),
        times=np.empty((room, 2)) if figures else None,
        most=np.empty((room, 2)) if figures else None,
        counts=np.empty((room, 3), dtype=np.int32) if figures else None,
        mass=np.empty(room) if figures else None,
        state=np.zeros(4, dtype=np.int64),
        way=np.empty(room) if ways else None,
        energy2=np.empty(room) if spins else None,
        rock=np.empty(room, dtype=np.int64) if rocks else None,
    )


@kernel
def next_rock(visits: Visits, r: int) -> None:
    """Begin the visits of a new rock: all visits that are added from now on belong to this rock.

    r : row of the rock in its batch
    """
    visits.state[OF_ROCK], visits.state[ROW] = visits.state[USED], r


@kernel
def take_back(visits: Visits) -> None:
    """Remove the visits of the current rock, because there was no room for all of them."""
    visits.state[USED] = visits.state[OF_ROCK]
    visits.state[FULL] = 0


@kernel
def visited(visits: Visits, cell: int) -> int:
    """Return the index of the current rock's visit to a cell; -1 if the rock has not been there."""
    k = visits.mark[cell]
    there = visits.state[OF_ROCK] <= k < visits.state[USED] and visits.cell[k] == cell
    return int(k) if there else -1


@kernel
def visit(visits: Visits, cell: int, t: float, mass: float) -> int:
    """Return the index of the current rock's visit to a cell; begin a new visit at the time t (s) if needed.

    Returns -1 if there is no room for a new visit.

    cell : number of the cell, facet, zone or area; mass : of the rock, kg
    """
    k = visited(visits, cell)
    if k >= 0:
        return k
    k = int(visits.state[USED])
    if k == len(visits.cell):
        visits.state[FULL] = 1
        return -1
    visits.state[USED] = k + 1
    visits.mark[cell], visits.cell[k] = k, cell
    _begin_figures(visits.times, visits, k, t, mass)
    begin_length(visits.way, k)
    _begin_energy(visits.energy2, k)
    _note_rock(visits.rock, k, visits.state[ROW])
    return k


@kernel
def note_stay(visits: Visits, k: int, begin: float, end: float, speed2: float) -> None:
    """Record that the rock is in the cell of visit k from `begin` to `end` (s).

    speed2 : largest squared speed of the rock in this time (m^2/s^2)

    A stay that begins when the last stay ended belongs to the same passage, even after a bounce. The function does
    nothing if k is -1, which means that there was no room for the visit.
    """
    if k >= 0:
        _note_times(visits.times, visits, k, begin, end, speed2)


@kernel
def _begin_figures(times: Any, visits: Visits, k: int, t: float, mass: float) -> None:
    """Set the figures of a new visit k, which begins at the time t (s), to their first values.

    times : as in `Visits`; None if only the rocks in each cell are counted: the call then does nothing
    mass : of the rock, kg
    """
    if times is None:
        return
    times[k, FIRST], times[k, UNTIL] = t, -math.inf
    visits.most[k, SPEED2], visits.most[k, HEIGHT], visits.mass[k] = 0.0, 0.0, mass
    visits.counts[k, PASSAGES], visits.counts[k, IMPACTS], visits.counts[k, DEPOSITS] = 0, 0, 0


@kernel
def _note_times(times: Any, visits: Visits, k: int, begin: float, end: float, speed2: float) -> None:
    """Record in visit k that the rock is in the cell from `begin` to `end` (s), as `note_stay` does.

    times : as in `Visits`; None if only the rocks in each cell are counted: the call then does nothing
    speed2 : largest squared speed of the rock in this time (m^2/s^2)
    """
    if times is None:
        return
    if begin > times[k, UNTIL] + JOINED:
        visits.counts[k, PASSAGES] += 1
    times[k, FIRST] = min(times[k, FIRST], begin)
    times[k, UNTIL] = max(times[k, UNTIL], end)
    visits.most[k, SPEED2] = max(visits.most[k, SPEED2], speed2)


@kernel
def _note_rock(rock: Any, k: int, r: int) -> None:
    """Record that visit number k belongs to the rock in row r of its batch; do nothing if rock is None.

    rock : as in `Visits`
    """
    if rock is None:
        return
    rock[k] = r


@kernel
def _begin_energy(energy2: Any, k: int) -> None:
    """Set the energy of a new visit k to 0; do nothing if energies are not recorded (`energy2` is None)."""
    if energy2 is None:
        return
    energy2[k] = 0.0


@kernel
def note_energy2(energy2: Any, k: int, value: float) -> None:
    """Record a kinetic energy of the rock in the cell of visit k, if it is the largest there so far.

    The function does nothing if k is -1.

    energy2 : (N,) largest value of each visit so far (J/kg); None if rocks do not spin: the call then does nothing
    value : twice the kinetic energy per unit of mass (J/kg)
    """
    if energy2 is None:
        return
    if k >= 0 and value > energy2[k]:
        energy2[k] = value


@kernel
def energy2_of(energy2: Any, visits: Visits, k: int) -> float:
    """Return the rock's largest kinetic energy in the cell of visit k, as twice the energy over the mass (J/kg).

    energy2 : (N,) twice the largest kinetic energy per mass of each visit (J/kg); None if rocks do not spin: the result
        is then the largest squared speed, which is equal
    """
    if energy2 is None:
        return float(visits.most[k, SPEED2])
    return float(energy2[k])


@kernel
def note_height(visits: Visits, k: int, height: float) -> None:
    """Record a height (m) of the rock above ground in visit k, if it is the largest so far; do nothing if k is -1."""
    if k >= 0:
        _note_height(visits.most, k, height)


@kernel
def _note_height(most: Any, k: int, height: float) -> None:
    """Record a height (m) of the rock in visit k, if it is the largest so far; do nothing if `most` is None.

    most : as in `Visits`
    """
    if most is None:
        return
    if height > most[k, HEIGHT]:
        most[k, HEIGHT] = height


@kernel
def visit_for(visits: Visits, cell: int, t: float, until: float, speed2: float, height: float, mass: float) -> int:
    """Record that the rock is in a cell from `t` to `until` (s); return the index of the visit, -1 without room.

    speed2 : largest squared speed in this time (m^2/s^2); height : largest height (m); mass : of the rock (kg)
    """
    k = visit(visits, cell, t, mass)
    note_stay(visits, k, t, until, speed2)
    note_height(visits, k, height)
    return k


@kernel
def note_track_energy(energy2: Any, k: int, track: Track, low: float, high: float) -> None:
    """Record in visit k the largest kinetic energy, with rotation, that the rock has between two times of a track (s).

    energy2 : (N,) twice the largest kinetic energy per mass of each visit (J/kg); None if rocks do not spin: the call
        then does nothing
    low, high : the two times
    """
    if energy2 is None:
        return
    note_energy2(energy2, k, top_energy2(track, low, high))


@kernel
def note_count(visits: Visits, k: int, which: int) -> None:
    """Count one more impact or deposit in the cell of visit k; do nothing if k is -1.

    which : IMPACTS or DEPOSITS
    """
    if k >= 0:
        _add_one(visits.counts, k, which)


@kernel
def _add_one(counts: Any, k: int, which: int) -> None:
    """Add one to a count of visit k; do nothing if `counts` is None; counts : as in `Visits`; which : its column."""
    if counts is None:
        return
    counts[k, which] += 1
