"""Record of impacts and paths, written during the flight into memory of a fixed size.

A rock that finds no room left flies on without being written, and flies again once there is room. Whether to write is
decided at run time. Compiling the loop twice instead would double the time of the first call, to save less than 1 % of
a flight.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.simulation.state import RockTally
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import norm, scale

FIRST_OBSTACLE = -2
"""Number in place of a facet in the row of a meeting with obstacle 0; later obstacles have lower numbers."""

IMPACT_COLUMNS, PIECE_COLUMNS, SPIN_COLUMNS = 9, 10, 2
"""Columns in rows of impacts and of path segments, and additional columns of each where rocks spin."""


class Record(NamedTuple):
    """Rows to write to: impacts (I, 9) and facets (I,) from row `first_impact`, pieces (S, 10) from `first_piece`.

    A piece is a path segment. Without rows for pieces nothing is written (`writes`). A meeting with an obstacle has a
    row among the impacts, with `FIRST_OBSTACLE` minus the obstacle's number in place of a facet.

    impacts : t, x, y, z, n_x, n_y, n_z, speed in, speed out
    pieces : t, x, y, z, v_x, v_y, v_z at the start, v_x, v_y, v_z at the end; modes (S,) : `values.Mode`
    spins : None, or True where rocks spin: impacts then have two more columns, the spin (rad/s) before and after the
        impact; pieces have the spin at the start and at the end
    """

    impacts: Any
    facets: Any
    pieces: Any
    modes: Any
    first_impact: int
    first_piece: int
    spins: Any = None


class Logbook(NamedTuple):
    """The memory that the flights of R rocks are written into.

    record : rows for impacts and path segments
    first : (R + 1, 2) first row of each rock in either; the row of the first rock to fly is given, the others are
        filled in
    finals : (R, 8), `engines.FINAL_COLUMNS`; counts : (R, 4), `engines.COUNT_COLUMNS`; both are filled in
    """

    record: Record
    first: Any
    finals: Any
    counts: Any


def empty_record(impacts: int, pieces: int, spins: bool = False) -> Record:
    """Return a record with room for a number of impacts and path segments, and for spins if rocks spin."""
    more = SPIN_COLUMNS if spins else 0
    return Record(
        impacts=np.empty((impacts, IMPACT_COLUMNS + more)),
        facets=np.empty(impacts, dtype=np.int64),
        pieces=np.empty((pieces, PIECE_COLUMNS + more)),
        modes=np.empty(pieces, dtype=np.int64),
        first_impact=0,
        first_piece=0,
        spins=True if spins else None,
    )


@kernel
def writes(record: Record) -> bool:
    """True if the record has rows, so that flights are written."""
    return len(record.modes) > 0


@kernel
def record_from(record: Record, first: Any, i: int) -> Record:
    """Return the record for rock i, which writes from row first[i, 0] of the impacts and first[i, 1] of the pieces."""
    return Record(
        impacts=record.impacts,
        facets=record.facets,
        pieces=record.pieces,
        modes=record.modes,
        first_impact=first[i, 0],
        first_piece=first[i, 1],
        spins=record.spins,
    )


@kernel
def close_rock(record: Record, tally: RockTally, first: Any, i: int) -> bool:
    """Set the first rows of the rock after rock i; return False if rock i, at its end, did not find room.

    A path has one row more than segments: its end.
    """
    if not writes(record):
        return True
    first[i + 1, 0] = first[i, 0] + tally.impacts + tally.meetings
    first[i + 1, 1] = first[i, 1] + tally.pieces + 1
    return bool(first[i + 1, 0] <= len(record.facets) and first[i + 1, 1] <= len(record.modes))


@kernel
def against(v: Vec) -> Vec:
    """Return the direction in place of an obstacle's normal: against the velocity v of the rock; upwards if v is 0."""
    speed = norm(v)
    return scale(-1.0 / speed, v) if speed > 0.0 else (0.0, 0.0, 1.0)


@kernel
def note_impact(record: Record, tally: RockTally, before: Motion, after: Motion, facet: int, n: Vec) -> None:
    """Write the rock's next impact, or meeting with an obstacle, into the row that the tally gives."""
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
    """Write the rock's next path segment into the row that the tally gives."""
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
    """Write two spins (rad/s) into a row, from `column` on; nothing if rocks do not spin (None)."""
    if spins is None:
        return
    row[column], row[column + 1] = norm(begin), norm(end)


@kernel
def note_piece_spins(record: Record, tally: RockTally, begin: Vec, end: Vec) -> None:
    """Write the spins (rad/s) at the ends of the rock's next path segment into the row that the tally gives."""
    i = record.first_piece + tally.pieces
    if i < len(record.modes):
        note_spins(record.spins, record.pieces[i], PIECE_COLUMNS, begin, end)
