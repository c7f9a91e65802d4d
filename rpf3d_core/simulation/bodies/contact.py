"""Bodies in contact with the ground: impacts, and short time steps while contact lasts.

A step is a free flight, like all motion of a body, so positions and orientations stay exact. At the start of a step the
body receives an impulse at each contact, such that the contact is at the same place again at the end of the step. In
the step, gravity and spin accelerate the contact by a. So the velocity of the contact must be -a h / 2 at the start of
a step of h seconds, and is a h / 2 at the end. The mean velocity of a contact at rest is then zero, the error of a step
is of third order, and the contact keeps its gap, the distance from the ground. The length of the next step follows from
the error of the gap.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.body.contacts import ARM, CONTACT_COLUMNS, FACET, GOAL, IMPULSE, NORMAL, approach, put, vector
from rpf3d_core.body.contacts import GAP as ROW_GAP
from rpf3d_core.body.impact import forget, impact, sustained
from rpf3d_core.body.inelastic import Velocity, inelastic, kinetic
from rpf3d_core.body.quaternions import turned, turned_back
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion, corner_acceleration, flight_of, motion_after
from rpf3d_core.simulation.bodies.room import (
    ACTIVE,
    BEGUN,
    COVERED,
    EXPECTED,
    GAP,
    GUESS,
    MARK,
    NEAREST,
    TOUCHED,
    UNKNOWN,
    BodyRoom,
)
from rpf3d_core.simulation.bodies.survey import clear_until, travelled
from rpf3d_core.simulation.bodies.touch import BAND, copy_contacts, keep_impulses, list_contacts, mark_covered, touch
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale

OFF = 0.25
"""Largest error of a gap that a step may have, as a share of the skin (-)."""
NEAR, PUSH = 0.75, 0.3
"""Gap, as a share of the skin (-), below which a step enlarges it; share (-) of the missing gap that the step adds."""
LIFT = 0.05
"""Largest speed (m/s) with which a step enlarges a gap that is too small."""
SLOW = 0.1
"""Speed towards the ground (m/s) below which a contact is sustained, and has no restitution in an impact."""
LONGEST, SHORTEST = 0.02, 1e-5
"""Longest and shortest step (s)."""
TURN = 0.15
"""Largest turn of the body in a step (rad)."""
SOLVED, FINISHED = 1e-3, 1e-4
"""Largest errors of a contact's velocity after the solution: error times length of the step, divided by the skin (-).

SOLVED is for usual steps. FINISHED is for the last step before an impact, because its error changes the impact.
"""
GROWTH, SHRINKAGE, SAFETY = 3.0, 0.3, 0.9
"""Largest and smallest ratio of the next step to this step, and share of the estimated length that is used (-)."""


class Carried(NamedTuple):
    """The result of a time step of a body in contact with the ground.

    motion : at the end; contacts : number of contacts at the end, which are in `room.points`
    moved : path bound at the end, as in `Ride` (m)
    begin : motion at the start, after the impulses; h : length of the step (s); next : length of the next step (s)
    pressed : True if any contact received an impulse; False also in the rare step in which the sweeps of the solver
        diverge (`impact.sustained`)
    """

    motion: BodyMotion
    contacts: int
    moved: float
    begin: BodyMotion
    h: float
    next: float
    pressed: bool


@kernel
def body_velocity(motion: BodyMotion) -> Velocity:
    """Return the velocity (m/s) and the spin (rad/s) of a body, both in the body's axes."""
    return Velocity(turned_back(motion.q, motion.v), motion.w)


@kernel
def with_velocity(motion: BodyMotion, velocity: Velocity) -> BodyMotion:
    """Return the motion with another velocity and spin; `velocity` has both in the body's axes."""
    return BodyMotion(t=motion.t, x=motion.x, v=turned(motion.q, velocity.v), q=motion.q, w=velocity.w)


@kernel
def contacts_of(
    body: Body, room: BodyRoom, points: Any, physics: Physics, motion: BodyMotion, rock: RockContext, moved: float
) -> int:  # fmt: skip
    """Write the contacts of a body at its current position into `points`; return their number.

    Facets nearby are examined again where needed, and their states are written into `room.planes`.

    points : (K, CONTACT_COLUMNS); moved : path bound of the body, as in `Ride` (m)
    """
    touch(body, room, physics.facets, motion, moved)
    mark_covered(body, room, physics.facets, motion)
    return list_contacts(body, room, points, physics, motion, rock)


@kernel
def hits(room: BodyRoom, count: int, motion: BodyMotion, h: float, gravity: float) -> int:
    """Return the index of the contact that approaches the ground fastest; -1 if none is fast enough for an impact.

    An impact is faster than SLOW plus the speed that gravity adds in a step.

    count : number of contacts in `room.points`; h : length of the next step (s), as in `Ride`; gravity : m/s^2
    """
    velocity = body_velocity(motion)
    worst, which = -SLOW - gravity * h, -1
    for i in range(count):
        speed = approach(room.points[i], velocity.v, velocity.w)
        if speed < worst:
            worst, which = speed, i
    return which


