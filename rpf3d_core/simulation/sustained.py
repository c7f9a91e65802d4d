"""Sliding, rolling and stopping of a rock on the ground: how a ground model moves the rock, segment by segment."""

import math
from typing import Any

from rpf3d_core.arc import Arc
from rpf3d_core.detection.contact import Contact, PreviousContact
from rpf3d_core.detection.terrain_pieces import TerrainPieces, contact_on_way
from rpf3d_core.effects.hooks import Meeting, at_obstacle, first_obstacle, still_at
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.kinetics.ground import NoGround, law_in_gully, law_on_facet
from rpf3d_core.kinetics.gully import gully, line_between
from rpf3d_core.kinetics.sliding import SlidePlane, SlideSegment, slide_in_gully, slide_on_facet
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.landing import land_point
from rpf3d_core.simulation.physics import Physics, ground_of, rock_at
from rpf3d_core.simulation.record import FIRST_OBSTACLE, Record, against, note_impact, note_piece, note_piece_spins
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.simulation.state import NONE_PASSED, State, ended, past, with_meeting, with_piece, with_slide
from rpf3d_core.terrain.facet_geometry import goes_beside, stored_normal
from rpf3d_core.values import MOVING, ZERO, Mode, Motion, Outcome, Vec
from rpf3d_core.vectors import add, along, dot, norm, scale, subtract

SLIDING = int(Mode.SLIDING)
STOPPED, MAX_TIME, UNRESOLVED = int(Outcome.STOPPED), int(Outcome.MAX_TIME), int(Outcome.UNRESOLVED_CONTACT)

WEDGED = 64
"""Number of consecutive path segments without progress after which a rock counts as wedged between facets.

Around a vertex of six facets, this is enough to try each facet five times, with a flight of zero length in between.
"""


HALVINGS = 12
"""Largest number of times that a ground segment is halved, to find where a rock meets a separate part of the terrain.

A segment that turns by 7 degrees then turns by less than 0.002 degrees, and its chord is nearly the path of the rock.
"""
STUCK = 16
"""Number of consecutive path segments without progress after which a rock is treated as stuck.

A rock may change endlessly from one facet to another and back. A stuck rock may therefore slide along an edge up to a
crack's width outside a facet. A stuck rock slower than STILL has stopped.
"""
STILL = 1e-12
"""Speed (m/s) below which a stuck rock has stopped.

Without friction, a rock in a gully moves in smaller and smaller segments.
"""


@model_function
def carry_on(ground: object, physics: Physics, locator: Any, state: State, rock: RockContext, record: Record) -> State:
    """Return the next state of a rock in sustained contact with the ground; one rule per ground model.

    ground : parameters of the ground model
    locator : contact search, for models that look for further contacts along the path
    """


@carry_on.rule(NoGround)
def stop_or_give_up(
    ground: NoGround, physics: Physics, locator: Any, state: State, rock: RockContext, record: Record
) -> State:
    """Return the end state of a rock without a ground model: STOPPED up to stop_speed, else UNRESOLVED_CONTACT.

    This is the rule of the thesis (section 3.5). Above stop_speed, the thesis has no rule for the motion that follows.
    """
    surface = ground_of(physics, state.left.facet, rock, state)
    return ended(state, STOPPED if norm(state.motion.v) <= surface.stop_speed else UNRESOLVED)


@carry_on.otherwise
def slide_on(ground: object, physics: Physics, locator: Any, state: State, rock: RockContext, record: Record) -> State:
    """Return the state of a rock after one ground segment of sliding or rolling, on a facet or in a gully.

    The segment ends at max_time, or where the rock stops, has lost its speed uphill, leaves its facet, turns too far
    for one segment, or meets an obstacle or another part of the terrain. All ground models that have a `Law` use this
    rule.

    locator : not used; record : receives the segment, and an impact or a meeting at its end
    """
    return along_piece(physics.pieces, physics, state, _slide(physics, state, rock, math.inf), rock, record)  # type: ignore[no-any-return]


@model_function
def along_piece(
    pieces: object, physics: Physics, state: State, piece: SlideSegment, rock: RockContext, record: Record
) -> State:
    """Return the state of a rock at the end of a ground segment, or where it meets an obstacle or other ground.

    Other ground is a separate part of the terrain, to which the facet under the rock does not belong.

    pieces : `TerrainPieces`, the separate parts of the terrain; None if these cannot pass through each other
    state : at the start of the segment; piece : the ground segment, as planned without obstacles and other ground
    record : receives the segment, and an impact or a meeting at its end
    """


