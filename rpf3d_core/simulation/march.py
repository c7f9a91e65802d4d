"""The one loop: from event to event until the rock has an outcome. Both engines run it."""

import math
from typing import Any

from rpf3d_core.arc import Arc, advance, arc_length
from rpf3d_core.compiling import guarded, kernel
from rpf3d_core.detection.contact import NOTHING_LEFT, Contact, Left, contact_or_crack, flight_end
from rpf3d_core.kinetics.rebound import rebound, rest_of_bounces
from rpf3d_core.materials.library import surface_of
from rpf3d_core.simulation.record import Record, note_impact, note_piece
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.simulation.state import MOVING, State, released, with_ground, with_impact, with_piece
from rpf3d_core.simulation.sustained import carry_on, held_by
from rpf3d_core.terrain.facet_geometry import contains, on_line, on_plane, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Mode, Motion, Outcome, Vec
from rpf3d_core.vectors import add, along, dot, norm, scale

SETTLED = 1e-6
"""Share of smallest_bounce below which bounces end wherever they are: in a corner they never fit on one facet."""

FLIGHT, SETTLING, END = int(Mode.FLIGHT), int(Mode.SETTLING), int(Mode.END)
LEFT_TERRAIN, MAX_TIME, MAX_IMPACTS = int(Outcome.LEFT_TERRAIN), int(Outcome.MAX_TIME), int(Outcome.MAX_IMPACTS)
FAILED = int(Outcome.FAILED)


@kernel
def follow(
    model: Any, ground: Any, locator: Any, facets: Facets, materials: Any, settings: Settings, motion: Motion,
    key: Any, record: Record,
) -> State:  # fmt: skip
    """Follow a rock from its release to its outcome.

    model, ground : parameters of a rebound and a ground model; locator : of either engine
    key : the `RockKey` that drawn materials ask for, None for fixed ones
    record : where to write impacts and pieces
    """
    state = checked(released(motion), released(motion))
    while state.outcome == MOVING:
        state = checked(state, next_event(model, ground, locator, facets, materials, settings, state, key, record))
    note_piece(record, state.tally, state.motion, state.motion.v, END)
    return state


def no_event(
    model: Any, ground: Any, locator: Any, facets: Facets, materials: Any, settings: Settings, state: State, key: Any,
    record: Record,
) -> State:  # fmt: skip
    """What `next_event` gives in Python where its arithmetic fails: the rock has failed where it is."""
    return State(state.motion, state.left, state.stands, state.tally, FAILED)


@guarded(no_event)
def next_event(
    model: Any, ground: Any, locator: Any, facets: Facets, materials: Any, settings: Settings, state: State, key: Any,
    record: Record,
) -> State:  # fmt: skip
    """The state after the next event of a rock on its way."""
    if state.tally.contacts >= settings.max_impacts:
        return State(state.motion, state.left, state.stands, state.tally, MAX_IMPACTS)
    if state.stands:
        return carry_on(ground, facets, materials, settings, state, key, record)  # type: ignore[no-any-return]
    return fly_on(model, locator, facets, materials, settings, state, key, record)


@kernel
def checked(before: State, after: State) -> State:
    """The state after an event; if anything in it is no finite number, the rock has failed where it was before.

    What the event wrote down is written over by the end of the path, and by the rocks that follow.
    """
    t, x, v, _ = after.motion
    if math.isfinite(t + x[0] + x[1] + x[2] + v[0] + v[1] + v[2] + after.tally.path + after.tally.speed2):
        return after
    return State(before.motion, before.left, before.stands, before.tally, FAILED)


