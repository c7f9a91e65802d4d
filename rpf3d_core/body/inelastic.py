"""The inelastic impact of a rigid body at several contacts at once, with Coulomb friction and rolling resistance.

The contacts are solved one after another, each exactly, in repeated sweeps over all contacts (Gauss-Seidel).
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.body.contacts import (
    AIM,
    CHANGE,
    IMPULSE,
    LAST,
    LEVER,
    LOCAL,
    MU,
    ROLLING,
    TURN,
    N,
    S,
    T,
    prepare,
    put,
    vector,
)
from rpf3d_core.body.one_point import one_point
from rpf3d_core.body.rolling_limit import rolling_impulse
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, dot, norm, scale, subtract

SWEEPS = 200
"""Largest number of sweeps over all contacts; about ten are usual."""
UNDAMPED, HALVED = 100, 150
"""Number of sweeps that make all changes in full, and of sweeps after which only a fifth of each change is made.

The sweeps in between make half of each change. Full changes may repeat in a cycle: a rolling moment lifts a contact off
the ground, then no normal force remains that would allow the moment, and the contact returns.
"""
SETTLED, ALIGNED = 0.5, 0.9
"""Least ratio of the changes in two successive sweeps, and least cosine between them (-), for a leap (`_leapt`)."""


class Velocity(NamedTuple):
    """Velocity v of the centre of mass (m/s) and spin w (rad/s) of a body, in the body's axes."""

    v: Vec
    w: Vec


@kernel
def kinetic(velocity: Velocity, moments: Vec) -> float:
    """Return the kinetic energy of a body per unit of mass (J/kg), from its velocity and spin.

    moments : (3,) principal moments of inertia over mass (m2)
    """
    v, w = velocity
    turning = moments[0] * w[0] * w[0] + moments[1] * w[1] * w[1] + moments[2] * w[2] * w[2]
    return 0.5 * (dot(v, v) + turning)


@kernel
def _pushed(row: Any, velocity: Velocity, change: Vec) -> Velocity:
    """Return the velocity and spin of a body after one more impulse at a contact.

    row : the solver's row of the contact, which holds the directions of its local axes
    velocity : of the body before the impulse
    change : (3,) the impulse per unit of mass (m/s): along the normal, the first tangent and the second tangent
    """
    v, w = velocity
    for k in range(3):
        v = add(v, scale(change[k], vector(row, 3 * k)))
        w = add(w, scale(change[k], vector(row, TURN + 3 * k)))
    return Velocity(v, w)


@kernel
def local_velocity(row: Any, velocity: Velocity) -> Vec:
    """Return the velocity (m/s) of a contact relative to its goal velocity: normal, first tangent, second tangent.

    row : the solver's row of the contact; velocity : of the body
    """
    v, w = velocity
    return (
        dot(vector(row, N), v) + dot(vector(row, LEVER), w) - row[AIM],
        dot(vector(row, T), v) + dot(vector(row, LEVER + 3), w) - row[AIM + 1],
        dot(vector(row, S), v) + dot(vector(row, LEVER + 6), w) - row[AIM + 2],
    )


@kernel
def solve_contact(row: Any, velocity: Velocity, mu: float, share: float) -> tuple[Velocity, float]:
    """Return the velocity of a body after the exact solution of one contact, and the change of the contact's velocity.

    The other contacts keep their impulses. The contact's impulse changes by a share (-) of its distance from the
    solution. The new impulse stays in the friction cone, because the cone is convex; it is written into the row.

    The change (m/s) is a sum of three speeds: for each local axis, the change of velocity along this axis by the change
    of the impulse along the same axis. A small sum shows that the sweeps have converged.

    row : the solver's row of the contact; mu : friction (-)
    """
    old = vector(row, LOCAL)
    nn, nt, ns, tt, ts, ss = row[27], row[28], row[29], row[30], row[31], row[32]
    u = local_velocity(row, velocity)
    free = (
        u[0] - nn * old[0] - nt * old[1] - ns * old[2],
        u[1] - nt * old[0] - tt * old[1] - ts * old[2],
        u[2] - ns * old[0] - ts * old[1] - ss * old[2],
    )
    new = one_point(row, free, mu)
    change = subtract(new, old)
    if share < 1.0:
        change = scale(share, change)
        new = add(old, change)
    if change[0] == 0.0 and change[1] == 0.0 and change[2] == 0.0:
        return velocity, 0.0
    put(row, LOCAL, new)
    size = nn * abs(change[0]) + tt * abs(change[1]) + ss * abs(change[2])
    return _pushed(row, velocity, change), size


@kernel
def _start(points: Any, rows: Any, count: int, moments: Vec, velocity: Velocity) -> Velocity:
    """Prepare the solver's rows of all contacts; return the velocity of the body after the impulses of the first guess.

    Parameters as in `inelastic`.
    """
    inverse = (1.0 / moments[0], 1.0 / moments[1], 1.0 / moments[2])
    for i in range(count):
        prepare(points[i], rows[i], inverse)
        velocity = _pushed(rows[i], velocity, vector(rows[i], LOCAL))
    return velocity


