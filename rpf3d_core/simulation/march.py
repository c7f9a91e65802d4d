"""The simulation loop of both engines: it moves a rock from event to event until the rock has an outcome."""

import math
from typing import Any

from rpf3d_core.arc import Arc, advance, arc_length
from rpf3d_core.detection.contact import PreviousContact
from rpf3d_core.detection.search import is_fall
from rpf3d_core.effects.hooks import Meeting, at_obstacle
from rpf3d_core.jit.dispatch import guarded, kernel, model_function
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.landing import land
from rpf3d_core.simulation.parabola import next_parabola, out_of_air
from rpf3d_core.simulation.physics import Physics, rock_at
from rpf3d_core.simulation.record import FIRST_OBSTACLE, Record, against, note_impact, note_piece
from rpf3d_core.simulation.state import (
    RockTally,
    State,
    ended,
    past,
    released,
    with_meeting,
    with_piece,
)
from rpf3d_core.simulation.sustained import UNRESOLVED, carry_on
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, Mode, Motion, Outcome

STRETCHES = 10_000
"""Number of flight segments in air that a rock may always use, in addition to two path segments per contact.

If max_impacts is larger, max_impacts replaces this number.
"""

FLIGHT, END = int(Mode.FLIGHT), int(Mode.END)
LEFT_TERRAIN, MAX_TIME, MAX_IMPACTS = int(Outcome.LEFT_TERRAIN), int(Outcome.MAX_TIME), int(Outcome.MAX_IMPACTS)
FAILED = int(Outcome.FAILED)
FELL_THROUGH = int(Outcome.FELL_THROUGH)


@model_function
def locator_for(model: object, locator: Any, rock: RockContext) -> Any:
    """Return the locator that finds the contacts of one rock; a locator for spheres includes the rock's radius.

    model : rebound model. A model of spheres has its own rule; for all other models the result is `locator` itself.
    """


@locator_for.otherwise
def locator_of_points(model: object, locator: Any, rock: RockContext) -> Any:
    """Return the locator itself, because with this rebound model the rock is a point without a radius."""
    return locator


@model_function
def set_down(model: object, locator: Any, facets: Facets, motion: Motion) -> Motion:
    """Return the motion with which a rock is released; one rule per rebound model.

    motion : the motion that the source sets. A rule may change it: a sphere, for example, must not overlap the ground.
    """


@set_down.otherwise
def as_released(model: object, locator: Any, facets: Facets, motion: Motion) -> Motion:
    """Return the motion at the release unchanged: this rebound model releases a rock exactly as the source sets it."""
    return motion


@model_function
def has_room(model: object, locator: Any, facets: Facets, motion: Motion) -> bool:
    """Return True if a rock does not overlap the ground where it is set down; one rule per rebound model.

    motion : at the release, from `set_down`
    """


@has_room.otherwise
def point_has_room(model: object, locator: Any, facets: Facets, motion: Motion) -> bool:
    """Return True, because a point has no size."""
    return True


@kernel
def follow(physics: Physics, locator: Any, motion: Motion, rock: RockContext, record: Record) -> State:
    """Simulate one rock from its release to its outcome; return its last state.

    A rock that overlaps the ground at its release ends there, with the outcome UNRESOLVED_CONTACT.

    locator : contact search of either engine, from `locator_for`; motion : at the release, from `set_down`
    rock : the rock's data that models may need; record : receives the rows of impacts and path segments
    """
    state = checked(released(motion), released(motion))
    if not has_room(physics.rebound, locator, physics.facets, motion):
        state = ended(state, UNRESOLVED)
    while state.outcome == MOVING:
        state = checked(state, next_event(physics, locator, state, rock, record))
    note_piece(record, state.tally, state.motion, state.motion.v, END)
    return state