@routine
def held_up(body: Body, room: BodyRoom, count: int, motion: BodyMotion, h: float, gravity: float) -> BodyMotion:
    """Return the motion of a body just before an impact, after the last impulses of the contacts that carry it.

    count : number of contacts in `room.points`; h : length of the next step (s), as in `Ride`; gravity : m/s^2

    At the end of a step, a contact that carries the body moves towards the ground, with half of the velocity that its
    free acceleration adds in the step. The impulse that stops this contact belongs to the step, not to the impact. If
    the solver diverges, so that kinetic energy would rise, the motion is returned unchanged. `room.later` is
    overwritten.
    """
    velocity, carrying = body_velocity(motion), 0
    for i in range(count):
        row = room.points[i]
        carries = dot(vector(row, IMPULSE), vector(row, NORMAL)) > 0.0
        if carries and approach(row, velocity.v, velocity.w) >= -SLOW - gravity * h:
            for column in range(CONTACT_COLUMNS):
                room.later[carrying, column] = row[column]
            carrying += 1
    if carrying == 0:
        return motion
    forget(room.later, carrying)
    within = FINISHED * body.skin / h
    held = inelastic(room.later, room.rows, carrying, body.moments, velocity, within)
    if not kinetic(held, body.moments) <= kinetic(velocity, body.moments):
        return motion
    return with_velocity(motion, held)


@kernel
def struck(body: Body, room: BodyRoom, count: int, motion: BodyMotion) -> BodyMotion:
    """Return the motion of a body after an impact at all its contacts.

    The impulses and goal velocities in `room.points` are set to zero afterwards.

    count : number of contacts in `room.points`
    """
    after = impact(room.points, room.rows, count, body.moments, body_velocity(motion), SLOW)
    forget(room.points, count)
    return with_velocity(motion, after)


@kernel
def _rate(skin: float, gap: float, h: float) -> float:
    """Return the mean normal velocity (m/s) that a contact should have in a step of h seconds, from its gap (m).

    The velocity is positive away from the ground. A contact farther away than the skin (m) may approach until its gap
    is the skin. A contact that is nearer than NEAR times the skin moves away slowly.
    """
    if gap > skin:
        return (skin - gap) / h
    return min(PUSH * max(NEAR * skin - gap, 0.0) / h, LIFT)


@kernel
def _set_goals(body: Body, room: BodyRoom, count: int, motion: BodyMotion, gravity: float, h: float) -> None:
    """Write into `room.points` the goal velocity of each contact, for a step of h seconds.

    A contact that starts the step with its goal velocity has, on average over the step, the velocity of `_rate` along
    the normal and no velocity along the ground.

    count : number of contacts in `room.points`; gravity : m/s^2
    """
    down = turned_back(motion.q, (0.0, 0.0, -gravity))
    for i in range(count):
        row = room.points[i]
        rate = _rate(body.skin, row[ROW_GAP], h)
        a = corner_acceleration(body, motion, vector(row, ARM), down)
        put(row, GOAL, add(scale(-0.5 * h, a), scale(rate, vector(row, NORMAL))))


@kernel
def _keep_begin(room: BodyRoom) -> None:
    """Copy the columns GAP, GUESS and NEAREST of each TOUCHED facet to the columns from BEGUN on, in `room.planes`.

    The copies keep the values at the start of a step; the step overwrites the original columns. For a facet that is
    AWAY or COVERED, only UNKNOWN is written into BEGUN.
    """
    for k in range(room.count[0]):
        plane = room.planes[k]
        plane[BEGUN] = UNKNOWN
        if plane[ACTIVE] == TOUCHED:
            plane[BEGUN] = plane[GAP]
            put(plane, BEGUN + 1, vector(plane, GUESS))
            put(plane, BEGUN + 4, vector(plane, NEAREST))


class ContactStep(NamedTuple):
    """A step: the free flight of a body for h seconds.

    begin : motion at the start; v : velocity at the start (m/s), down : gravity (m/s2), both in the body's axes
    """

    begin: BodyMotion
    v: Vec
    down: Vec
    h: float


@kernel
def _gap_after(body: Body, step: ContactStep, gap: float, n: Vec, arm: Vec) -> float:
    """Return the gap (m) of a point of the body at the end of a step, to second order in its duration.

    gap : at the start (m); n : normal of the ground; arm : position of the point (m); both (3,) in the body's axes
    """
    speed = dot(n, add(step.v, cross(step.begin.w, arm)))
    return gap + step.h * (speed + 0.5 * step.h * dot(n, corner_acceleration(body, step.begin, arm, step.down)))


