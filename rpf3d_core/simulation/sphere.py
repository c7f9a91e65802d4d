"""Motion of a rigid sphere on the ground: rolling, sliding and taking off.

`Motion.x` is the sphere's centre, in flight and on the ground. On the ground one to three contacts carry the sphere
(`sphere_hold`), and it moves in segments of constant acceleration (`kinetics.sphere_ground`). A segment ends where the
sphere rolls off the border of a facet, or where it touches another facet (found as exactly as in flight). On edges and
corners a segment is at most CURVE times the radius R long. After each segment, the centre is moved back to its distance
R from the ground.
"""

import math
from typing import NamedTuple

from rpf3d_core.detection.caps import Loss, loss_on_way
from rpf3d_core.detection.contact import GRAZING, PreviousContact
from rpf3d_core.detection.sphere_contact import stays_on
from rpf3d_core.detection.sphere_course import NO_TOUCH, Course, Touch, course_position, course_velocity
from rpf3d_core.detection.swept import Swept, box_of
from rpf3d_core.detection.touching import Against, SphereSweep, scan
from rpf3d_core.effects.hooks import still_at
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.coulomb_sphere import kicked
from rpf3d_core.kinetics.rolling_moment import STICKS
from rpf3d_core.kinetics.sliding import SlideSegment
from rpf3d_core.kinetics.sphere_ground import RollingSegment, SphereGround, rolling_piece
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.physics import Physics, rock_at
from rpf3d_core.simulation.record import Record, note_piece, note_piece_spins
from rpf3d_core.simulation.sphere_blocked import WALL, along_groove, when_blocked
from rpf3d_core.simulation.sphere_friction import gripped, slip_under, sticks, surface_under
from rpf3d_core.simulation.sphere_hold import TRIES, Held, by_one, held_against, most_against, resultant
from rpf3d_core.simulation.sphere_impacts import is_slight, strike, wedged
from rpf3d_core.simulation.sphere_segments import (
    CURVE,
    Span,
    length_between,
    normal_between,
    pivoted,
    put_back,
    rolling_spin,
    span_of,
    turned_to,
)
from rpf3d_core.simulation.state import State, ended, with_piece, with_slide
from rpf3d_core.simulation.sustained import (
    MAX_TIME,
    SLIDING,
    STOPPED,
    WEDGED,
    at_obstacle_on,
    carry_on,
    obstacle_on,
    on_piece,
)
from rpf3d_core.terrain.facet_geometry import NEAR, REACH, contains, corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, ZERO, Motion, Vec
from rpf3d_core.vectors import add, dot, norm, scale, subtract, without

BENDS = 1e-4
"""Length of a ground segment, divided by the radius (-), above which a segment that only bends is no new contact.

The next segment then continues the same slide. A shorter segment counts as a contact.
"""
ALIKE = 1.0 - 0.5e-6
"""Least cosine of the angle between two contacts whose kink is slight: 1e-3 rad.

A sphere that is pulled into the second contact loses at most a thousandth of its acceleration, until the end of one
segment. At a larger kink, the search for the contacts that carry a sphere finds both.
"""
SAME = math.cos(2.0 * CURVE)
"""Least cosine of the angle between the normals at both ends of a segment on one and the same ground.

If the angle is larger, the normal at the end is that of other ground near the sphere, and is not used.
"""
VANISHED = 1e-9
"""Speed (m/s) up to which a sphere on the ground counts as at rest.

Where a sphere turns back, or in a corner, rounding leaves a speed of about 1e-12 m/s in any direction. Taken as a
motion, it would decide which contacts the sphere leaves.
"""


@kernel
def _take_off(state: State, motion: Motion) -> State:
    """Return the state of a sphere that leaves the ground and flies; motion : its motion at this moment."""
    return State(motion=motion, left=state.left, stands=False, tally=state.tally, outcome=MOVING, passed=state.passed)


# --- on the ground ----------------------------------------------------------------------------------------------------


