"""The impact of a rigid body at several contacts at once, with Coulomb friction and rolling resistance.

An elastic impact has (1 + e) times the impulses of the inelastic impact (`inelastic.py`), with one coefficient of
restitution e for all contacts. So no impact with 0 <= e <= 1 gains energy, for any number of contacts, any friction and
any rolling resistance (Moreau 1988; the proof is in docs/explanation/bodies.md). If the sweeps of the solver do not
converge, the contacts are solved one by one, the contact that approaches fastest first; no single impact gains energy.
"""

import math
from typing import Any

from rpf3d_core.body.contacts import AIM, GOAL, IMPULSE, LOCAL, MU, RESTITUTION, fastest, prepare, put
from rpf3d_core.body.inelastic import Velocity, inelastic, kinetic, local_velocity, size_of, solve_contact
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, norm, scale, subtract

SINGLE = 400
"""Largest number of impacts at single contacts, if the sweeps do not converge."""
EXACT = 1e-11
"""Ratio (-) of the change of a contact's velocity in a sweep to the body's speed, below which an impact is solved."""
GAIN = 1e-12
"""Relative gain of energy (-) above which the contacts are solved one by one; rounding alone gains less."""
UNSOLVED = 2.0
"""Ratio (-) of a contact's approach speed, relative to its goal velocity, to the velocity change that ends the sweeps.

Above this ratio the contacts are solved one by one.
"""
GAINED = 4.0
"""Ratio (-) of the gain of speed of a body in sustained contact to the largest goal velocity of its contacts.

Above this ratio the sweeps have diverged.
"""
LEFT = 1e-9
"""Ratio (-) of approach speed after an impact to the body's speed before it, up to which the approach is rounding."""


@kernel
def forget(points: Any, count: int) -> None:
    """Set the impulses and goal velocities of all contacts to zero, before an impact is solved.

    points : the array of contacts, of which the first `count` rows are used
    """
    forget_impulses(points, count)
    for i in range(count):
        put(points[i], GOAL, ZERO)


@kernel
def forget_impulses(points: Any, count: int) -> None:
    """Set the impulses of all contacts to zero; their goal velocities stay. points, count : as in `forget`."""
    for i in range(count):
        put(points[i], IMPULSE, ZERO)


@kernel
def _fastest_to_goal(rows: Any, count: int, velocity: Velocity) -> tuple[float, int]:
    """Return the most negative normal velocity (m/s) of the contacts, and the number of this contact.

    The velocity of each contact is relative to its goal velocity. If no relative velocity is below 0, the result is
    (0.0, 0).

    rows : the solver's rows of the contacts, of which the first `count` are used
    """
    worst, which = 0.0, 0
    for i in range(count):
        speed = local_velocity(rows[i], velocity)[0]
        if speed < worst:
            worst, which = speed, i
    return worst, which


@routine
def sustained(points: Any, rows: Any, count: int, moments: Vec, velocity: Velocity, within: float) -> Velocity:
    """Return the velocity of a body in sustained contact, after impulses that stop the approach of all its contacts.

    The approach of a contact is measured relative to its goal velocity. The velocity is the result of `inelastic`; the
    parameters are as in `inelastic`. If the sweeps do not converge, the contacts that still approach are then solved
    one by one. If the sweeps diverge, as they can for a body that friction wedges, their result is not used: the
    contacts are solved one by one from the start. The impulses in `points` are those of the sweeps, or 0 if the sweeps
    diverged; they do not include the impulses of contacts solved one by one.

    The largest allowed speed is the speed of the given `velocity`, plus GAINED times the largest goal velocity of a
    contact. Sweeps whose result is faster count as diverging; a faster result of the single contacts is scaled down.
    Here, speed means the result of `_size`, which includes the spin.
    """
    after = inelastic(points, rows, count, moments, velocity, within)
    fastest_allowed = _size(velocity, moments) + GAINED * _largest_goal(rows, count)
    if not _size(after, moments) <= fastest_allowed:
        forget_impulses(points, count)
        after = velocity
    elif _fastest_to_goal(rows, count, after)[0] >= -UNSOLVED * within:
        return after
    after = one_by_one(points, rows, count, moments, after, within)
    size = _size(after, moments)
    if size <= fastest_allowed:
        return after
    return Velocity(scale(fastest_allowed / size, after.v), scale(fastest_allowed / size, after.w))


