"""The one loop: from event to event until the rock has an outcome. Both engines run it."""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc, advance, arc_length
from rpf3d_core.compiling import guarded, kernel
from rpf3d_core.detection.contact import NOTHING_LEFT, Contact, Left, contact_or_crack, flight_end
from rpf3d_core.effects.hooks import (
    Meeting,
    asks_height,
    at_obstacle,
    breaks,
    felt_normal,
    first_obstacle,
    in_air,
    in_ground,
    longest_flight,
)
from rpf3d_core.kinetics.rebound import rebound, rest_of_bounces
from rpf3d_core.materials.falling import Falling
from rpf3d_core.materials.library import Surface, surface_of
from rpf3d_core.simulation.physics import Physics, as_it_is, ground_of
from rpf3d_core.simulation.record import FIRST_OBSTACLE, Record, against, note_impact, note_piece
from rpf3d_core.simulation.state import (
    NONE_PASSED,
    State,
    ended,
    past,
    released,
    with_ground,
    with_impact,
    with_meeting,
    with_piece,
)
from rpf3d_core.simulation.sustained import carry_on, held_by
from rpf3d_core.terrain.facet_geometry import contains, on_line, on_plane, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, Mode, Motion, Outcome, Vec
from rpf3d_core.vectors import add, along, dot, norm, scale, subtract

SETTLED = 1e-6
"""Share of smallest_bounce below which bounces end wherever they are: in a corner they never fit on one facet."""

AGAIN = 1.5
"""Stretch of a flight that is flown again, over its time: a little longer, for the rock may take a little longer."""

FLIGHT, SETTLING, END = int(Mode.FLIGHT), int(Mode.SETTLING), int(Mode.END)
LEFT_TERRAIN, MAX_TIME, MAX_IMPACTS = int(Outcome.LEFT_TERRAIN), int(Outcome.MAX_TIME), int(Outcome.MAX_IMPACTS)
FAILED, FRAGMENTED = int(Outcome.FAILED), int(Outcome.FRAGMENTED)


@kernel
def follow(physics: Physics, locator: Any, motion: Motion, falling: Falling, record: Record) -> State:
    """Follow a rock from its release to its outcome.

    locator : of either engine; falling : what the models may ask of the rock; record : where to write
    """
    state = checked(released(motion), released(motion))
    while state.outcome == MOVING:
        state = checked(state, next_event(physics, locator, state, falling, record))
    note_piece(record, state.tally, state.motion, state.motion.v, END)
    return state


def no_event(physics: Physics, locator: Any, state: State, falling: Falling, record: Record) -> State:
    """What `next_event` gives in Python where its arithmetic fails: the rock has failed where it is."""
    return ended(state, FAILED)


@guarded(no_event)
def next_event(physics: Physics, locator: Any, state: State, falling: Falling, record: Record) -> State:
    """The state after the next event of a rock on its way."""
    if state.tally.contacts >= physics.settings.max_impacts:
        return ended(state, MAX_IMPACTS)
    if state.stands:
        return carry_on(physics.ground, physics, state, falling, record)  # type: ignore[no-any-return]
    return fly_on(physics, locator, state, falling, record)


@kernel
def checked(before: State, after: State) -> State:
    """The state after an event; if anything in it is no finite number, the rock has failed where it was before.

    What the event wrote down is written over by the end of the path, and by the rocks that follow.
    """
    t, x, v, w = after.motion
    moving = t + x[0] + x[1] + x[2] + v[0] + v[1] + v[2] + w[0] + w[1] + w[2]
    if math.isfinite(moving + after.tally.path + after.tally.speed2):
        return after
    return ended(before, FAILED)


class Flown(NamedTuple):
    """A parabola that a rock has flown for t seconds.

    start : the motion that it begins with; longest : s for which it may stand for the flight
    left : s until time was up; contact, meeting : the first of either, after t or more seconds
    """

    start: Motion
    t: float
    longest: float
    left: float
    contact: Contact
    meeting: Meeting


@kernel
def fly_on(physics: Physics, locator: Any, state: State, falling: Falling, record: Record) -> State:
    """Fly to the next contact or obstacle and deal with it; or out of the terrain; or until time is up."""
    who, gravity = as_it_is(falling, state), physics.settings.gravity
    flown = _parabola(physics, locator, state, who)
    start, t = flown.start, flown.t
    arrived = advance(start, gravity, t)
    note_piece(record, state.tally, start, arrived.v, FLIGHT)
    motion = out_of_air(physics, locator, arrived, t, flown.longest, who)
    tally = with_piece(state.tally, arc_length(Arc(start.x, start.v, gravity), t), motion, physics.facets.tolerance)
    after = State(motion, state.left, False, tally, MOVING, state.passed)
    if t == flown.left:
        return ended(after, MAX_TIME)
    if t == flown.meeting.t:
        return _meet(physics.effects, after, flown.meeting, falling, record)
    if flown.contact.t <= t:
        return _land(physics, after, flown.contact, falling, record)
    if t == flown.longest:
        return State(motion, _mid_air(state.left), False, tally, MOVING, state.passed)
    return ended(after, LEFT_TERRAIN)