@carry_on.rule(SphereGround)
def roll_on(
    ground: SphereGround, physics: Physics, locator: Swept, state: State, rock: RockContext, record: Record
) -> State:
    """Return the state of a sphere on the ground after its next event.

    The event is the end of a ground segment, an impact on other ground, a take-off, or the end of the sphere's path.
    The path ends where the sphere stops, is held by three contacts, or makes no progress (`wedged`).

    locator : contact search with the radius of the sphere
    record : receives the ground segment, and an impact or a meeting with an obstacle
    """
    facets, motion = physics.facets, state.motion
    v = motion.v if norm(motion.v) > VANISHED else ZERO
    gravity, noise = (0.0, 0.0, -physics.settings.gravity), GRAZING * norm(v)
    if state.tally.idle >= WEDGED:
        return ended(state, wedged(physics, motion))
    onward = Against(x=motion.x, way=v, v=ZERO, down=gravity, radius=locator.radius, noise=0.5 * noise)
    met = most_against(locator.locator, facets, onward)
    if met.facet >= 0:
        if not is_slight(physics, met.n, -dot(met.n, v), WALL):
            return strike(physics, state, met, rock, record)
        v = held_against(locator.locator, facets, motion.x, locator.radius, v, ZERO, gravity).way
        v = along_groove(physics, locator, motion.x, v)
    held = held_against(locator.locator, facets, motion.x, locator.radius, gravity, v, gravity)
    lying = Motion(t=motion.t, x=motion.x, v=v, w=motion.w)
    if held.contacts == 0:
        return _take_off(state, lying)
    if held.contacts == 3:
        return ended(_at_rest(state, lying), STOPPED)
    n, push = resultant(held)
    push -= _lift(held, v, locator.radius)
    if push <= 0.0:
        landed_on = _landed_on(facets, state, lying, locator.radius)
        if landed_on.facet < 0:
            return _take_off(state, lying)
        held = by_one(landed_on, gravity)
        n, push = resultant(held)
    surface = surface_under(physics, held, rock, state)
    slip = slip_under(held, lying, n, locator.radius)
    brief = BENDS * locator.radius / max(norm(lying.v), VANISHED)
    if sticks(slip, held.way, surface.mu * push, brief):
        lying = kicked(lying, n, locator.radius, STICKS * norm(slip), slip)
        slip = ZERO
    piece = rolling_piece(lying.v, slip, n, held.way, push, surface, locator.radius)
    if piece.stops:
        return ended(_at_rest(state, lying), STOPPED)
    return _follow_piece(physics, locator, state, Lying(motion=lying, held=held, n=n), piece, rock, record)


@kernel
def _at_rest(state: State, motion: Motion) -> State:
    """Return the state of a sphere that has stopped on the ground.

    The outcome of the state is not changed; the caller sets it.

    motion : the last motion; its time and place are kept, and velocity and spin become zero
    """
    return State(
        motion=Motion(t=motion.t, x=motion.x, v=ZERO, w=ZERO),
        left=state.left,
        stands=True,
        tally=state.tally,
        outcome=state.outcome,
        passed=state.passed,
    )


@kernel
def _lift(held: Held, v: Vec, radius: float) -> float:
    """Return by how much (m/s^2) motion around an edge or a corner reduces the sphere's push on the ground: v^2 / R.

    The push is per unit of mass. The result is 0 on the interior of a facet and on two contacts. On an edge, only the
    component of the velocity across the edge counts.

    v : (3,) m/s, velocity of the centre
    held : the contacts that carry the sphere; radius : of the sphere, m
    """
    if held.contacts != 1 or held.first.face:
        return 0.0
    across = without(v, held.first.along)
    return dot(across, across) / radius


