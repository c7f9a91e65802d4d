"""The simulation loop of both engines: it moves a rock from event to event until the rock has an outcome."""

import math
from typing import Any

from rpf3d_core.arc import Arc, advance, arc_length
from rpf3d_core.detection.contact import Contact, PreviousContact
from rpf3d_core.detection.search import is_fall
from rpf3d_core.effects.hooks import Meeting, at_obstacle, breaks, felt_normal, in_ground, still_at
from rpf3d_core.jit.dispatch import guarded, kernel, model_function
from rpf3d_core.kinetics.rebound import rebound
from rpf3d_core.materials.library import Surface, surface_of
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.parabola import next_parabola, out_of_air
from rpf3d_core.simulation.physics import Physics, rock_at
from rpf3d_core.simulation.record import FIRST_OBSTACLE, Record, against, note_impact, note_piece
from rpf3d_core.simulation.settling import settle, stand
from rpf3d_core.simulation.state import (
    RockTally,
    State,
    ended,
    past,
    released,
    with_impact,
    with_meeting,
    with_piece,
)
from rpf3d_core.simulation.sustained import carry_on, held_by
from rpf3d_core.terrain.facet_geometry import NEAR, corner, on_plane, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, Mode, Motion, Outcome, Vec
from rpf3d_core.vectors import dot, scale, subtract

STRETCHES = 10_000
"""Number of flight segments that a rock may always use, in addition to two path segments per contact.

The number holds even if max_impacts is smaller.
"""

FLIGHT, END = int(Mode.FLIGHT), int(Mode.END)
LEFT_TERRAIN, MAX_TIME, MAX_IMPACTS = int(Outcome.LEFT_TERRAIN), int(Outcome.MAX_TIME), int(Outcome.MAX_IMPACTS)
FAILED, FRAGMENTED = int(Outcome.FAILED), int(Outcome.FRAGMENTED)
FELL_THROUGH = int(Outcome.FELL_THROUGH)


@model_function
def locator_for(model: object, locator: Any, rock: RockContext) -> Any:
    """Return the locator that finds the contacts of one rock: for a sphere it knows the rock's radius.

    Rebound models of bodies with a size have their own rule; for all other models the result is `locator` itself.
    """


@locator_for.otherwise
def locator_of_points(model: object, locator: Any, rock: RockContext) -> Any:
    """Return the locator itself: with this rebound model, the rock is a point."""
    return locator


@model_function
def set_down(model: object, locator: Any, facets: Facets, motion: Motion) -> Motion:
    """Return the motion with which a rock is released; a rebound model may change the motion that the source gives.

    A sphere, for example, must not overlap the ground.
    """


@set_down.otherwise
def as_told(model: object, locator: Any, facets: Facets, motion: Motion) -> Motion:
    """Return the motion of a rock at its release as the source gives it, unchanged."""
    return motion


@kernel
def follow(physics: Physics, locator: Any, motion: Motion, rock: RockContext, record: Record) -> State:
    """Simulate one rock from its release to its outcome; return its last state.

    locator : contact search of either engine; rock : the rock's data that models may need
    record : holds the rows for impacts and path segments
    """
    state = checked(released(motion), released(motion))
    while state.outcome == MOVING:
        state = checked(state, next_event(physics, locator, state, rock, record))
    note_piece(record, state.tally, state.motion, state.motion.v, END)
    return state


def no_event(physics: Physics, locator: Any, state: State, rock: RockContext, record: Record) -> State:
    """Return the rock's state with the outcome FAILED, if the arithmetic of `next_event` raises an error in Python."""
    return ended(state, FAILED)


@guarded(no_event)
def next_event(physics: Physics, locator: Any, state: State, rock: RockContext, record: Record) -> State:
    """Return the state of a moving rock after its next event: the end of a flight or of a segment on the ground."""
    if state.tally.contacts >= physics.settings.max_impacts:
        return ended(state, MAX_IMPACTS)
    if state.stands:
        return carry_on(physics.ground, physics, locator, state, rock, record)  # type: ignore[no-any-return]
    return fly_on(physics, locator, state, rock, record)


@kernel
def checked(before: State, after: State) -> State:
    """Return the state after an event; if a number in it is not finite, return the state before, with outcome FAILED.

    The record rows of the failed event are overwritten by the end of the path and by the following rocks.
    """
    t, x, v, w = after.motion
    moving = t + x[0] + x[1] + x[2] + v[0] + v[1] + v[2] + w[0] + w[1] + w[2]
    if math.isfinite(moving + after.tally.path + after.tally.speed2):
        return after
    return ended(before, FAILED)


@kernel
def fly_on(physics: Physics, locator: Any, state: State, rock: RockContext, record: Record) -> State:
    """Return the state after a flight: to the next contact, obstacle, gap or boundary of the terrain, or max_time."""
    rock_now, gravity = rock_at(rock, state), physics.settings.gravity
    flown = next_parabola(physics, locator, state, rock_now)
    start, t = flown.start, flown.t
    arrived = advance(start, gravity, t)
    note_piece(record, state.tally, start, arrived.v, FLIGHT)
    motion = out_of_air(physics, locator, arrived, t, flown.longest, rock_now)
    tally = with_piece(
        state.tally, arc_length(Arc(x=start.x, v=start.v, gravity=gravity), t), motion, physics.facets.tolerance
    )
    after = State(motion=motion, left=state.left, stands=False, tally=tally, outcome=MOVING, passed=state.passed)
    if t == flown.meeting.t and t < flown.left:
        return _meet(physics.effects, after, flown.meeting, rock, record)
    if t == flown.loss.t and t < flown.left:
        return ended(after, flown.loss.outcome)
    lands = flown.contact.t <= t and t < flown.left
    if t == flown.longest and t < flown.left and not lands:
        on = State(
            motion=motion, left=_mid_air(state.left), stands=False, tally=tally, outcome=MOVING, passed=state.passed
        )
        return ended(on, MAX_IMPACTS) if _hovers(physics.settings.max_impacts, tally) else on
    if is_fall(flown.contact) and t < flown.left:
        return ended(state, FELL_THROUGH)
    if lands:
        return land(flown.contact, physics, after, rock, record)  # type: ignore[no-any-return]
    return ended(after, MAX_TIME if t == flown.left else LEFT_TERRAIN)


