"""The simulation loop of bodies: flights, impacts and steps in contact, until the body has an outcome."""

import math
from typing import Any

from rpf3d_core.arc import Arc, arc_length
from rpf3d_core.body.contacts import FACET, NORMAL, vector
from rpf3d_core.body.quaternions import turned
from rpf3d_core.detection.caps import Loss, loss_on
from rpf3d_core.detection.contact import NO_CONTACT
from rpf3d_core.effects.hooks import Meeting, first_obstacle, longest_flight, still_at
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.kinetics.slippage import slip_at_release, slip_in_air, slip_on_ground
from rpf3d_core.materials.library import surface_of
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.bodies.around import braked, entering_ground, height_of
from rpf3d_core.simulation.bodies.contact import Carried, carry, contacts_of, held_up, hits, is_lifting, struck
from rpf3d_core.simulation.bodies.flying import fly_on
from rpf3d_core.simulation.bodies.motion import Body, flight_of, kinetic_energy, motion_after
from rpf3d_core.simulation.bodies.notes import motion_of, note_blow, note_segment
from rpf3d_core.simulation.bodies.release import Release
from rpf3d_core.simulation.bodies.rest import NOT_STOPPED, after_step, mean_speed, no_rest, why_stopped
from rpf3d_core.simulation.bodies.ride import (
    FIRST_STEP,
    NO_ROOM,
    Ride,
    after_flight,
    ended,
    in_contact,
    leaning,
    listed_around,
    margin_of,
    past_obstacle,
)
from rpf3d_core.simulation.bodies.room import BodyRoom
from rpf3d_core.simulation.bodies.slip import set_slip_friction
from rpf3d_core.simulation.bodies.survey import travelled
from rpf3d_core.simulation.bodies.touch import touch
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.simulation.record import Record
from rpf3d_core.simulation.state import NONE_PASSED, released, with_ground, with_impact, with_slide
from rpf3d_core.values import MOVING, Mode, Outcome
from rpf3d_core.vectors import norm, subtract

MOVED_ON = 0.5
"""Share (-) of `ride.margin_of`: if a body has moved farther than this share, the facets around it are listed again."""

SLIDING, END = int(Mode.SLIDING), int(Mode.END)
STOPPED, MAX_TIME = int(Outcome.STOPPED), int(Outcome.MAX_TIME)
MAX_IMPACTS, FAILED = int(Outcome.MAX_IMPACTS), int(Outcome.FAILED)


@kernel
def meet(body: Body, room: BodyRoom, physics: Physics, ride: Ride, rock: RockContext, record: Record) -> Ride:
    """Return the state of a flying body that touches the ground: in contact, or in flight again after an impact.

    There is an impact if the body approaches the ground fast enough (`hits`); the impact is recorded.
    """
    count = contacts_of(body, room, room.points, physics, ride.motion, rock, ride.moved)
    at_ground = in_contact(ride, ride.motion, count, ride.tally, ride.passed)
    return _after_impact(body, room, at_ground, physics, rock, record)


@kernel
def _after_impact(body: Body, room: BodyRoom, ride: Ride, physics: Physics, rock: RockContext, record: Record) -> Ride:
    """Return the state of a body after an impact at its contacts; unchanged if no contact is fast enough for an impact.

    The impact is recorded. A body that leaves the ground at all its contacts flies.
    """
    which = hits(room, ride.contacts, ride.motion, ride.h, physics.settings.gravity)
    if which < 0:
        return ride
    row = room.points[which]
    contact = (int(row[FACET]), ride.contacts, turned(ride.motion.q, vector(row, NORMAL)))
    set_slip_friction(physics.rebound.slip, physics.facets, room.points, ride.contacts, ride.slip)
    before = held_up(body, room, ride.contacts, ride.motion, ride.h, physics.settings.gravity)
    entering = entering_ground(physics, before, contact[0], contact[2], rock)
    after = struck(body, room, ride.contacts, entering)
    note_blow(record, ride.tally, body, before, after, contact)
    tally = with_impact(ride.tally, contact[0], motion_of(after), False)
    passed = still_at(physics.effects, motion_of(after), ride.passed, rock)
    count = 0 if is_lifting(room, ride.contacts, after) else ride.contacts
    return in_contact(ride, after, count, tally, passed)