@kernel
def _landed_on(facets: Facets, state: State, motion: Motion, radius: float) -> Touch:
    """Return the contact with the facet of the last contact, if this facet carries a sphere that would take off.

    A sphere that rolls fast over an edge or a corner takes off, because its path there is curved. If the kink is only a
    rounding error, the sphere lands on the interior of the next facet after a flight without length, and would take off
    again from the same edge. So the sphere stays on this facet.

    The result is NO_TOUCH if the last segment was longer than the contact tolerance, or if the sphere does not lie on
    the interior of the facet, moves away from it, or is about to leave it across an edge. Up to a crack width, a place
    outside the facet counts as inside, as in the search that found the landing (`detection.search`).

    state : before; motion : of the sphere on the ground, with the velocity that its contacts allow
    radius : of the sphere (m)
    """
    f, x, v = state.left.facet, motion.x, motion.v
    if state.tally.idle == 0 or f < 0:
        return NO_TOUCH
    n = stored_normal(facets, f)
    above = dot(n, subtract(x, corner(facets, f, 0)))
    n = scale(math.copysign(1.0, above), n)
    if n[2] <= 0.0 or dot(v, n) > GRAZING * norm(v):
        return NO_TOUCH
    p, gap = add(x, scale(-abs(above), n)), abs(above) - radius
    if abs(gap) > NEAR * facets.tolerance or not contains(facets, f, p, False, facets.crack):
        return NO_TOUCH
    if not stays_on(facets, f, p, v, (0.0, 0.0, -1.0)):
        return NO_TOUCH
    return Touch(t=0.0, facet=f, approach=0.0, n=n, along=ZERO, face=True)


class Lying(NamedTuple):
    """A sphere on the ground: its motion, the contacts that carry it, and n (3,), the unit direction of their push."""

    motion: Motion
    held: Held
    n: Vec


class SegmentAhead(NamedTuple):
    """A ground segment of a sphere: the motion of its centre, its duration if it meets nothing, and what it meets."""

    course: Course
    span: Span
    touch: Touch


@kernel
def _ahead(physics: Physics, locator: Swept, lying: Lying, piece: RollingSegment, t: float) -> SegmentAhead:
    """Return the next ground segment of a sphere, of at most t (s), and the first contact with other ground on it.

    Gravity, or friction, along the facet that carries the sphere may pull the sphere into another facet that continues
    this facet with a slight kink (ALIKE). The search for the contacts that carry a sphere does not find such a facet if
    the sphere moves onto it. The acceleration then loses its component into the other facet, until the end of this
    segment, so the sphere moves along the other facet. This is repeated for at most TRIES facets.

    lying : the sphere at the start; piece : the ground segment as planned
    """
    facets, a, grazing = physics.facets, piece.a, GRAZING * norm(piece.v)
    tries = 0
    while True:  # a loop, so that the search is compiled once
        course = Course(x=lying.motion.x, v=piece.v, a=a, radius=locator.radius, gravity=physics.settings.gravity)
        span = span_of(facets, lying.held, course, t)
        low, high = box_of(course, 0.0, span.t, REACH * facets.tolerance)
        quest = SphereSweep(course=course, end=span.t, before=span.t)
        touch = scan(locator.locator, facets, low, high, quest, NO_TOUCH)
        pulled = touch.t == 0.0 and touch.approach <= grazing and _continues(lying.held, touch.n)
        if tries == TRIES or not pulled:
            return SegmentAhead(course=course, span=span, touch=touch)
        a, tries = without(a, touch.n), tries + 1


@kernel
def _continues(held: Held, n: Vec) -> bool:
    """Return True if ground with the unit normal n (3,) continues a contact that carries a sphere, with a slight kink.

    held : the contacts that carry the sphere
    """
    return dot(held.first.n, n) >= ALIKE or (held.contacts == 2 and dot(held.second.n, n) >= ALIKE)


