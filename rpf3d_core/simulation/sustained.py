"""Sustained contact: when it begins, and how each ground model carries on from there."""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc
from rpf3d_core.compiling import kernel, model_function
from rpf3d_core.detection.contact import NOTHING_LEFT, Contact, Left
from rpf3d_core.effects.hooks import Meeting, at_obstacle, first_obstacle, still_at
from rpf3d_core.kinetics.ground import NoGround, law_in_gully, law_on_facet
from rpf3d_core.kinetics.sliding import (
    WEAKEST,
    Piece,
    excursion,
    gully,
    kink,
    line_between,
    slide_in_gully,
    slide_on_facet,
)
from rpf3d_core.materials.falling import Falling
from rpf3d_core.simulation.physics import Physics, as_it_is, ground_of
from rpf3d_core.simulation.record import FIRST_OBSTACLE, Record, against, note_impact, note_piece, note_piece_spins
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.simulation.state import NONE_PASSED, State, ended, past, with_meeting, with_piece, with_slide
from rpf3d_core.terrain.facet_geometry import (
    ALONG_GULLY,
    NEAR,
    PARALLEL,
    corner,
    goes_beside,
    leads_on,
    lies_below,
    stored_normal,
)
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, ZERO, Mode, Motion, Outcome, Vec
from rpf3d_core.vectors import add, along, dot, norm, scale, subtract, without

SLIDING = int(Mode.SLIDING)
STOPPED, MAX_TIME, UNRESOLVED = int(Outcome.STOPPED), int(Outcome.MAX_TIME), int(Outcome.UNRESOLVED_CONTACT)

WEDGED = 64
"""Pieces of path in a row that got nowhere after which a rock is taken to be wedged between facets.

Around a vertex of six facets each can be tried in turn five times over, with a flight of no length in between.
"""


STUCK = 16
"""Pieces of path in a row that got nowhere after which a rock may slide along an edge up to a crack outside a facet, as
two facets may hand it to each other without end; or has stopped, if it is slower than STILL."""
STILL = 1e-12
"""m/s: without friction a rock in a gully goes back and forth in ever smaller steps."""


@model_function
def carry_on(ground: object, physics: Physics, locator: Any, state: State, falling: Falling, record: Record) -> State:
    """The next state of a rock in sustained contact; one rule per ground model.

    locator : of what the rock may meet meanwhile, for models that look
    """


@carry_on.rule(NoGround)
def stop_or_give_up(
    ground: NoGround, physics: Physics, locator: Any, state: State, falling: Falling, record: Record
) -> State:
    """The thesis' stop (section 3.5): below stop_speed the rock has stopped; above it nothing says what follows."""
    surface = ground_of(physics, state.left.facet, falling, state)
    return ended(state, STOPPED if norm(state.motion.v) <= surface.stop_speed else UNRESOLVED)


@carry_on.otherwise
def slide_on(ground: object, physics: Physics, locator: Any, state: State, falling: Falling, record: Record) -> State:
    """Slide, or roll, one piece further, on a facet or in a gully; then stop, turn, or fly off the facet that was left.

    So do all ground models that have a `Law`.
    """
    return along_piece(physics, state, _slide(physics, state, falling), falling, record)


@kernel
def along_piece(physics: Physics, state: State, piece: Piece, falling: Falling, record: Record) -> State:
    """The state after a piece of path on the ground, or at the first obstacle on it."""
    meeting = obstacle_on(physics.effects, state, piece, falling)
    if meeting.t < math.inf:
        n = scale(state.left.side, stored_normal(physics.facets, state.left.facet))
        return at_obstacle_on(physics, state, piece, meeting, n, falling, record)
    tolerance = physics.facets.tolerance
    note_piece(record, state.tally, state.motion, piece.motion.v, SLIDING)
    tally = with_slide(state.tally, piece.length, piece.motion, tolerance, piece.bends)
    stands = not (piece.left_first or piece.left_second)
    left = state.left if stands else _left_behind(state.left, piece, tolerance)
    passed = still_at(physics.effects, piece.motion, state.passed, as_it_is(falling, state))
    return State(piece.motion, left, stands, tally, _outcome(physics.settings, piece, tally.idle), passed)