@kernel
def _expect(body: Body, room: BodyRoom, count: int, begin: BodyMotion, gravity: float, h: float) -> bool:
    """Write the gap (m) that each facet should have at the end of a step into `room.planes`, column EXPECTED.

    The value is inf for a facet without contact at the start of the step. Return True if any contact received an
    impulse at the start of the step of h seconds.

    count : number of contacts in `room.points`; begin : motion at the start, after the impulses; gravity : m/s^2
    """
    step = ContactStep(
        begin=begin, v=turned_back(begin.q, begin.v), down=turned_back(begin.q, (0.0, 0.0, -gravity)), h=h
    )
    for k in range(room.count[0]):
        plane = room.planes[k]
        plane[EXPECTED] = math.inf
        if plane[BEGUN] != UNKNOWN:
            n, arm = vector(plane, BEGUN + 1), vector(plane, BEGUN + 4)
            plane[EXPECTED] = _gap_after(body, step, plane[BEGUN], n, arm)
    pressed = False
    for i in range(count):
        row = room.points[i]
        n = vector(row, NORMAL)
        pressed = pressed or dot(vector(row, IMPULSE), n) > 0.0
        plane = room.planes[_place_of(room, int(row[FACET]))]
        plane[EXPECTED] = min(plane[EXPECTED], _gap_after(body, step, row[ROW_GAP], n, vector(row, ARM)))
    return pressed


@kernel
def _place_of(room: BodyRoom, f: int) -> int:
    """Return the index of facet number f in the ascending list `room.facets`."""
    low, high = 0, room.count[0] - 1
    while low < high:
        middle = (low + high) // 2
        if room.facets[middle] < f:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def _error(body: Body, room: BodyRoom, moved: float) -> float:
    """Return the largest error of a gap at the end of a step, divided by the largest allowed error (-).

    moved : path bound of the body at the end of the step, as in `Ride` (m)
    """
    worst, band = 0.0, BAND * body.skin
    for k in range(room.count[0]):
        plane = room.planes[k]
        if plane[ACTIVE] == COVERED or plane[EXPECTED] == math.inf:
            continue
        if plane[MARK] == moved and min(plane[GAP], plane[EXPECTED]) <= band:
            worst = max(worst, abs(plane[GAP] - plane[EXPECTED]))
    return worst / (OFF * body.skin)


@kernel
def _next_length(h: float, error: float) -> float:
    """Return the length (s) of the next step, from the length h (s) and the error (-) of this step.

    error : largest error of a gap, divided by the largest allowed error, from `_error`

    The length is divided by the fourth root of the error, within limits. The error of a step is of third order, so the
    fourth root is on the safe side.
    """
    if error <= 0.0:
        return GROWTH * h
    return h * min(max(SAFETY / math.sqrt(math.sqrt(error)), SHRINKAGE), GROWTH)


@kernel
def _shortened(body: Body, motion: BodyMotion, h: float) -> float:
    """Return the length h (s) of a step, changed to lie within the limits of steps: SHORTEST, LONGEST and TURN."""
    spin = norm(motion.w)
    most = min(LONGEST, TURN / spin) if spin > 0.0 else LONGEST
    return max(min(h, most), SHORTEST)


@kernel
def carry(
    body: Body, room: BodyRoom, count: int, physics: Physics, motion: BodyMotion, h: float,
    at: tuple[float, RockContext],
) -> Carried:  # fmt: skip
    """Move a body in contact with the ground through one time step; return the result.

    count : number of contacts in `room.points`; h : length of the step that is tried first (s)
    at : path bound of the body at the start, as in `Ride` (m), and the rock's data

    The step ends early where a gap falls below its limit (`clear_until`). If the gaps at the end differ too much from
    the expected gaps, the step is repeated with a shorter length, down to SHORTEST. Afterwards, `room.points` has the
    contacts at the end of the step, with their impulses as the first guess for the next step.
    """
    moved, rock = at
    gravity, before = physics.settings.gravity, body_velocity(motion)
    h = _shortened(body, motion, h)
    _keep_begin(room)
    while True:
        _set_goals(body, room, count, motion, gravity, h)
        within = SOLVED * body.skin / h
        begin = with_velocity(motion, sustained(room.points, room.rows, count, body.moments, before, within))
        flight = flight_of(body, begin, gravity)
        t = max(clear_until(body, room, physics.facets, flight, h, moved), SHORTEST)
        end, path = motion_after(flight, t), moved + travelled(body, flight, t)
        pressed = _expect(body, room, count, begin, gravity, t)
        touch(body, room, physics.facets, end, path)
        mark_covered(body, room, physics.facets, end)
        error = _error(body, room, path)
        if error <= 1.0 or h <= SHORTEST:
            break
        touch(body, room, physics.facets, motion, moved)
        h = max(min(_next_length(h, error), 0.7 * h), SHORTEST)
    now = list_contacts(body, room, room.later, physics, end, rock)
    keep_impulses(body, room.points, count, room.later, now)
    copy_contacts(room.later, now, room.points)
    after = _shortened(body, end, max(_next_length(t, error), SHORTEST) if t < h else _next_length(h, error))
    return Carried(motion=end, contacts=now, moved=path, begin=begin, h=t, next=after, pressed=pressed)


@kernel
def is_lifting(room: BodyRoom, count: int, motion: BodyMotion) -> bool:
    """Return True if every contact of a body moves away from the ground, or if there is no contact.

    count : number of contacts in `room.points`
    """
    velocity = body_velocity(motion)
    for i in range(count):  # noqa: SIM110  (all() of a generator does not compile)
        if not approach(room.points[i], velocity.v, velocity.w) > 0.0:
            return False
    return True