@kernel
def press_on(body: Body, room: BodyRoom, locator: Any, physics: Physics, ride: Ride, rock: RockContext) -> Ride:
    """List the facets around a body in contact again if the body has moved far; return the state of the body.

    The facets are listed again if the body has moved more than MOVED_ON times `margin_of` since the last list.
    Otherwise the state is unchanged. The outcome of the state is NO_ROOM if the facets do not fit into `room`.
    """
    if norm(subtract(ride.motion.x, ride.centre)) <= MOVED_ON * margin_of(body):
        return ride
    listed = listed_around(body, room, locator, physics, ride)
    if listed.outcome != NO_ROOM:
        touch(body, room, physics.facets, ride.motion, ride.moved)
    return listed


@kernel
def step_on(
    body: Body, room: BodyRoom, locator: Any, physics: Physics, ride: Ride, rock: RockContext, record: Record
) -> Ride:
    """Return the state of a body in contact after its next time step, or at the obstacle or cap that ends the step.

    The body has stopped if it has been at rest for long enough (`why_stopped`). A body whose contacts receive no
    impulse and all move away from the ground flies.

    record : receives the step as a path segment, and a meeting with an obstacle
    """
    motion, effects = ride.motion, physics.effects
    speed = math.sqrt(2.0 * kinetic_energy(body, motion)) + 1.0
    h = min(ride.h, (1.0 - MOVED_ON) * margin_of(body) / speed, longest_flight(effects, motion_of(motion), rock))
    facet = int(room.points[0, FACET])
    set_slip_friction(physics.rebound.slip, physics.facets, room.points, ride.contacts, ride.slip)
    done = carry(body, room, ride.contacts, physics, motion, h, (ride.moved, rock))
    arc = Arc(x=done.begin.x, v=done.begin.v, gravity=physics.settings.gravity)
    meeting = first_obstacle(effects, arc, ride.passed, done.h, rock)
    loss = loss_on(physics.caps, arc, NO_CONTACT, done.h)
    if min(meeting.t, loss.t) < math.inf:
        return _cut_short(body, physics, ride, done, (meeting, loss), rock, record)
    note_segment(record, ride.tally, body, done.begin, done.motion, SLIDING)
    tally = ride.tally
    if done.pressed:
        tally = with_ground(tally, facet, norm(done.begin.v))
    end = braked(effects, done.motion, height_of(physics, locator, done.motion), done.h, rock)
    tally = with_slide(tally, arc_length(arc, done.h), motion_of(end), physics.facets.tolerance, False)
    stop = surface_of(physics.materials, physics.facets.zone[facet], rock).stop_speed
    rest, why = ride.rest, NOT_STOPPED
    if done.pressed:
        speed = mean_speed(body, done.begin, end)
        rest = after_step(body, ride.rest, end, speed, stop)
        why = why_stopped(rest, end.t)
    lifts = not done.pressed and is_lifting(room, done.contacts, end)
    outcome = STOPPED if why != NOT_STOPPED else MOVING
    if outcome == MOVING and end.t >= physics.settings.max_time:
        outcome = MAX_TIME
    return Ride(
        motion=end, centre=ride.centre, moved=done.moved, contacts=0 if lifts else done.contacts, h=done.next,
        rest=rest, tally=tally, outcome=outcome, why=why,
        passed=still_at(effects, motion_of(end), ride.passed, rock), slip=_slip_after(physics, ride, done, facet),
    )  # fmt: skip


@kernel
def _slip_after(physics: Physics, ride: Ride, done: Carried, facet: int) -> Any:
    """Return the slip (m) of a body after a step in contact; None if no ground has slip friction.

    Slip grows if any contact received an impulse in the step; otherwise slip decays as in the air.

    done : result of the step; facet : number of the facet of the first contact
    """
    model, zone = physics.rebound.slip, physics.facets.zone[facet]
    if not done.pressed:
        return slip_in_air(model, ride.slip, zone, done.h)
    return slip_on_ground(model, ride.slip, zone, norm(subtract(done.motion.x, ride.motion.x)))


