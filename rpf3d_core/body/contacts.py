"""The contacts of a body as rows of arrays, which the solver of impacts reads and writes.

All vectors are in the body's axes, where the inertia is diagonal. Impulses (m/s) and moments of inertia (m2) are per
unit of mass, so no result depends on the mass. Each contact has a row in the array of contacts (CONTACT_COLUMNS) and a
row in the solver's array (SOLVER_COLUMNS), whose local axes are the normal and two tangents.
"""

import math
from typing import Any

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, dot, norm, scale

ARM, NORMAL, MU, ROLLING, RESTITUTION, GOAL, IMPULSE, GAP, FACET = 0, 3, 6, 7, 8, 9, 12, 15, 16
"""First column of each quantity in the row of a contact, in the array of contacts.

ARM : from the centre of mass to the contact (m); NORMAL : unit, from the ground towards the body
MU : friction (-); ROLLING : rolling resistance times the body's radius (m); RESTITUTION : (-)
GOAL : goal velocity (m/s); the contact is solved as if the ground moved with this velocity; 0 in an impact
IMPULSE : of the last solution (m/s); GAP : distance from the facet (m); FACET : number of the facet
"""
CONTACT_COLUMNS = 17

N, T, S = 0, 3, 6
"""First column of the normal and of both tangents in the solver's row of a contact."""
LEVER, TURN = 9, 18
"""First columns of two vectors for each local axis: arm x local axis (m), and the spin that a unit impulse causes."""
MATRIX, SCHUR, LOCAL, AIM = 27, 33, 39, 42
"""First columns of the contact's matrix, its reduction to the tangents (`_reduce`), its impulse and its goal velocity.

Impulse and goal velocity are in local axes.
"""
LAST, CHANGE = 45, 48
"""First columns of the impulse after the previous sweep, and of its change in the last sweep, both in local axes."""
SOLVER_COLUMNS = 51


@kernel
def vector(row: Any, column: int) -> Vec:
    """Return the three numbers of a row from `column` on as a vector (3,); row : of any array, such as contacts."""
    return row[column], row[column + 1], row[column + 2]


@kernel
def put(row: Any, column: int, a: Vec) -> None:
    """Write a vector (3,) into three columns of a row, from `column` on; row : of any array, such as contacts."""
    row[column], row[column + 1], row[column + 2] = a


@kernel
def contact_velocity(row: Any, v: Vec, w: Vec) -> Vec:
    """Return the velocity (3,) m/s of the body at a contact, in the body's axes.

    row : of the contact, in the array of contacts
    v : velocity of the centre of mass (m/s); w : spin (rad/s); both in the body's axes
    """
    r = vector(row, ARM)
    turning = cross(w, r)
    return v[0] + turning[0], v[1] + turning[1], v[2] + turning[2]


@kernel
def approach(row: Any, v: Vec, w: Vec) -> float:
    """Return the normal velocity (m/s) of the body at a contact: below 0 if the body approaches the ground.

    Parameters as in `contact_velocity`.
    """
    return dot(vector(row, NORMAL), contact_velocity(row, v, w))


@kernel
def fastest(points: Any, count: int, v: Vec, w: Vec) -> tuple[float, int]:
    """Return the most negative normal velocity (m/s) of the contacts, and the number of this contact.

    If no contact approaches the ground, the result is (0.0, -1).

    points : the array of contacts; count : number of contacts; v, w : as in `contact_velocity`
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
    """Fill the solver's row of a contact, from the contact's row in the array of contacts.

    point : the contact's row in the array of contacts; row : the solver's row, which is overwritten
    inverse : (3,) inverse principal moments (1/m2)
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
    """Write the matrix of a contact: the velocities of the contact point that unit impulses at this point cause.

    Velocities and impulses (per unit of mass) are along the local axes of the contact: the normal n, the tangents t and
    s. The matrix is symmetric, so six numbers are written, in the order nn, nt, ns, tt, ts, ss.

    row : the solver's row of the contact
    """
    n, t, s = vector(row, LEVER), vector(row, LEVER + 3), vector(row, LEVER + 6)
    by_n, by_t, by_s = vector(row, TURN), vector(row, TURN + 3), vector(row, TURN + 6)
    row[MATRIX], row[MATRIX + 1], row[MATRIX + 2] = 1.0 + dot(n, by_n), dot(n, by_t), dot(n, by_s)
    row[MATRIX + 3], row[MATRIX + 4], row[MATRIX + 5] = 1.0 + dot(t, by_t), dot(t, by_s), 1.0 + dot(s, by_s)


@kernel
def _reduce(row: Any) -> None:
    """Write the eigenvalues and eigenvectors of the contact's matrix, reduced to the two tangents (2 x 2).

    The reduced matrix gives the tangential velocity that a tangential impulse causes, if the normal impulse changes so
    that the normal velocity stays constant (Schur complement).

    Columns from SCHUR on: the mean of both eigenvalues, half of their difference, cosine and sine of the angle from the
    first tangent to the eigenvector of the larger eigenvalue, the coupling of the normal with this eigenvector, and the
    coupling of the normal with the other eigenvector.

    row : the solver's row of the contact
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