@kernel
def _parabola(physics: Physics, locator: Any, state: State, falling: Falling) -> Flown:
    """The parabola that a rock flies next.

    Where the air acts and the flight ends in the first half of a stretch, the air has acted for longer than the flight
    lasts. Taking that back would give the rock energy, so it flies again, with a stretch of its flight's length.
    """
    facets, settings, effects, motion = physics.facets, physics.settings, physics.effects, state.motion
    longest, height = longest_flight(effects, motion, falling), _height(physics, locator, motion.x)
    while True:  # a loop, so that the search is compiled once
        start = into_air(effects, motion, height, longest, falling)
        arc = Arc(start.x, start.v, settings.gravity)
        end, left = flight_end(facets, arc), settings.max_time - start.t
        contact = contact_or_crack(locator, facets, arc, state.left, min(end, longest))
        t = min(contact.t, end, left, longest)
        meeting = first_obstacle(effects, arc, state.passed, t, falling)
        t = min(t, meeting.t)
        if longest == math.inf or not t < 0.5 * longest:  # a time that is no number is for `checked`
            return Flown(start, t, longest, left, contact, meeting)
        longest = AGAIN * t


@kernel
def into_air(effects: Any, motion: Motion, height: float, longest: float, falling: Falling) -> Motion:
    """The motion with which a rock begins a stretch of `longest` seconds, after the air has acted for half of it.

    The air acts before and after a parabola (`effects.air`), so that contacts are found as exactly as without it.
    Infinite stretches are those of a flight that no air disturbs.
    """
    if longest == math.inf:
        return motion
    return in_air(effects, motion, height, 0.5 * longest, falling)  # type: ignore[no-any-return]


@kernel
def out_of_air(
    physics: Physics, locator: Any, motion: Motion, t: float, longest: float, falling: Falling
) -> Motion:  # fmt: skip
    """The motion with which it ends it after t seconds: with what the air has not done yet."""
    if longest == math.inf:
        return motion
    height = _height(physics, locator, motion.x)
    return in_air(physics.effects, motion, height, t - 0.5 * longest, falling)  # type: ignore[no-any-return]


@kernel
def _height(physics: Physics, locator: Any, x: Vec) -> float:
    """Height above the ground (m) if an effect asks for it, else 0.0; without end over a hole."""
    if not asks_height(physics.effects):
        return 0.0
    height, contact = ground_below(locator, physics.facets, x)
    return height if contact.facet >= 0 else math.inf


@kernel
def _mid_air(left: Left) -> Left:
    """What a rock has left when it goes on in mid-air: no facet, but it is still on the same side of the ground."""
    return Left(-1, -1, left.side, False, -1)


@kernel
def _meet(effects: Any, state: State, meeting: Meeting, falling: Falling, record: Record) -> State:
    """An obstacle: it changes the motion, or ends it."""
    before = state.motion
    met = at_obstacle(effects, before, meeting.number, state.tally.meetings, as_it_is(falling, state))
    note_impact(record, state.tally, before, met.motion, FIRST_OBSTACLE - meeting.number, against(before.v))
    tally = with_meeting(state.tally, met.facet)
    return State(met.motion, _mid_air(state.left), False, tally, met.outcome, past(met.motion, meeting.number))


@kernel
def _land(physics: Physics, state: State, contact: Contact, falling: Falling, record: Record) -> State:
    """A contact: sliding goes on over it if it is slight, otherwise it is an impact."""
    facets = physics.facets
    n = scale(contact.side, stored_normal(facets, contact.facet))
    released_on_ground = state.left.facet < 0 and contact.t == 0.0
    if state.left.resting or released_on_ground:
        held = held_by(facets, physics.settings, state, contact, n)
        if held.left.facet >= 0:
            return _stand(facets, state, held.left, held.v)
    who = as_it_is(falling, state)
    after = rebounded(physics, state.motion, contact.facet, n, who)
    note_impact(record, state.tally, state.motion, after, contact.facet, n)
    tally = with_impact(state.tally, contact.facet, after)
    left = Left(contact.facet, -1, contact.side, False, -1)
    passed = state.passed if state.tally.idle > 0 else NONE_PASSED
    bounced = State(after, left, False, tally, MOVING, passed)
    if breaks(physics.effects, state.motion, after, n, who):
        return ended(bounced, FRAGMENTED)
    return _settle(physics, bounced, n, falling, record)