@kernel
def _follow_piece(
    physics: Physics,
    locator: Swept,
    state: State,
    lying: Lying,
    piece: RollingSegment,
    rock: RockContext,
    record: Record,
) -> State:
    """Return the state of a sphere at the end of a ground segment, or where it meets ground, a gap or an obstacle.

    lying : the sphere at the start; piece : the ground segment as planned, if the sphere meets nothing
    record : receives the segment, and a meeting with an obstacle
    """
    facets, radius = physics.facets, locator.radius
    motion, held, n = lying.motion, lying.held, lying.n
    left = physics.settings.max_time - motion.t
    ahead = _ahead(physics, locator, lying, piece, min(piece.t, left))
    course, span, touch = ahead.course, ahead.span, ahead.touch
    t = min(span.t, touch.t)
    x, v = course_position(course, t), course_velocity(course, t)
    turned = add(motion.w, scale(t, piece.turn))
    whole = touch.t > t and span.t >= piece.t
    if whole and piece.rolls and norm(piece.turn) > 0.0:
        v, turned = gripped(held, Motion(t=motion.t, x=x, v=v, w=turned), n, radius)
    began = Motion(t=motion.t, x=motion.x, v=piece.v, w=motion.w)
    length = length_between(began.v, v, t)
    x, n_end = put_back(facets, locator, x, n, length, span.curved or held.contacts == 2)
    if held.contacts == 1 and dot(n, n_end) < SAME:
        n_end = n
    v_end = turned_to(v, n_end) if span.curved and touch.t > t else v
    rolls = piece.rolls and (whole or norm(piece.turn) == 0.0)
    w = turned
    if rolls and held.contacts == 1:
        v_end, w = pivoted(v_end, turned, n, n_end, radius)
    if rolls and held.contacts == 2:
        w = rolling_spin(v_end, dot(turned, n), n, radius)
    if touch.t == 0.0:
        v_end, w = when_blocked(physics, Motion(t=motion.t, x=x, v=v_end, w=w), n, touch.n, radius)
    end = Motion(t=motion.t + t, x=x, v=v_end, w=w)
    bends = (piece.turns or span.curved) and touch.t > t and length > BENDS * radius
    late = t >= left
    over = PreviousContact(facet=held.first.facet, other=-1, side=1.0, resting=True, before=-1)
    going = State(motion=began, left=over, stands=True, tally=state.tally, outcome=MOVING, passed=state.passed)
    gone = SlideSegment(
        motion=end, length=length, stopped=False, late=late, left_first=False, left_second=False, bends=bends
    )
    loss = loss_on_way(physics.caps, began.x, subtract(end.x, began.x))
    meeting = obstacle_on(physics.effects, going, gone, rock)
    if loss.t <= 1.0 and loss.t < meeting.t:
        return _lost(facets, going, gone, on_piece(began, end, loss.t), loss, record)
    if meeting.t < math.inf:
        lies_on = normal_between(n, n_end, meeting.t)
        return at_obstacle_on(physics, going, gone, meeting, lies_on, rock, record)
    note_piece(record, state.tally, began, v, SLIDING)
    note_piece_spins(record, state.tally, began.w, w)
    tally = with_slide(state.tally, length, end, facets.tolerance, bends)
    passed = still_at(physics.effects, end, state.passed, rock_at(rock, state))
    return State(motion=end, left=over, stands=True, tally=tally, outcome=MAX_TIME if late else MOVING, passed=passed)


@kernel
def _lost(facets: Facets, state: State, piece: SlideSegment, at: Motion, loss: Loss, record: Record) -> State:
    """Return the end state of a sphere that rolls into a gap of the terrain: where it passes through the cap.

    piece : the ground segment; at : motion at the cap; loss : the passage, with t as the share of the segment's chord
    record : receives the segment up to the cap
    """
    note_piece(record, state.tally, state.motion, at.v, SLIDING)
    note_piece_spins(record, state.tally, state.motion.w, at.w)
    tally = with_piece(state.tally, loss.t * piece.length, at, facets.tolerance)
    return State(motion=at, left=state.left, stands=False, tally=tally, outcome=loss.outcome, passed=state.passed)
