"""The record of impacts and paths, written during the flight into arrays of a fixed size.

If the arrays are full, the rest of the rock's path is not recorded; the rock flies again later, when there is room.
Nothing is written into a record without rows. One compiled loop covers both cases: two loops, with and without writing,
would double the compilation time and save less than 1 % of the time of a flight.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.simulation.state import RockTally
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import norm, scale

FIRST_OBSTACLE = -2
"""Number in place of a facet's number in the row of a meeting with obstacle 0; obstacle k has FIRST_OBSTACLE - k."""

IMPACT_COLUMNS, PIECE_COLUMNS, SPIN_COLUMNS = 9, 10, 2
"""Number of columns of an impact row, of a path segment row, and of additional columns in both if rocks spin."""

POSE, POSE_COLUMNS = PIECE_COLUMNS + SPIN_COLUMNS, 8
"""First column and number of the columns with orientation, spin and energy of a body, in the row of a path segment."""
BLOW, BLOW_COLUMNS = IMPACT_COLUMNS + SPIN_COLUMNS, 3
"""First column and number of the columns with contacts and energies of a body, in the row of an impact."""


class Record(NamedTuple):
    """The arrays that receive the impacts and path segments (pieces) of rocks, with room for I impacts and S segments.

    If `modes` has no rows, nothing is written (`writes`). A meeting with an obstacle has a row among the impacts, with
    `FIRST_OBSTACLE` minus the obstacle's number in place of a facet number.

    impacts : (I, 9) t (s), x, y, z (m), unit normal n_x, n_y, n_z, speed before and after (m/s)
    facets : (I,) facet of each impact; modes : (S,) number of the `values.Mode` of each path segment
    pieces : (S, 10) t (s), x, y, z (m) and v_x, v_y, v_z (m/s) at the start, v_x, v_y, v_z at the end
    first_impact, first_piece : row of the first impact, and row of the first path segment, of the rock that flies
    spins : True if rocks spin, else None. With spin, impacts have two more columns: the magnitude of the spin (rad/s)
        before and after the impact. Pieces have two more columns: the magnitude at the start and at the end
    bodies : True if rocks have a shape, else None. With a shape, there are more columns after the columns of spin. In
        pieces: at the start of the segment, orientation q_w, q_x, q_y, q_z, spin (rad/s) in the body's axes, and
        rotational energy (J/kg). In impacts: number of contacts, and kinetic energy before and after (J/kg)
    """

    impacts: Any
    facets: Any
    pieces: Any
    modes: Any
    first_impact: int
    first_piece: int
    spins: Any = None
    bodies: Any = None


class Logbook(NamedTuple):
    """The arrays into which the engine writes the flights of R rocks.

    record : rows for impacts and path segments
    first : (R + 1, 2) row of the first impact, and row of the first path segment (piece), of each rock; the last
        element is the end of the last rock's rows. The caller sets the element of the first rock to fly, the engine
        sets all later elements
    finals : (R, 8), `engines.FINAL_COLUMNS`, with further columns for spin and bodies; filled by the engine
    counts : (R, 4), `engines.COUNT_COLUMNS`, with a further column for bodies; filled by the engine
    """

    record: Record
    first: Any
    finals: Any
    counts: Any


def empty_record(impacts: int, pieces: int, spins: bool = False, bodies: bool = False) -> Record:
    """Return an empty record with rows for `impacts` impacts and `pieces` path segments.

    spins : True if rocks spin; bodies : True if rocks have a shape
    """
    more = SPIN_COLUMNS if spins else 0
    blow, pose = (BLOW_COLUMNS, POSE_COLUMNS) if bodies else (0, 0)
    return Record(
        impacts=np.empty((impacts, IMPACT_COLUMNS + more + blow)),
        facets=np.empty(impacts, dtype=np.int64),
        pieces=np.empty((pieces, PIECE_COLUMNS + more + pose)),
        modes=np.empty(pieces, dtype=np.int64),
        first_impact=0,
        first_piece=0,
        spins=True if spins else None,
        bodies=True if bodies else None,
    )


@kernel
def writes(record: Record) -> bool:
    """Return True if the record has rows, so that impacts and path segments are written at all."""
    return len(record.modes) > 0


@kernel
def record_from(record: Record, first: Any, i: int) -> Record:
    """Return the record for rock i, whose rows of impacts and path segments begin where row i of `first` states."""
    return Record(
        impacts=record.impacts,
        facets=record.facets,
        pieces=record.pieces,
        modes=record.modes,
        first_impact=first[i, 0],
        first_piece=first[i, 1],
        spins=record.spins,
        bodies=record.bodies,
    )


@kernel
def close_rock(record: Record, tally: RockTally, first: Any, i: int) -> bool:
    """Write into `first` where the rows of rock i + 1 begin; return False if the path of rock i did not fit.

    A path has one row for each segment, and one more row for its end. If the record has no rows (`writes`), nothing is
    set and the result is True.

    tally : totals of rock i at its end; first : as in `Logbook`
    """
    if not writes(record):
        return True
    first[i + 1, 0] = first[i, 0] + tally.impacts + tally.meetings
    first[i + 1, 1] = first[i, 1] + tally.pieces + 1
    return bool(first[i + 1, 0] <= len(record.facets) and first[i + 1, 1] <= len(record.modes))


@kernel
def against(v: Vec) -> Vec:
    """Return the unit direction (3,) that is recorded as the normal of an obstacle: against the rock's velocity v (3,).

    The direction is upwards if v is zero.
    """
    speed = norm(v)
    return scale(-1.0 / speed, v) if speed > 0.0 else (0.0, 0.0, 1.0)


@kernel
def note_impact(record: Record, tally: RockTally, before: Motion, after: Motion, facet: int, n: Vec) -> None:
    """Write the rock's next impact, or its next meeting with an obstacle, into the record if there is room.

    tally : the rock's running totals, which select the row; before, after : motion just before and just after
    facet : number of the facet, or `FIRST_OBSTACLE` minus the obstacle's number; n : (3,) normal
    """
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
    """Write the rock's next path segment into the record if there is room.

    If rocks spin, the spin at the start is written for both ends; `note_piece_spins` can replace both.

    tally : the rock's running totals, which select the row; start : motion at the start; v_end : velocity at the end
    mode : number of a `Mode`
    """
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
    """Write the magnitudes (rad/s) of two spins (3,) into two columns of a row, from `column` on.

    begin, end : spin before and after an impact, or at both ends of a path segment
    spins : `Record.spins`; nothing is written if it is None, because the rocks do not spin
    """
    if spins is None:
        return
    row[column], row[column + 1] = norm(begin), norm(end)


@kernel
def note_piece_spins(record: Record, tally: RockTally, begin: Vec, end: Vec) -> None:
    """Write the magnitudes (rad/s) of the spins at both ends of the rock's next path segment into the record.

    Nothing is written if rocks do not spin, or if there is no room.

    tally : the rock's running totals, which select the row
    begin, end : (3,) rad/s, spins at both ends
    """
    i = record.first_piece + tally.pieces
    if i < len(record.modes):
        note_spins(record.spins, record.pieces[i], PIECE_COLUMNS, begin, end)
