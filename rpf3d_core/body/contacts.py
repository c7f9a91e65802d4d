"""The contacts of a body as rows of an array, which the solver of impacts reads and fills.

All vectors are in the body's axes, where the inertia is diagonal. Impulses are per unit of mass (m/s), and moments of
inertia too (m2), so no result depends on the mass.
"""

import math
from typing import Any

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, dot, norm, scale

ARM, NORMAL, MU, ROLLING, RESTITUTION, GOAL, IMPULSE, GAP, FACET = 0, 3, 6, 7, 8, 9, 12, 15, 16
"""First column of each quantity in the row of a contact.

ARM : from the centre of mass to the contact (m); NORMAL : unit, from the ground towards the body
MU : friction (-); ROLLING : rolling resistance times the body's radius (m); RESTITUTION : (-)
GOAL : velocity (m/s) of the ground that the contact is solved for; 0 in an impact
IMPULSE : of the last solution (m/s); GAP : m; FACET : number of the facet
"""
CONTACT_COLUMNS = 17

N, T, S = 0, 3, 6
"""First column of the normal and of both tangents in the solver's row of a contact."""
LEVER, TURN = 9, 18
"""First columns of arm x direction (m) for the three directions, and of the spin that a unit impulse causes."""
MATRIX, SCHUR, LOCAL, AIM = 27, 33, 39, 42
"""First columns of the contact's matrix, its reduction to the tangents, its impulse and its goal in local axes."""
LAST, CHANGE = 45, 48
"""First columns of the impulse after the sweep before, and of its change in this sweep, both in local axes."""
SOLVER_COLUMNS = 51


@kernel
def vector(row: Any, column: int) -> Vec:
    """Return the vector that begins in a column of a row."""
    return row[column], row[column + 1], row[column + 2]


@kernel
def put(row: Any, column: int, a: Vec) -> None:
    """Write a vector into a row, beginning in a column."""
    row[column], row[column + 1], row[column + 2] = a


@kernel
def contact_velocity(row: Any, v: Vec, w: Vec) -> Vec:
    """Return the velocity (m/s) of the body at a contact.

    v : of the centre of mass (m/s); w : spin (rad/s); both in the body's axes
    """
    r = vector(row, ARM)
    turning = cross(w, r)
    return v[0] + turning[0], v[1] + turning[1], v[2] + turning[2]


@kernel
def approach(row: Any, v: Vec, w: Vec) -> float:
    """Return the normal velocity (m/s) of the body at a contact, below 0 if the body approaches the ground."""
    return dot(vector(row, NORMAL), contact_velocity(row, v, w))


@kernel
def fastest(points: Any, count: int, v: Vec, w: Vec) -> tuple[float, int]:
    """Return the least normal velocity (m/s) among the contacts, and the number of this contact; (0.0, -1) if none.

    Only contacts that approach the ground count.
    """
    worst, which = 0.0, -1
    for i in range(count):
        speed = approach(points[i], v, w)
        if speed < worst:
            worst, which = speed, i
    return worst, which


@kernel
def tangents(n: Vec) -> tuple[Vec, Vec]:
    """Return two unit vectors that form a right-handed system with the unit vector n."""
    flat = (0.0, n[2], -n[1]) if abs(n[0]) < 0.6 else (-n[2], 0.0, n[0])
    t = scale(1.0 / norm(flat), flat)
    return t, cross(n, t)


@kernel
def prepare(point: Any, row: Any, inverse: Vec) -> None:
    """Fill the solver's row of a contact.

    inverse : inverse principal moments (1/m2)
    """
    n = vector(point, NORMAL)
    t, s = tangents(n)
    put(row, N, n)
    put(row, T, t)
    put(row, S, s)
    arm = vector(point, ARM)
    for k in range(3):
        lever = cross(arm, vector(row, 3 * k))
        put(row, LEVER + 3 * k, lever)
        put(row, TURN + 3 * k, (inverse[0] * lever[0], inverse[1] * lever[1], inverse[2] * lever[2]))
        row[LOCAL + k] = dot(vector(point, IMPULSE), vector(row, 3 * k))
        row[LAST + k], row[CHANGE + k] = row[LOCAL + k], 0.0
        row[AIM + k] = dot(vector(point, GOAL), vector(row, 3 * k))
    _set_matrix(row)
    _reduce(row)


@kernel
def _set_matrix(row: Any) -> None:
    """Write the contact's matrix: the velocity in its three directions that unit impulses in them cause (per mass)."""
    n, t, s = vector(row, LEVER), vector(row, LEVER + 3), vector(row, LEVER + 6)
    by_n, by_t, by_s = vector(row, TURN), vector(row, TURN + 3), vector(row, TURN + 6)
    row[MATRIX], row[MATRIX + 1], row[MATRIX + 2] = 1.0 + dot(n, by_n), dot(n, by_t), dot(n, by_s)
    row[MATRIX + 3], row[MATRIX + 4], row[MATRIX + 5] = 1.0 + dot(t, by_t), dot(t, by_s), 1.0 + dot(s, by_s)


@kernel
def _reduce(row: Any) -> None:
    """Write the matrix of the tangential impulses at which the normal velocity stays as it is, by its eigenvalues.

    Columns from SCHUR on: the mean of both eigenvalues, half of their difference, cosine and sine of the angle from the
    first tangent to the direction of the larger one, and the coupling of the normal with both directions.
    """
    nn, nt, ns = row[MATRIX], row[MATRIX + 1], row[MATRIX + 2]
    tt, ts = row[MATRIX + 3] - nt * nt / nn, row[MATRIX + 4] - nt * ns / nn
    ss = row[MATRIX + 5] - ns * ns / nn
    mean, off = 0.5 * (tt + ss), 0.5 * (tt - ss)
    half = math.sqrt(off * off + ts * ts)
    cos, sin = 1.0, 0.0
    if half > 0.0:
        cos = math.sqrt(max(0.5 * (1.0 + off / half), 0.0))
        sin = math.sqrt(max(0.5 * (1.0 - off / half), 0.0))
        if ts < 0.0:
            sin = -sin
    row[SCHUR], row[SCHUR + 1], row[SCHUR + 2], row[SCHUR + 3] = mean, half, cos, sin
    row[SCHUR + 4], row[SCHUR + 5] = cos * nt + sin * ns, cos * ns - sin * nt