@along_piece.otherwise
def along_own_piece(
    pieces: object, physics: Physics, state: State, piece: SlideSegment, rock: RockContext, record: Record
) -> State:
    """Return the state of a rock at the end of a ground segment, or at the first obstacle on the segment.

    pieces : not used, because this function does not search for other parts of the terrain
    piece : the ground segment; record : receives the segment, and a meeting with an obstacle
    """
    meeting = obstacle_on(physics.effects, state, piece, rock)
    if meeting.t < math.inf:
        n = scale(state.left.side, stored_normal(physics.facets, state.left.facet))
        return at_obstacle_on(physics, state, piece, meeting, n, rock, record)
    tolerance = physics.facets.tolerance
    note_piece(record, state.tally, state.motion, piece.motion.v, SLIDING)
    tally = with_slide(state.tally, piece.length, piece.motion, tolerance, piece.bends)
    stands = not (piece.left_first or piece.left_second)
    left = state.left if stands else _left_behind(state.left, piece, tolerance)
    passed = still_at(physics.effects, piece.motion, state.passed, rock_at(rock, state))
    return State(
        motion=piece.motion,
        left=left,
        stands=stands,
        tally=tally,
        outcome=_outcome(physics.settings, piece, tally.idle),
        passed=passed,
    )


@along_piece.rule(TerrainPieces)
def up_to_other_piece(
    pieces: TerrainPieces, physics: Physics, state: State, piece: SlideSegment, rock: RockContext, record: Record
) -> State:
    """Return the state of a rock at the end of a ground segment, or where it meets an obstacle or other ground.

    Other ground is a separate part of the terrain, to which the facet under the rock does not belong. The segment bends
    by 7 degrees at most, so its chord decides where the rock meets other ground, as for obstacles. But the chord may
    enter a facet from which the rock itself moves away, before its path bends back. The duration of the segment is then
    halved, up to HALVINGS times, until the rock moves into the facet that the chord enters, or the chord enters no
    facet.

    pieces : the separate parts of the terrain; piece : the ground segment
    record : receives the segment, and an impact or a meeting at its end
    """
    contact = _other_piece_on(pieces, physics, state, piece)
    for _ in range(HALVINGS):
        if contact.facet < 0 or _moves_into(physics, contact, on_piece(state.motion, piece.motion, contact.t)):
            break
        piece = _slide(physics, state, rock, 0.5 * (piece.motion.t - state.motion.t))
        contact = _other_piece_on(pieces, physics, state, piece)
    if contact.t < obstacle_on(physics.effects, state, piece, rock).t:
        return _onto_other_piece(physics, state, piece, contact, rock, record)
    return along_own_piece(pieces, physics, state, piece, rock, record)


@kernel
def _other_piece_on(pieces: TerrainPieces, physics: Physics, state: State, piece: SlideSegment) -> Contact:
    """Return the first contact of a ground segment's chord with other ground; `t` is a share (-) of the chord.

    pieces : the separate parts of the terrain; piece : the ground segment
    """
    way = subtract(piece.motion.x, state.motion.x)
    return contact_on_way(pieces, physics.facets, state.motion.x, way, state.left)  # type: ignore[no-any-return]


@kernel
def _moves_into(physics: Physics, contact: Contact, before: Motion) -> bool:
    """Return True if a rock moves into the facet of a contact with other ground, and not only the segment's chord does.

    before : the motion of the rock at the contact
    """
    return dot(before.v, stored_normal(physics.facets, contact.facet)) * contact.side < 0.0


