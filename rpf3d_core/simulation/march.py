"""The one loop: from event to event until the rock has an outcome. Both engines run it."""

import math
from typing import Any

from rpf3d_core.arc import Arc, advance, arc_length
from rpf3d_core.compiling import guarded, kernel, model_function
from rpf3d_core.detection.contact import Contact, Left, is_fall
from rpf3d_core.effects.hooks import Meeting, at_obstacle, breaks, felt_normal, first_obstacle, in_ground, still_at
from rpf3d_core.kinetics.rebound import rebound, rest_of_bounces
from rpf3d_core.materials.falling import Falling
from rpf3d_core.materials.library import Surface, surface_of
from rpf3d_core.simulation.parabola import next_parabola, out_of_air
from rpf3d_core.simulation.physics import Physics, as_it_is, ground_of
from rpf3d_core.simulation.record import FIRST_OBSTACLE, Record, against, note_impact, note_piece
from rpf3d_core.simulation.state import (
    State,
    Tally,
    ended,
    past,
    released,
    with_ground,
    with_impact,
    with_meeting,
    with_piece,
)
from rpf3d_core.simulation.sustained import carry_on, held_by
from rpf3d_core.terrain.facet_geometry import NEAR, contains, corner, on_line, on_plane, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, Mode, Motion, Outcome, Vec
from rpf3d_core.vectors import add, along, dot, norm, scale, subtract

SETTLED = 1e-6
"""Share of smallest_bounce below which bounces end wherever they are: in a corner they never fit on one facet."""

STRETCHES = 10_000
"""Stretches of flight, beside two pieces of path for each contact, that a rock may take whatever max_impacts says."""

FLIGHT, SETTLING, END = int(Mode.FLIGHT), int(Mode.SETTLING), int(Mode.END)
LEFT_TERRAIN, MAX_TIME, MAX_IMPACTS = int(Outcome.LEFT_TERRAIN), int(Outcome.MAX_TIME), int(Outcome.MAX_IMPACTS)
FAILED, FRAGMENTED = int(Outcome.FAILED), int(Outcome.FRAGMENTED)
FELL_THROUGH = int(Outcome.FELL_THROUGH)


@model_function
def locator_for(model: object, locator: Any, falling: Falling) -> Any:
    """The locator that finds the contacts of a rock: as it is, but for rebound models of bodies with a size."""


@locator_for.otherwise
def locator_of_points(model: object, locator: Any, falling: Falling) -> Any:
    """As it is."""
    return locator


@model_function
def set_down(model: object, locator: Any, facets: Facets, motion: Motion) -> Motion:
    """The motion that a rock is released with, from what its source says."""


@set_down.otherwise
def as_told(model: object, locator: Any, facets: Facets, motion: Motion) -> Motion:
    """The same."""
    return motion


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
        return carry_on(physics.ground, physics, locator, state, falling, record)  # type: ignore[no-any-return]
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


@kernel
def fly_on(physics: Physics, locator: Any, state: State, falling: Falling, record: Record) -> State:
    """Fly to the next contact or obstacle and deal with it; or out of the terrain, into a gap, or until time is up."""
    who, gravity = as_it_is(falling, state), physics.settings.gravity
    flown = next_parabola(physics, locator, state, who)
    start, t = flown.start, flown.t
    arrived = advance(start, gravity, t)
    note_piece(record, state.tally, start, arrived.v, FLIGHT)
    motion = out_of_air(physics, locator, arrived, t, flown.longest, who)
    tally = with_piece(state.tally, arc_length(Arc(start.x, start.v, gravity), t), motion, physics.facets.tolerance)
    after = State(motion, state.left, False, tally, MOVING, state.passed)
    if t == flown.meeting.t and t < flown.left:
        return _meet(physics.effects, after, flown.meeting, falling, record)
    if t == flown.loss.t and t < flown.left:
        return ended(after, flown.loss.outcome)
    lands = flown.contact.t <= t and t < flown.left
    if t == flown.longest and t < flown.left and not lands:
        on = State(motion, _mid_air(state.left), False, tally, MOVING, state.passed)
        return ended(on, MAX_IMPACTS) if _hovers(physics.settings.max_impacts, tally) else on
    if is_fall(flown.contact) and t < flown.left:
        return ended(state, FELL_THROUGH)
    if lands:
        return land(flown.contact, physics, after, falling, record)  # type: ignore[no-any-return]
    return ended(after, MAX_TIME if t == flown.left else LEFT_TERRAIN)


