"""Repeat recorded calls of the kernels for rocks with a shape (`block_calls.py`) in loops of compiled Python.

The loops have the same names and arrays as the functions in `cpp/blocks.cpp`. C is the number of calls.
"""

from typing import Any

from rpf3d_core.body.clearance import BodySweep, clear_time
from rpf3d_core.body.contacts import put, vector
from rpf3d_core.body.distance import separation
from rpf3d_core.body.inelastic import Velocity, inelastic
from rpf3d_core.body.quaternions import Quaternion
from rpf3d_core.body.rotation import turned_for, turning_of
from rpf3d_core.jit.dispatch import kernel, loop


@kernel
def quaternion(row: Any, column: int) -> Quaternion:
    """Return the four numbers of a row from `column` on as a quaternion w, x, y, z."""
    return row[column], row[column + 1], row[column + 2], row[column + 3]


@loop
def solve_impacts(first: Any, moments: Any, within: Any, rows: Any, points: Any, motion: Any) -> None:
    """Call `inelastic` for each row of `motion`, and write the resulting motion into the same row.

    motion : (C, 6) velocity (m/s) and spin (rad/s); first : (C + 1,) first row of each call in `points`
    points : (P, CONTACT_COLUMNS) contacts, which receive the impulses
    moments : (C, 3) m2; within : (C,) m/s; rows : (K, SOLVER_COLUMNS), working memory
    """
    for i in range(len(motion)):
        count, before = first[i + 1] - first[i], Velocity(vector(motion[i], 0), vector(motion[i], 3))
        after = inelastic(points[first[i] : first[i + 1]], rows, count, vector(moments[i], 0), before, within[i])
        put(motion[i], 0, after.v)
        put(motion[i], 3, after.w)


@loop
def find_distances(corners: Any, ends: Any, size: Any, facets: Any, guesses: Any, out: Any) -> None:
    """Call `separation`; write distance, normal, point of the facet, point of the body and overlap into `out` (C, 11).

    corners : (N, 3) corners of all bodies; the body of call i has the rows `ends[i, 0]` to `ends[i, 1]` - 1
    size : (C,) m, factor of the corners; facets : (C, 3, 3) m; guesses : (C, 3) argument `guess` of `separation`
    """
    for i in range(len(out)):
        facet = vector(facets[i, 0], 0), vector(facets[i, 1], 0), vector(facets[i, 2], 0)
        found = separation(corners, ends[i, 0], ends[i, 1], size[i], facet, vector(guesses[i], 0))
        row = out[i]
        row[0], row[10] = found.distance, 1.0 if found.overlap else 0.0
        put(row, 1, found.normal)
        put(row, 4, found.on_facet)
        put(row, 7, found.on_body)


@loop
def find_clear_times(arms: Any, corners: Any, body: Any, sweeps: Any, planes: Any, most: Any, out: Any) -> None:
    """Call `clear_time` and write the times (s) into `out` (C,).

    arms : (B, 4, N) m, as written by `clearance.set_arms`; corners : (B, 2) number of corners of each body, and N
    body : (C,) number of each call's body; sweeps : (C, 15), a `BodySweep`; planes : (C, 4) normal and distance (m)
    most : (C,) s, argument `most` of `clear_time`
    """
    for i in range(len(out)):
        row, plane = sweeps[i], (vector(planes[i], 0), planes[i, 3])
        sweep = BodySweep(vector(row, 0), vector(row, 3), vector(row, 6), quaternion(row, 9), row[13], row[14])
        out[i] = clear_time(arms[body[i]], corners[body[i], 0], sweep, plane, most[i])


@loop
def find_rotations(moments: Any, q: Any, w: Any, first: Any, times: Any, out: Any) -> None:
    """Call `turning_of` for F rotations, and `turned_for` at their times; write orientation and spin into `out` (T, 7).

    moments : (F, 3) m2; q : (F, 4) and w : (F, 3) rad/s at time 0
    first : (F + 1,) first row of each rotation in `times`, (T,) s
    """
    for i in range(len(moments)):
        turning = turning_of(vector(moments[i], 0), quaternion(q[i], 0), vector(w[i], 0))
        for k in range(first[i], first[i + 1]):
            turn, spin = turned_for(turning, times[k])
            row = out[k]
            row[0], row[1], row[2], row[3] = turn
            put(row, 4, spin)