@kernel
def _onto_other_piece(
    physics: Physics, state: State, piece: SlideSegment, contact: Contact, rock: RockContext, record: Record
) -> State:
    """Return the state of a rock that meets a facet of a separate part of the terrain on a ground segment.

    The contact is treated as if the rock had slid over an edge onto this facet. The rock rebounds, or slides on over
    this facet, or slides on in the gully between this facet and the rock's last facet. If the rock slides in a gully
    before the contact, the last facet is the first facet of this gully. A rock that is stuck ends at the contact
    (`_outcome_of_stuck`).

    piece : the ground segment; contact : the contact with the facet, with t as the share of the segment's chord
    record : receives the segment up to the contact, and an impact
    """
    before = on_piece(state.motion, piece.motion, contact.t)
    if not _moves_into(physics, contact, before):
        before = _towards(before, subtract(piece.motion.x, state.motion.x))
    length, tolerance = contact.t * piece.length, physics.facets.tolerance
    note_piece(record, state.tally, state.motion, before.v, SLIDING)
    tally = with_slide(state.tally, length, before, tolerance, False)
    left, behind = state.left, state.left.before if length <= tolerance else -1
    on = PreviousContact(facet=left.facet, other=-1, side=left.side, resting=True, before=behind)
    outcome = _outcome_of_stuck(physics.settings, before.v, tally.idle)
    met = State(motion=before, left=on, stands=False, tally=tally, outcome=outcome, passed=state.passed)
    return met if outcome != MOVING else land_point(contact, physics, met, rock, record)


@kernel
def _towards(motion: Motion, way: Vec) -> Motion:
    """Return the motion with its velocity turned into the direction `way` (3,), at the same speed.

    `way` is the chord of a curved segment. A rock that moves along the chord moves into every facet that the chord
    passes through.
    """
    return Motion(t=motion.t, x=motion.x, v=scale(norm(motion.v) / norm(way), way), w=motion.w)


@kernel
def obstacle_on(effects: Any, state: State, piece: SlideSegment, rock: RockContext) -> Meeting:
    """Return the first obstacle on a ground segment; `t` of the result is a share (-) of the segment's chord.

    The result is NO_MEETING if there is no obstacle on the chord.

    effects : parameters of all effects of the scene; piece : the ground segment
    """
    way = subtract(piece.motion.x, state.motion.x)
    return first_obstacle(effects, Arc(x=state.motion.x, v=way, gravity=0.0), state.passed, 1.0, rock_at(rock, state))  # type: ignore[no-any-return]


@kernel
def at_obstacle_on(
    physics: Physics, state: State, piece: SlideSegment, meeting: Meeting, n: Vec, rock: RockContext, record: Record
) -> State:
    """Return the state of a rock that meets an obstacle on a ground segment: it moves on, stops there, or is caught.

    The rock keeps only the component of its new velocity along the ground, or along its gully. If no speed is left, the
    rock stops.

    piece : the ground segment; meeting : the obstacle, with t as the share of the segment's chord
    n : (3,) normal of the ground, turned towards the rock
    record : receives the segment up to the obstacle, and the meeting
    """
    before = on_piece(state.motion, piece.motion, meeting.t)
    note_piece(record, state.tally, state.motion, before.v, SLIDING)
    note_piece_spins(record, state.tally, state.motion.w, before.w)
    tally = with_piece(state.tally, meeting.t * piece.length, before, physics.facets.tolerance)
    rock_now = rock_at(rock, state)
    met = at_obstacle(physics.effects, before, meeting.number, tally.meetings, rock_now)
    v = met.motion.v
    v = along(v, n) if state.left.other < 0 else along_line(v, before.v)
    after = Motion(t=before.t, x=before.x, v=v, w=met.motion.w)
    note_impact(record, tally, before, after, FIRST_OBSTACLE - meeting.number, against(before.v))
    outcome = STOPPED if met.outcome == MOVING and past(after, 0) == NONE_PASSED else met.outcome
    passed = past(after, meeting.number)
    return State(
        motion=after, left=state.left, stands=True, tally=with_meeting(tally, met.facet), outcome=outcome, passed=passed
    )