@kernel
def _hovers(max_impacts: int, tally: Tally) -> bool:
    """Whether a rock has flown so many stretches that its outcome is none but a matter of patience.

    A light rock in a strong drag layer sinks by centimetres a second, in stretches of a millisecond.
    """
    return tally.pieces - 2 * tally.contacts >= max(max_impacts, STRETCHES)


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


@model_function
def land(contact: object, physics: Physics, state: State, falling: Falling, record: Record) -> State:
    """The state after a contact; one rule per class of contacts, which is its locator's."""


@land.rule(Contact)
def land_point(contact: Contact, physics: Physics, state: State, falling: Falling, record: Record) -> State:
    """A contact of a lumped mass: sliding goes on over it if it is slight, otherwise it is an impact."""
    facets = physics.facets
    n = scale(contact.side, stored_normal(facets, contact.facet))
    released_on_ground = state.left.facet < 0 and contact.t == 0.0
    if state.left.resting or released_on_ground:
        held = held_by(facets, physics.settings, state, contact, n)
        if held.left.facet >= 0:
            return _stand(facets, state, held.left, held.v)
    who, before = as_it_is(falling, state), _raised(facets, contact.facet, n, state.motion)
    after = rebounded(physics, before, contact.facet, n, who)
    note_impact(record, state.tally, before, after, contact.facet, n)
    tally = with_impact(state.tally, contact.facet, after)
    left = Left(contact.facet, -1, contact.side, False, -1)
    passed = still_at(physics.effects, after, state.passed, who)
    bounced = State(after, left, False, tally, MOVING, passed)
    if breaks(physics.effects, before, after, n, who):
        return ended(bounced, FRAGMENTED)
    return _settle(physics, bounced, n, falling, record)


@kernel
def _raised(facets: Facets, f: int, n: Vec, motion: Motion) -> Motion:
    """The motion of a rock that meets facet f, put back on its plane from below; n (3,) is turned towards the rock.

    Across a crack a rock may lie below the facet that takes it (`detection.contact`). Such depths would add up from
    facet to facet until no facet takes the rock. Contacts found in steps lie far deeper, and stay where they are.
    """
    depth = -dot(n, subtract(motion.x, corner(facets, f, 0)))
    if not NEAR * facets.tolerance < depth <= NEAR * facets.crack:
        return motion
    return Motion(motion.t, on_plane(facets, f, motion.x), motion.v, motion.w)


@kernel
def rebounded(physics: Physics, motion: Motion, facet: int, n: Vec, falling: Falling) -> Motion:
    """The motion after an impact on a facet whose normal, turned towards the rock, is n (3,).

    An effect's normal that the rock would not hit, or that would send it into the ground, is none: it then hits the
    ground as it is. Where even that would send it into the ground, its speed into the ground is dropped. A rock that
    only touches the facet, on its way off it, has no impulse to take.
    """
    if dot(motion.v, n) > 0.0:
        return motion
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
    rise2 = _rising2(physics, state, n, as_it_is(falling, state))
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
def _rising2(physics: Physics, state: State, n: Vec, falling: Falling) -> float:
    """Squared speed (m^2/s^2) that a bounce off a facet of normal n, or those that follow it, may rise with.

    That off the facet, unless the next impact feels another normal than n: then bounces do not die as on a plane, for
    that impact may turn all of the speed upwards.
    """
    v = state.motion.v
    off = dot(v, n)
    down = Motion(state.motion.t, state.motion.x, subtract(v, scale(2.0 * off, n)), state.motion.w)
    felt = felt_normal(physics.effects, n, down, falling)
    as_a_plane = felt[0] == n[0] and felt[1] == n[1] and felt[2] == n[2]
    return off * off if as_a_plane else dot(v, v)


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
    for each in corners:
        inside = inside and contains(facets, f, each, False, facets.tolerance)
    return inside