@kernel
def obstacle_on(effects: Any, state: State, piece: Piece, falling: Falling) -> Meeting:
    """The first obstacle on the chord of a piece of path on the ground, as a share of its length for its time."""
    way = subtract(piece.motion.x, state.motion.x)
    return first_obstacle(effects, Arc(state.motion.x, way, 0.0), state.passed, 1.0, as_it_is(falling, state))  # type: ignore[no-any-return]


@kernel
def at_obstacle_on(
    physics: Physics, state: State, piece: Piece, meeting: Meeting, n: Vec, falling: Falling, record: Record
) -> State:
    """The state of a rock that meets an obstacle on a piece of path: it stands on, lies against it, or is caught.

    What is left of its velocity is what lies across n (3,), the normal that it lies on, or along the line of its gully.
    """
    before = on_piece(state.motion, piece.motion, meeting.t)
    note_piece(record, state.tally, state.motion, before.v, SLIDING)
    note_piece_spins(record, state.tally, state.motion.w, before.w)
    tally = with_piece(state.tally, meeting.t * piece.length, before, physics.facets.tolerance)
    who = as_it_is(falling, state)
    met = at_obstacle(physics.effects, before, meeting.number, tally.meetings, who)
    v = met.motion.v
    v = along(v, n) if state.left.other < 0 else along_line(v, before.v)
    after = Motion(before.t, before.x, v, met.motion.w)
    note_impact(record, tally, before, after, FIRST_OBSTACLE - meeting.number, against(before.v))
    outcome = STOPPED if met.outcome == MOVING and past(after, 0) == NONE_PASSED else met.outcome
    passed = past(after, meeting.number)
    return State(after, state.left, True, with_meeting(tally, met.facet), outcome, passed)


@kernel
def on_piece(start: Motion, end: Motion, share: float) -> Motion:
    """The motion after a share of the chord of a piece on the ground: along it the square of the speed grows evenly.

    So its energy lies between those at the ends, and the motion at either end is that of the piece, to rounding.
    """
    begin2, end2 = dot(start.v, start.v), dot(end.v, end.v)
    speed = math.sqrt(max(begin2 + share * (end2 - begin2), 0.0))
    way = subtract(end.x, start.x)
    heading = add(scale(1.0 - share, start.v), scale(share, end.v))
    if norm(heading) == 0.0:
        heading = way
    length = norm(heading)
    v = scale(speed / length, heading) if length > 0.0 else ZERO
    mean, whole = math.sqrt(begin2) + speed, math.sqrt(begin2) + math.sqrt(end2)
    part = share * whole / mean if mean > 0.0 else share
    return Motion(start.t + min(part, 1.0) * (end.t - start.t), add(start.x, scale(share, way)), v, end.w)


@kernel
def along_line(v: Vec, line: Vec) -> Vec:
    """The part of v along the direction of another vector; zero where that is zero."""
    square = dot(line, line)
    return scale(dot(v, line) / square, line) if square > 0.0 else ZERO


@kernel
def _outcome(settings: Settings, piece: Piece, idle: int) -> int:
    """How a piece of sliding ended for the rock; one that goes round in a corner has stopped if it is slow.

    Slow: it could not rise by smallest_bounce any more.
    """
    if piece.late:
        return MAX_TIME
    if piece.stopped:
        return STOPPED
    speed2 = dot(piece.motion.v, piece.motion.v)
    if idle >= STUCK and 0.0 < speed2 <= STILL * STILL:
        return STOPPED
    if idle < WEDGED:
        return MOVING
    return STOPPED if speed2 <= 2.0 * settings.gravity * settings.smallest_bounce else UNRESOLVED