@kernel
def on_piece(start: Motion, end: Motion, share: float) -> Motion:
    """Return the motion of a rock at a share (0 to 1) of the chord of a ground segment, for example at an obstacle.

    start, end : motion at both ends of the segment

    The squared speed changes linearly along the chord, so the energy lies between the energies at both ends. The spin
    changes linearly in time. At shares 0 and 1 the result equals the motion at these ends, except for rounding errors.
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
    part = min(part, 1.0)
    w = add(start.w, scale(part, subtract(end.w, start.w)))
    return Motion(t=start.t + part * (end.t - start.t), x=add(start.x, scale(share, way)), v=v, w=w)


@kernel
def along_line(v: Vec, line: Vec) -> Vec:
    """Return the component (3,) of vector v along the vector `line`; zero if `line` is zero."""
    square = dot(line, line)
    return scale(dot(v, line) / square, line) if square > 0.0 else ZERO


@kernel
def _outcome(settings: Settings, piece: SlideSegment, idle: int) -> int:
    """Return the outcome of a rock after a ground segment `piece`, or MOVING if the rock continues.

    idle : number of segments without progress since the last segment with progress, as in `RockTally`
    """
    if piece.late:
        return MAX_TIME
    if piece.stopped:
        return STOPPED
    return _outcome_of_stuck(settings, piece.motion.v, idle)


@kernel
def _outcome_of_stuck(settings: Settings, v: Vec, idle: int) -> int:
    """Return the outcome of a rock with velocity v after `idle` segments without progress, or MOVING if it continues.

    A segment without progress is not longer than the tolerance, and does not make the rock much faster than ever before
    (`state.with_piece`).

    After STUCK segments without progress, a rock that still moves, but not faster than STILL, has stopped. After WEDGED
    segments, a rock has stopped if it is too slow to rise by smallest_bounce; otherwise its contact is unresolved.
    """
    speed2 = dot(v, v)
    if idle >= STUCK and 0.0 < speed2 <= STILL * STILL:
        return STOPPED
    if idle < WEDGED:
        return MOVING
    return STOPPED if speed2 <= 2.0 * settings.gravity * settings.smallest_bounce else UNRESOLVED


@kernel
def _slide(physics: Physics, state: State, rock: RockContext, longest: float) -> SlideSegment:
    """Return the next ground segment from the rock's position: along its facet or gully, with the friction there.

    longest : duration (s) after which the segment ends, as at a bend, if it lasts longer; inf for no such limit
    """
    until_end = physics.settings.max_time - state.motion.t
    piece = _slide_for(physics, state, rock, min(until_end, longest))
    if not piece.late or until_end <= longest:
        return piece
    return SlideSegment(
        motion=piece.motion,
        length=piece.length,
        stopped=False,
        late=False,
        left_first=False,
        left_second=False,
        bends=True,
    )


@kernel
def _slide_for(physics: Physics, state: State, rock: RockContext, time_left: float) -> SlideSegment:
    """Return the next ground segment from the rock's position; it is `late` if it lasts longer than time_left (s)."""
    facets, settings, left, motion = physics.facets, physics.settings, state.left, state.motion
    first = ground_of(physics, left.facet, rock, state)
    n = scale(left.side, stored_normal(facets, left.facet))
    line = line_between(facets, left.facet, left.other, motion.x, motion.v) if left.other >= 0 else ZERO
    if line[0] == 0.0 and line[1] == 0.0 and line[2] == 0.0:
        law = law_on_facet(physics.ground, first, n[2], settings.gravity)
        stuck = left.before == left.facet or state.tally.idle >= STUCK
        slack = facets.crack if stuck and goes_beside(facets, left.facet, motion.x, motion.v) else 0.0
        plane = SlidePlane(f=left.facet, n=n, slack=slack)
        return slide_on_facet(facets, plane, motion, law, settings.gravity, time_left)
    second = ground_of(physics, left.other, rock, state)
    held = gully(n, scale(left.side, stored_normal(facets, left.other)), line, settings.gravity)
    pushes = max(held.first, 0.0), max(held.second, 0.0)
    law = law_in_gully(physics.ground, first, second, pushes, settings.gravity)
    return slide_in_gully(facets, left.facet, left.other, held, motion, law, time_left)


@kernel
def _left_behind(left: PreviousContact, piece: SlideSegment, tolerance: float) -> PreviousContact:
    """Return the `PreviousContact` of a rock that has just slid off a facet: this facet, for the next contact search.

    left : the facets of the segment; piece : the ground segment, which states the facet that the rock has slid off

    If the segment is not longer than the tolerance (m), the rock made no progress, and the field `before` of `left` is
    kept; otherwise `before` is -1.
    """
    facet = left.facet if piece.left_first else left.other
    return PreviousContact(
        facet=facet, other=-1, side=left.side, resting=True, before=left.before if piece.length <= tolerance else -1
    )