@kernel
def _size(velocity: Velocity, moments: Vec) -> float:
    """Return the speed (m/s) at which a body without spin has the given motion's kinetic energy.

    moments : (3,) principal moments of inertia over mass (m2)
    """
    return math.sqrt(2.0 * kinetic(velocity, moments))


@kernel
def _largest_goal(rows: Any, count: int) -> float:
    """Return the largest goal velocity (m/s) of the contacts.

    rows : the solver's rows of the contacts; count : number of contacts
    """
    largest = 0.0
    for i in range(count):
        largest = max(largest, norm((rows[i, AIM], rows[i, AIM + 1], rows[i, AIM + 2])))
    return largest


@routine
def one_by_one(points: Any, rows: Any, count: int, moments: Vec, velocity: Velocity, left: float) -> Velocity:
    """Return the velocity of a body after inelastic impacts at single contacts, until no contact approaches.

    The contact that approaches fastest is solved first. At most SINGLE impacts are solved, so contacts may still
    approach. The rows of the solver are overwritten; the impulses in `points` stay unchanged.

    left : approach speed (m/s), relative to the contacts' goal velocities, that counts as no approach
    points, rows, count, moments, velocity : as in `inelastic`
    """
    inverse = (1.0 / moments[0], 1.0 / moments[1], 1.0 / moments[2])
    for i in range(count):
        prepare(points[i], rows[i], inverse)
    for _ in range(SINGLE):
        worst, i = _fastest_to_goal(rows, count, velocity)
        if worst >= -left:
            break
        put(rows[i], LOCAL, ZERO)
        velocity, _change = solve_contact(rows[i], velocity, points[i, MU], 1.0)
    return velocity


@routine
def impact(points: Any, rows: Any, count: int, moments: Vec, velocity: Velocity, slow: float) -> Velocity:
    """Return the velocity of a body after an impact at all its contacts at once; the body never gains energy.

    All contacts have the restitution of the contact that approaches fastest. If contacts still approach after this
    impact, inelastic impacts follow. If no contact approaches at first, the velocity is returned unchanged.

    velocity : of the body before the impact
    points, rows, count, moments : as in `inelastic`; the goal velocities in `points` are set to 0. Do not use the
        impulses in `points` afterwards: they are not those of the whole impact, but of the last call of `inelastic`
    slow : approach speed (m/s) below which an impact is inelastic, so that a body can stop
    """
    speed = norm(velocity.v) + norm(velocity.w) * size_of(moments)
    worst, which = fastest(points, count, velocity.v, velocity.w)
    if which < 0:
        return velocity
    e = points[which, RESTITUTION] if worst < -slow else 0.0
    forget(points, count)
    stopped = inelastic(points, rows, count, moments, velocity, EXACT * speed)
    after = Velocity(
        add(velocity.v, scale(1.0 + e, subtract(stopped.v, velocity.v))),
        add(velocity.w, scale(1.0 + e, subtract(stopped.w, velocity.w))),
    )
    before, allowed = kinetic(velocity, moments), 1.0 + GAIN
    if e > 0.0 and fastest(points, count, after.v, after.w)[0] < -LEFT * speed:
        forget(points, count)
        after = inelastic(points, rows, count, moments, after, EXACT * speed)
    if kinetic(after, moments) > allowed * before:
        after = velocity
    return one_by_one(points, rows, count, moments, after, LEFT * speed)