@kernel
def _slide(physics: Physics, state: State, falling: Falling) -> Piece:
    """One piece of sliding from where the rock stands."""
    facets, settings, left, motion = physics.facets, physics.settings, state.left, state.motion
    first = ground_of(physics, left.facet, falling, state)
    time_left = settings.max_time - motion.t
    n = scale(left.side, stored_normal(facets, left.facet))
    line = line_between(facets, left.facet, left.other, motion.x, motion.v) if left.other >= 0 else ZERO
    if line[0] == 0.0 and line[1] == 0.0 and line[2] == 0.0:
        law = law_on_facet(physics.ground, first, n[2], settings.gravity)
        stuck = left.before == left.facet or state.tally.idle >= STUCK
        slack = facets.crack if stuck and goes_beside(facets, left.facet, motion.x, motion.v) else 0.0
        return slide_on_facet(facets, left.facet, n, motion, law, settings.gravity, time_left, slack)
    second = ground_of(physics, left.other, falling, state)
    held = gully(n, scale(left.side, stored_normal(facets, left.other)), line, settings.gravity)
    pushes = max(held.first, 0.0), max(held.second, 0.0)
    law = law_in_gully(physics.ground, first, second, pushes, settings.gravity)
    return slide_in_gully(facets, left.facet, left.other, held, motion, law, time_left)


@kernel
def _left_behind(left: Left, piece: Piece, tolerance: float) -> Left:
    """The facet that the rock has just slid off, and the one before if this led nowhere."""
    facet = left.facet if piece.left_first else left.other
    return Left(facet, -1, left.side, True, left.before if piece.length <= tolerance else -1)


class Hold(NamedTuple):
    """What holds a rock in sustained contact (`left.facet` -1: nothing), and the velocity that this leaves it."""

    left: Left
    v: Vec


@kernel
def held_by(facets: Facets, settings: Settings, state: State, contact: Contact, n: Vec) -> Hold:
    """What holds a rock that slid, or was released, onto a facet: that facet, a gully with the last one, or nothing.

    A contact whose excursion from the ground is below smallest_bounce is no impact: sliding over the slight kinks of
    a mesh would otherwise cost speed at every facet. `n` is the facet's normal turned towards the rock.
    """
    v, last = state.motion.v, state.left.facet
    into, g_n = -dot(v, n), settings.gravity * n[2]
    slight = g_n > 0.0 and into * into < 2.0 * g_n * settings.smallest_bounce
    before = last if state.left.resting and state.tally.idle > 0 else -1
    alone = Left(contact.facet, -1, contact.side, True, before)
    line = _held_line(facets, settings, state, contact, n, slight)
    if line[0] != 0.0 or line[1] != 0.0 or line[2] != 0.0:
        x, kept = state.motion.x, scale(dot(v, line), line)
        if leads_on(facets, contact.facet, x, line, ALONG_GULLY) and leads_on(facets, last, x, line, ALONG_GULLY):
            return Hold(Left(contact.facet, last, contact.side, True, before), kept)
        return Hold(alone, kept) if g_n > 0.0 else Hold(NOTHING_LEFT, v)  # the line ends here; no underside carries
    return Hold(alone, along(v, n)) if slight else Hold(NOTHING_LEFT, v)


@kernel
def _held_line(facets: Facets, settings: Settings, state: State, contact: Contact, n: Vec, slight: bool) -> Vec:
    """Direction of the line between the contact's facet (normal n) and the one slid off last, if they hold the rock.

    Both must push, and the rock must climb neither by smallest_bounce. Facets as good as one plane hold it only if it
    goes back and forth between them without getting anywhere. Zero if they do not hold it.
    """
    last, x, v = state.left.facet, state.motion.x, state.motion.v
    if last < 0 or last == contact.facet or not state.left.resting or contact.side != state.left.side:
        return ZERO
    m = scale(state.left.side, stored_normal(facets, last))
    off_last = abs(dot(m, subtract(x, corner(facets, last, 0))))
    one_plane = kink(n, m) <= PARALLEL
    if off_last > NEAR * facets.tolerance or (one_plane and contact.facet != state.left.before):
        return ZERO
    line = line_between(facets, contact.facet, last, x, v)
    if one_plane:
        return line
    if lies_below(facets, contact.facet, last, contact.side, NEAR * facets.tolerance):
        return ZERO  # a ridge: its facets push as a gully's do, but hold nothing
    held = gully(n, m, line, settings.gravity)
    weakest = -WEAKEST * settings.gravity
    if held.first < weakest or held.second < weakest:
        return ZERO
    onto, off = without(v, n), subtract(v, scale(2.0 * dot(v, n), n))
    climbs = excursion(n, m, onto, settings.gravity) >= settings.smallest_bounce
    bounces = not slight and excursion(m, n, off, settings.gravity) >= settings.smallest_bounce
    return ZERO if climbs or bounces else line