@kernel
def _hovers(max_impacts: int, tally: RockTally) -> bool:
    """Return True if a rock hangs in the air for too many flight segments, so that its flight must end.

    A light rock in a strong drag layer sinks by centimetres per second, in segments of a millisecond. Computing such a
    flight to the ground would take very long.
    """
    return tally.pieces - 2 * tally.contacts >= max(max_impacts, STRETCHES)


@kernel
def _mid_air(left: PreviousContact) -> PreviousContact:
    """Return the `PreviousContact` of a rock in mid-air, which starts its next arc away from any facet.

    The rock stays on the same side of the ground.
    """
    return PreviousContact(facet=-1, other=-1, side=left.side, resting=False, before=-1)


@kernel
def _meet(effects: Any, state: State, meeting: Meeting, rock: RockContext, record: Record) -> State:
    """Return the state after a rock meets an obstacle (barrier or tree), which changes or ends the rock's motion."""
    before = state.motion
    met = at_obstacle(effects, before, meeting.number, state.tally.meetings, rock_at(rock, state))
    note_impact(record, state.tally, before, met.motion, FIRST_OBSTACLE - meeting.number, against(before.v))
    tally = with_meeting(state.tally, met.facet)
    return State(
        motion=met.motion,
        left=_mid_air(state.left),
        stands=False,
        tally=tally,
        outcome=met.outcome,
        passed=past(met.motion, meeting.number),
    )


@model_function
def land(contact: object, physics: Physics, state: State, rock: RockContext, record: Record) -> State:
    """Return the state after a contact with the ground; one rule per class of contacts: lumped mass or sphere."""


@land.rule(Contact)
def land_point(contact: Contact, physics: Physics, state: State, rock: RockContext, record: Record) -> State:
    """Return the state of a lumped mass after a contact: it slides on if the contact is slight, else it rebounds."""
    facets = physics.facets
    n = scale(contact.side, stored_normal(facets, contact.facet))
    released_on_ground = state.left.facet < 0 and contact.t == 0.0
    if state.left.resting or released_on_ground:
        held = held_by(facets, physics.settings, state, contact, n)
        if held.left.facet >= 0:
            return stand(facets, state, held.left, held.v)
    rock_now, before = rock_at(rock, state), _raised(facets, contact.facet, n, state.motion)
    after = rebounded(physics, before, contact.facet, n, rock_now)
    note_impact(record, state.tally, before, after, contact.facet, n)
    tally = with_impact(state.tally, contact.facet, after)
    left = PreviousContact(facet=contact.facet, other=-1, side=contact.side, resting=False, before=-1)
    passed = still_at(physics.effects, after, state.passed, rock_now)
    bounced = State(motion=after, left=left, stands=False, tally=tally, outcome=MOVING, passed=passed)
    if breaks(physics.effects, before, after, n, rock_now):
        return ended(bounced, FRAGMENTED)
    return settle(physics, bounced, n, rock, record)


@kernel
def _raised(facets: Facets, f: int, n: Vec, motion: Motion) -> Motion:
    """Return the motion of a rock that touches facet f, moved up to the facet's plane if the rock is slightly below it.

    n : (3,) normal of the facet, turned towards the rock

    After a crack a rock may be below the facet that it touches next (`detection.contact`). These depths would add up
    from facet to facet, until the rock touches no facet. Contacts found in fixed steps are far deeper; their rocks are
    not moved.
    """
    depth = -dot(n, subtract(motion.x, corner(facets, f, 0)))
    if not NEAR * facets.tolerance < depth <= NEAR * facets.crack:
        return motion
    return Motion(t=motion.t, x=on_plane(facets, f, motion.x), v=motion.v, w=motion.w)


@kernel
def rebounded(physics: Physics, motion: Motion, facet: int, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a rock after an impact on a facet, by the rebound model and the effects.

    n : (3,) normal of the facet, turned towards the rock

    An effect may replace the facet's normal by another one (the felt normal). The facet's normal is used if the rock
    would not hit a surface with the felt normal, or if the rebound would send the rock into the ground. If the rock
    still moves into the ground, its speed into the ground is set to zero. A rock that already moves off the facet
    receives no impulse.
    """
    if dot(motion.v, n) > 0.0:
        return motion
    zone = physics.facets.zone[facet]
    surface = surface_of(physics.materials, zone, rock)
    felt = felt_normal(physics.effects, n, motion, rock)
    if dot(motion.v, felt) >= 0.0:
        felt = n
    after = _struck(physics, zone, surface, motion, felt, rock)
    if physics.effects is not None and dot(after.v, n) < 0.0:
        after = _struck(physics, zone, surface, motion, n, rock)
    into = dot(after.v, n)
    if into >= 0.0:
        return after
    return Motion(t=after.t, x=after.x, v=subtract(after.v, scale(into, n)), w=after.w)


@kernel
def _struck(physics: Physics, zone: int, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a rock after its rebound from a surface of normal n, without the safeguards of `rebounded`.

    An effect may let the rock enter the ground first.
    """
    entering = in_ground(physics.effects, zone, surface, motion, n, rock)
    return rebound(physics.rebound, surface, entering, n, rock)  # type: ignore[no-any-return]
