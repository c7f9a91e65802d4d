"""Writing down impacts and paths while flying, into room of a fixed size.

A rock that finds no room left flies on without being written down, and flies again once there is room. Whether to
write at all is asked while running, not by compiling the loop twice: that would double the seconds of the first call
for less than 1 % of a flight.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.simulation.state import RockTally
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import norm, scale

FIRST_OBSTACLE = -2
"""What stands for a facet in the row of a meeting with obstacle 0; those after it go down from there."""

IMPACT_COLUMNS, PIECE_COLUMNS, SPIN_COLUMNS = 9, 10, 2
"""Of rows of impacts and pieces, and how many more they have where rocks spin."""


class Record(NamedTuple):
    """Rows to write to: impacts (I, 9) and facets (I,) from row `first_impact`, pieces (S, 10) from `first_piece`.

    Without rows for pieces nothing is written (`writes`). A meeting with an obstacle has a row among the impacts, and
    instead of a facet `FIRST_OBSTACLE` minus the obstacle's number.

    impacts : t, x, y, z, n_x, n_y, n_z, speed in, speed out
    pieces : t, x, y, z, v_x, v_y, v_z at the start, v_x, v_y, v_z at the end; modes (S,) : `values.Mode`
    spins : None, or True where rocks spin: impacts have two more columns then, the spin (rad/s) before and after, and
        pieces, at the start and the end
    """

    impacts: Any
    facets: Any
    pieces: Any
    modes: Any
    first_impact: int
    first_piece: int
    spins: Any = None


def empty_record(impacts: int, pieces: int, spins: bool = False) -> Record:
    """A record with room for so many impacts and pieces, and for spins where rocks have some."""
    more = SPIN_COLUMNS if spins else 0
    return Record(
        np.empty((impacts, IMPACT_COLUMNS + more)), np.empty(impacts, dtype=np.int64),
        np.empty((pieces, PIECE_COLUMNS + more)), np.empty(pieces, dtype=np.int64), 0, 0, True if spins else None,
    )  # fmt: skip


@kernel
def writes(record: Record) -> bool:
    """Whether anything is to be written down."""
    return len(record.modes) > 0


@kernel
def record_from(record: Record, first: Any, i: int) -> Record:
    """The record as rock i writes to it, from row first[i, 0] of the impacts and first[i, 1] of the pieces."""
    return Record(record.impacts, record.facets, record.pieces, record.modes, first[i, 0], first[i, 1], record.spins)


@kernel
def close_rock(record: Record, tally: RockTally, first: Any, i: int) -> bool:
    """Set where the rock after rock i writes to; False where rock i, now at its end, did not find room.

    A path has one row more than pieces: its end.
    """
    if not writes(record):
        return True
    first[i + 1, 0] = first[i, 0] + tally.impacts + tally.meetings
    first[i + 1, 1] = first[i, 1] + tally.pieces + 1
    return bool(first[i + 1, 0] <= len(record.facets) and first[i + 1, 1] <= len(record.modes))


@kernel
def against(v: Vec) -> Vec:
    """What stands for the normal of an obstacle that a rock meets with velocity v: against it; upwards if it is 0."""
    speed = norm(v)
    return scale(-1.0 / speed, v) if speed > 0.0 else (0.0, 0.0, 1.0)


@kernel
def note_impact(record: Record, tally: RockTally, before: Motion, after: Motion, facet: int, n: Vec) -> None:
    """Write down the impact, or the meeting, that comes next in the tally."""
    i = record.first_impact + tally.impacts + tally.meetings
    if i >= len(record.facets):
        return
    row, x = record.impacts[i], before.x
    row[0], row[1], row[2], row[3] = before.t, x[0], x[1], x[2]
    row[4], row[5], row[6] = n
    row[7], row[8] = norm(before.v), norm(after.v)
    note_spins(record.spins, row, IMPACT_COLUMNS, before.w, after.w)
    record.facets[i] = facet


@kernel
def note_piece(record: Record, tally: RockTally, start: Motion, v_end: Vec, mode: int) -> None:
    """Write down the piece of path that comes next in the tally."""
    i = record.first_piece + tally.pieces
    if i >= len(record.modes):
        return
    row = record.pieces[i]
    row[0], row[1], row[2], row[3] = start.t, start.x[0], start.x[1], start.x[2]
    row[4], row[5], row[6] = start.v
    row[7], row[8], row[9] = v_end
    note_spins(record.spins, row, PIECE_COLUMNS, start.w, start.w)
    record.modes[i] = mode


@kernel
def note_spins(spins: Any, row: Any, column: int, begin: Vec, end: Vec) -> None:
    """Write down two spins (rad/s) from a column of a row on; nothing where rocks have none (None)."""
    if spins is None:
        return
    row[column], row[column + 1] = norm(begin), norm(end)


@kernel
def note_piece_spins(record: Record, tally: RockTally, begin: Vec, end: Vec) -> None:
    """Write down the spins (rad/s) at the ends of the piece of path that comes next in the tally."""
    i = record.first_piece + tally.pieces
    if i < len(record.modes):
        note_spins(record.spins, record.pieces[i], PIECE_COLUMNS, begin, end)