@kernel
def rebounded(physics: Physics, motion: Motion, facet: int, n: Vec, falling: Falling) -> Motion:
    """The motion after an impact on a facet whose normal, turned towards the rock, is n (3,).

    An effect's normal that the rock would not hit, or that would send it into the ground, is none: it then hits the
    ground as it is. Where even that would send it into the ground, its speed into the ground is dropped.
    """
    zone = physics.facets.zone[facet]
    surface = surface_of(physics.materials, zone, falling)
    felt = felt_normal(physics.effects, n, motion, falling)
    if dot(motion.v, felt) >= 0.0:
        felt = n
    after = _struck(physics, zone, surface, motion, felt, falling)
    if physics.effects is not None and dot(after.v, n) < 0.0:
        after = _struck(physics, zone, surface, motion, n, falling)
    into = dot(after.v, n)
    if into >= 0.0:
        return after
    return Motion(after.t, after.x, subtract(after.v, scale(into, n)), after.w)


@kernel
def _struck(physics: Physics, zone: int, surface: Surface, motion: Motion, n: Vec, falling: Falling) -> Motion:
    """The motion after an impact on a surface whose normal is n, which effects may let the rock enter first."""
    entering = in_ground(physics.effects, zone, surface, motion, n, falling)
    return rebound(physics.rebound, surface, entering, n, falling)  # type: ignore[no-any-return]


@kernel
def _stand(facets: Facets, state: State, held: Left, v: Vec) -> State:
    """Enter sustained contact with velocity v: the position is put back on the plane, or line, that holds the rock."""
    x = on_plane(facets, held.facet, state.motion.x)
    if held.other >= 0:
        x = on_line(facets, held.facet, held.other, x)
    motion = Motion(state.motion.t, x, v, state.motion.w)
    tally = with_ground(state.tally, held.facet, norm(motion.v))
    return State(motion, held, True, tally, state.outcome, state.passed)


@kernel
def _settle(physics: Physics, state: State, n: Vec, falling: Falling, record: Record) -> State:
    """After an impact: sum up the rest of the bounces if they are small and stay on the facet.

    Otherwise, or where an obstacle stands on the way, the rock flies on. Needs a facet that gravity presses the rock
    against. Where each impact draws its ground, the rest of the bounces has that of the next.
    """
    facets, settings, f, motion = physics.facets, physics.settings, state.left.facet, state.motion
    g_n = settings.gravity * n[2]
    rise2 = dot(motion.v, n) * dot(motion.v, n)
    if g_n <= 0.0 or not rise2 < 2.0 * g_n * settings.smallest_bounce:  # a rise that is no number is for `checked`
        return state
    surface = ground_of(physics, f, falling, state)
    rest = rest_of_bounces(physics.rebound, surface, motion, n, settings.gravity, as_it_is(falling, state))
    way = add(rest.along, rest.down)
    x = add(motion.x, way)
    in_time = rest.ends and motion.t + rest.t <= settings.max_time
    clear = no_obstacle_on(physics.effects, motion.x, way, state.passed, as_it_is(falling, state))
    if in_time and clear and _stays_on(facets, f, motion.x, rest.along, rest.down):
        end = Motion(motion.t + rest.t, x, rest.v, motion.w)
        note_piece(record, state.tally, motion, rest.v, SETTLING)
        tally = with_piece(state.tally, norm(way), end, facets.tolerance)
        settled = State(end, state.left, True, tally, MOVING, state.passed)
        return _stand(facets, settled, state.left, along(rest.v, n))
    if rise2 < 2.0 * g_n * settings.smallest_bounce * SETTLED:
        return _stand(facets, state, state.left, along(motion.v, n))
    return state


@kernel
def no_obstacle_on(effects: Any, x: Vec, way: Vec, passed: int, falling: Falling) -> bool:
    """Whether no obstacle stands on a straight way from x (3,) m, which a rock goes in small bounces."""
    return first_obstacle(effects, Arc(x, way, 0.0), passed, 1.0, falling).t == math.inf  # type: ignore[no-any-return]


@kernel
def _stays_on(facets: Facets, f: int, x: Vec, along: Vec, down: Vec) -> bool:
    """Whether bounces that add up to two displacements stay within facet f.

    Partial sums grow monotonically in both, so every bounce lies in the parallelogram; a facet is convex.
    """
    corners = (add(x, along), add(x, down), add(x, add(along, down)))
    inside = True
    for corner in corners:
        inside = inside and contains(facets, f, corner, False, facets.tolerance)
    return inside


@kernel
def ground_below(locator: Any, facets: Facets, x: Vec) -> tuple[float, Contact]:
    """Height of x above the terrain straight below it (m), and the contact there; 0.0 and no contact over a hole.

    A stone is dropped: looking down and falling are the same question.
    """
    drop = Arc(x, (0.0, 0.0, 0.0), 1.0)
    contact = contact_or_crack(locator, facets, drop, NOTHING_LEFT, flight_end(facets, drop))
    return (0.5 * contact.t * contact.t if contact.t < math.inf else 0.0), contact