@kernel
def _cut_short(
    body: Body, physics: Physics, ride: Ride, done: Carried, ends: tuple[Meeting, Loss], rock: RockContext,
    record: Record,
) -> Ride:  # fmt: skip
    """Return the state of a body that meets an obstacle or a cap during a step in contact.

    The path ends at a cap. A body that loses all speed at an obstacle stops, leaning against the obstacle. Any other
    body flies on, or ends as the obstacle decides. The step up to the event, and a meeting with an obstacle, are
    recorded.

    done : result of the whole step; ends : first obstacle, and first passage through a cap, with times in the step
    """
    meeting, loss = ends
    flight = flight_of(body, done.begin, physics.settings.gravity)
    t = min(meeting.t, loss.t)
    at = motion_after(flight, t)
    note_segment(record, ride.tally, body, done.begin, at, SLIDING)
    arc = Arc(x=done.begin.x, v=done.begin.v, gravity=physics.settings.gravity)
    tally = with_slide(ride.tally, arc_length(arc, t), motion_of(at), physics.facets.tolerance, False)
    cut = after_flight(ride, at, ride.moved + travelled(body, flight, t), tally, MOVING, ride.passed)
    if loss.t < meeting.t:
        return ended(cut, loss.outcome)
    met = past_obstacle(body, physics, cut, meeting, rock, record)
    return leaning(met) if met.outcome == MOVING and met.passed == NONE_PASSED else met


@kernel
def _checked(before: Ride, after: Ride) -> Ride:
    """Return `after`, the state after an event, if its numbers are finite; else `before`, with the outcome FAILED."""
    motion = after.motion
    total = motion.t + after.tally.path + after.tally.speed2
    for k in range(3):
        total += motion.x[k] + motion.v[k] + motion.w[k] + motion.q[k]
    return after if math.isfinite(total + motion.q[3]) else ended(before, FAILED)


@kernel
def next_event(
    body: Body, room: BodyRoom, locator: Any, physics: Physics, ride: Ride, rock: RockContext, record: Record
) -> Ride:
    """Return the state of a body after its next event: the end of a free flight, an impact or a step in contact.

    A body that already has max_impacts contacts does not move further, and ends with the outcome MAX_IMPACTS. The
    outcome is NO_ROOM if the facets nearby do not fit into `room`.

    record : receives the path segment, and an impact or a meeting with an obstacle
    """
    if ride.tally.contacts >= physics.settings.max_impacts:
        return ended(ride, MAX_IMPACTS)
    if ride.contacts == 0:
        far = norm(subtract(ride.motion.x, ride.centre)) > MOVED_ON * margin_of(body)
        if far:
            ride = listed_around(body, room, locator, physics, ride)
        if ride.outcome != MOVING:
            return ride
        flown, meets = fly_on(body, room, locator, physics, ride, rock, record)
        return meet(body, room, physics, flown, rock, record) if meets else flown
    ride = press_on(body, room, locator, physics, ride, rock)
    if ride.outcome != MOVING:
        return ride
    ride = _after_impact(body, room, ride, physics, rock, record)
    if ride.contacts == 0:
        return ride
    return step_on(body, room, locator, physics, ride, rock, record)


@routine
def follow_body(
    body: Body, room: BodyRoom, locator: Any, physics: Physics, release: Release, rock: RockContext, record: Record
) -> Ride:
    """Simulate one body from its release to its outcome; return its last state.

    room : working memory; locator : contact search; rock : the rock's data; record : receives the path and impacts
    """
    motion = release.motion
    tally = released(motion_of(motion)).tally
    ride = Ride(
        motion=motion, centre=motion.x, moved=0.0, contacts=0, h=FIRST_STEP, rest=no_rest(motion), tally=tally,
        outcome=release.outcome, why=NOT_STOPPED, passed=NONE_PASSED, slip=slip_at_release(physics.rebound.slip),
    )  # fmt: skip
    ride = listed_around(body, room, locator, physics, ride)
    while ride.outcome == MOVING:
        at = RockContext(rock=rock.rock, key=rock.key, impacts=ride.tally.impacts)
        ride = _checked(ride, next_event(body, room, locator, physics, ride, at, record))
    note_segment(record, ride.tally, body, ride.motion, ride.motion, END)
    return ride