@routine
def inelastic(points: Any, rows: Any, count: int, moments: Vec, velocity: Velocity, within: float) -> Velocity:
    """Return the velocity of a body after an inelastic impact at all its contacts.

    points : (K, CONTACT_COLUMNS), the contacts (`contacts.py`); their impulses are the first guess, and are replaced by
        the solution
    rows : (K, SOLVER_COLUMNS), working memory; count : number of contacts
    moments : (3,) principal moments of inertia over mass (m2); velocity : of the body before the impact
    within : change of a contact's velocity in a sweep (m/s) below which the sweeps end
    """
    velocity, size = _start(points, rows, count, moments, velocity), size_of(moments)
    resists, moment, allowed, leaps = False, ZERO, _rolling_limit(points, rows, count), 0
    for i in range(count):
        resists = resists or points[i, ROLLING] > 0.0
    if resists:
        moment, velocity, _change = _resisted(moment, velocity, moments, allowed, size)
    for sweep in range(SWEEPS):
        share, most, limit = _share(sweep), 0.0, 0.0
        for i in range(count):
            velocity, change = solve_contact(rows[i], velocity, points[i, MU], share)
            most = max(most, change)
            limit += points[i, ROLLING] * rows[i, LOCAL]
        if resists:
            allowed = limit if share == 1.0 else allowed + share * (limit - allowed)
            moment, velocity, change = _resisted(moment, velocity, moments, allowed, size)
            most = max(most, change)
        if most <= within or (count == 1 and not resists):
            break
        if sweep + 1 < UNDAMPED:
            velocity, leaps = _leapt(rows, count, velocity, leaps)
    for i in range(count):
        row, impulse = rows[i], ZERO
        for k in range(3):
            impulse = add(impulse, scale(row[LOCAL + k], vector(row, 3 * k)))
        put(points[i], IMPULSE, impulse)
    return velocity


@kernel
def _leapt(rows: Any, count: int, velocity: Velocity, sweeps: int) -> tuple[Velocity, int]:
    """Return the velocity after an extrapolation of the sweeps (a leap), and the number of sweeps since the last leap.

    A leap is made only if the sweeps converge slowly; otherwise the velocity is returned unchanged.

    sweeps : number of sweeps since the last leap, without the sweep just made

    Impulses may pass from one contact to another in many small steps, for instance between both facets at an edge. If
    the changes of two successive sweeps have the ratio r, further sweeps would change the impulses by r / (1 - r) times
    the last change. The leap makes this change at once, but no normal impulse falls below 0. A full sweep must follow:
    it returns all impulses into their friction cones. So a leap changes only how many sweeps are needed.
    Source: Aitken's extrapolation.

    rows, count, velocity : as in `inelastic`
    """
    now, along, before = 0.0, 0.0, 0.0
    for i in range(count):
        row = rows[i]
        change, old = subtract(vector(row, LOCAL), vector(row, LAST)), vector(row, CHANGE)
        now, along, before = now + dot(change, change), along + dot(change, old), before + dot(old, old)
        put(row, CHANGE, change)
        put(row, LAST, vector(row, LOCAL))
    if sweeps < 2 or not along > SETTLED * before or not along * along > ALIGNED * ALIGNED * now * before:
        return velocity, sweeps + 1
    reach = along / (before - along) if along < before else math.inf
    for i in range(count):
        if rows[i, CHANGE] < 0.0:
            reach = min(reach, -rows[i, LOCAL] / rows[i, CHANGE])
    if not reach < math.inf:
        return velocity, sweeps + 1
    for i in range(count):
        row = rows[i]
        change = scale(reach, vector(row, CHANGE))
        put(row, LOCAL, add(vector(row, LOCAL), change))
        put(row, LAST, vector(row, LOCAL))
        velocity = _pushed(row, velocity, change)
    return velocity, 0


@kernel
def _rolling_limit(points: Any, rows: Any, count: int) -> float:
    """Return the largest angular impulse (m2/s, per unit of mass) of rolling resistance that the contacts allow.

    The limit is the sum over all contacts of normal impulse times rolling resistance times the body's radius.

    points, rows, count : as in `inelastic`
    """
    limit = 0.0
    for i in range(count):
        limit += points[i, ROLLING] * rows[i, LOCAL]
    return limit


@kernel
def _share(sweep: int) -> float:
    """Return the share (-) of each change that sweep number `sweep` makes: 1 at first, less after many sweeps."""
    if sweep < UNDAMPED:
        return 1.0
    return 0.5 if sweep < HALVED else 0.2


@kernel
def _resisted(
    moment: Vec, velocity: Velocity, moments: Vec, limit: float, size: float
) -> tuple[Vec, Velocity, float]:  # fmt: skip
    """Return the rolling moment of an impact for a new limit, the body's velocity with this moment, and their change.

    A rolling moment is the angular impulse (3,) of rolling resistance per unit of mass. The change (m/s) is the change
    of the spin times `size`; a small change shows that the sweeps have converged.

    moment : previous rolling moment (m2/s); limit : largest length of the new moment (m2/s)
    size : length of the order of the body's size (m)
    velocity : of the body, with the previous moment; moments : (3,) principal moments of inertia over mass (m2)
    """
    w = velocity.w
    free = (w[0] - moment[0] / moments[0], w[1] - moment[1] / moments[1], w[2] - moment[2] / moments[2])
    new = rolling_impulse(free, moments, limit)
    after = (free[0] + new[0] / moments[0], free[1] + new[1] / moments[1], free[2] + new[2] / moments[2])
    change = (abs(after[0] - w[0]) + abs(after[1] - w[1]) + abs(after[2] - w[2])) * size
    return new, Velocity(velocity.v, after), change


@kernel
def size_of(moments: Vec) -> float:
    """Return a length (m) of the order of the body's size, from its principal moments (3,) over mass (m2)."""
    return norm((math.sqrt(moments[0]), math.sqrt(moments[1]), math.sqrt(moments[2])))