def no_event(physics: Physics, locator: Any, state: State, rock: RockContext, record: Record) -> State:
    """Return the rock's state with the outcome FAILED: the result of `next_event` if its computation raises an error.

    Only plain Python raises errors of arithmetic. Compiled code computes numbers that are not finite, and `checked`
    finds these numbers.
    """
    return ended(state, FAILED)


@guarded(no_event)
def next_event(physics: Physics, locator: Any, state: State, rock: RockContext, record: Record) -> State:
    """Return the state of a moving rock after its next event: the end of a flight or of a segment on the ground.

    A rock that already has max_impacts contacts does not move further, and ends with the outcome MAX_IMPACTS.

    record : receives the path segment, and an impact or a meeting with an obstacle
    """
    if state.tally.contacts >= physics.settings.max_impacts:
        return ended(state, MAX_IMPACTS)
    if state.stands:
        return carry_on(physics.ground, physics, locator, state, rock, record)  # type: ignore[no-any-return]
    return fly_on(physics, locator, state, rock, record)


@kernel
def checked(before: State, after: State) -> State:
    """Return `after`, the state after an event, if its numbers are finite; else `before`, with the outcome FAILED.

    The rows that a failed event has written into the record are overwritten later, by the row for the end of the path
    and by the next rocks.
    """
    t, x, v, w = after.motion
    moving = t + x[0] + x[1] + x[2] + v[0] + v[1] + v[2] + w[0] + w[1] + w[2]
    if math.isfinite(moving + after.tally.path + after.tally.speed2):
        return after
    return ended(before, FAILED)


@kernel
def fly_on(physics: Physics, locator: Any, state: State, rock: RockContext, record: Record) -> State:
    """Return the state of a rock after its next parabola.

    The parabola ends at a contact, an obstacle, a gap or the boundary of the terrain, at max_time or, if an effect acts
    in the air, after its planned duration. After the planned duration the rock flies on, or ends with the outcome
    MAX_IMPACTS if it has used too many flight segments (`hovers`). If the rock has fallen through the ground, the
    result is the state before the parabola, with outcome FELL_THROUGH.

    record : receives the path segment, and an impact or a meeting with an obstacle
    """
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
    if t == flown.longest and t < flown.left and t < flown.end and not lands:
        on = State(
            motion=motion, left=_mid_air(state.left), stands=False, tally=tally, outcome=MOVING, passed=state.passed
        )
        return ended(on, MAX_IMPACTS) if hovers(physics.settings.max_impacts, tally) else on
    if is_fall(flown.contact) and t < flown.left:
        return ended(state, FELL_THROUGH)
    if lands:
        return land(flown.contact, physics, after, rock, record)  # type: ignore[no-any-return]
    return ended(after, MAX_TIME if t == flown.left else LEFT_TERRAIN)


@kernel
def hovers(max_impacts: int, tally: RockTally) -> bool:
    """Return True if a rock has used the largest allowed number of flight segments in the air, so its flight must end.

    The largest number is max_impacts or STRETCHES (10,000), whichever is larger. The rock's number of flight segments
    in the air is its number of path segments minus two for each contact.

    A light rock in a strong drag layer sinks by centimetres per second, in segments of a millisecond. Computing such a
    flight down to the ground would take too long.

    max_impacts : as in `Settings`; tally : running totals of the rock
    """
    return tally.pieces - 2 * tally.contacts >= max(max_impacts, STRETCHES)


@kernel
def _mid_air(left: PreviousContact) -> PreviousContact:
    """Return the `PreviousContact` of a rock that starts its next arc in mid-air, away from any facet.

    left : the previous contact, whose side of the ground is kept
    """
    return PreviousContact(facet=-1, other=-1, side=left.side, resting=False, before=-1)


@kernel
def _meet(effects: Any, state: State, meeting: Meeting, rock: RockContext, record: Record) -> State:
    """Return the state of a rock after it meets an obstacle (barrier or tree) that changes or ends its motion.

    effects : parameters of all effects of the scene; state : of the rock at the obstacle
    meeting : the obstacle; record : receives the meeting
    """
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