@kernel
def fly_on(
    model: Any, locator: Any, facets: Facets, materials: Any, settings: Settings, state: State, key: Any,
    record: Record,
) -> State:  # fmt: skip
    """Fly to the next contact and deal with it; or out of the terrain; or until time is up."""
    arc = Arc(state.motion.x, state.motion.v, settings.gravity)
    end = flight_end(facets, arc)
    contact = contact_or_crack(locator, facets, arc, state.left, end)
    left = settings.max_time - state.motion.t
    t = min(contact.t, end, left)
    motion = advance(state.motion, settings.gravity, t)
    note_piece(record, state.tally, state.motion, motion.v, FLIGHT)
    tally = with_piece(state.tally, arc_length(arc, t), motion, facets.tolerance)
    if t == left:
        return State(motion, state.left, False, tally, MAX_TIME)
    if contact.t > end:
        return State(motion, state.left, False, tally, LEFT_TERRAIN)
    landed = State(motion, state.left, False, tally, MOVING)
    return _land(model, facets, materials, settings, landed, contact, key, record)


@kernel
def _land(
    model: Any, facets: Facets, materials: Any, settings: Settings, state: State, contact: Contact, key: Any,
    record: Record,
) -> State:  # fmt: skip
    """A contact: sliding goes on over it if it is slight, otherwise it is an impact."""
    n = scale(contact.side, stored_normal(facets, contact.facet))
    released_on_ground = state.left.facet < 0 and contact.t == 0.0
    if state.left.resting or released_on_ground:
        held = held_by(facets, settings, state, contact, n)
        if held.left.facet >= 0:
            return _stand(facets, state, held.left, held.v)
    surface = surface_of(materials, facets.zone[contact.facet], key, state.tally.impacts)
    after = rebound(model, surface, state.motion, n)
    note_impact(record, state.tally, state.motion, after, contact.facet, n)
    tally = with_impact(state.tally, contact.facet, after)
    bounced = State(after, Left(contact.facet, -1, contact.side, False, -1), False, tally, MOVING)
    return _settle(model, facets, materials, settings, bounced, n, key, record)


@kernel
def _stand(facets: Facets, state: State, held: Left, v: Vec) -> State:
    """Enter sustained contact with velocity v: the position is put back on the plane, or line, that holds the rock."""
    x = on_plane(facets, held.facet, state.motion.x)
    if held.other >= 0:
        x = on_line(facets, held.facet, held.other, x)
    motion = Motion(state.motion.t, x, v, state.motion.w)
    tally = with_ground(state.tally, held.facet, norm(motion.v))
    return State(motion, held, True, tally, state.outcome)


@kernel
def _settle(
    model: Any, facets: Facets, materials: Any, settings: Settings, state: State, n: Vec, key: Any, record: Record
) -> State:
    """After an impact: sum up the rest of the bounces if they are small and stay on the facet.

    Otherwise the rock flies on. Needs a facet that gravity presses the rock against. Where each impact draws its
    ground, the rest of the bounces has that of the next.
    """
    f, motion = state.left.facet, state.motion
    g_n = settings.gravity * n[2]
    rise2 = dot(motion.v, n) * dot(motion.v, n)
    if g_n <= 0.0 or not rise2 < 2.0 * g_n * settings.smallest_bounce:  # a rise that is no number is for `checked`
        return state
    surface = surface_of(materials, facets.zone[f], key, state.tally.impacts)
    rest = rest_of_bounces(model, surface, motion, n, settings.gravity)
    x = add(motion.x, add(rest.along, rest.down))
    if rest.ends and motion.t + rest.t <= settings.max_time and _stays_on(facets, f, motion.x, rest.along, rest.down):
        end = Motion(motion.t + rest.t, x, rest.v, motion.w)
        note_piece(record, state.tally, motion, rest.v, SETTLING)
        tally = with_piece(state.tally, norm(add(rest.along, rest.down)), end, facets.tolerance)
        return _stand(facets, State(end, state.left, True, tally, MOVING), state.left, along(rest.v, n))
    if rise2 < 2.0 * g_n * settings.smallest_bounce * SETTLED:
        return _stand(facets, state, state.left, along(motion.v, n))
    return state


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
