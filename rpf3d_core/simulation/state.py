"""The state of one rock between two events, and the running totals of its path so far."""

import math
from typing import NamedTuple

from rpf3d_core.detection.contact import NOTHING_LEFT, PreviousContact
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import MOVING, Motion
from rpf3d_core.vectors import dot

NONE_PASSED = -1
"""Value in place of an obstacle's number: the next flight of the rock ignores no obstacle."""
GAINED = 1.1
"""Factor (-) by which a segment must raise a rock's largest squared speed, to count as progress at any length.

The factor is needed because a rock released at a vertex between steep facets begins with segments of 1e-18 m.
"""


class RockTally(NamedTuple):
    """The running totals of a rock's path so far, which become results of the rock at its end.

    path : length, m; impacts : number of impacts on the ground; meetings : number of meetings with obstacles
    pieces : number of path segments: flights, sums of small bounces, slides
    contacts : number of impacts, meetings and slides; all segments of a slide that bends count once; for a body, each
        time step in contact counts as a slide
    speed2 : largest squared speed (m^2/s^2)
    ground_speed : speed at the beginning of the first sustained contact (m/s), NaN before it
    facet : of the last contact, -1 before the first contact
    idle : number of path segments without progress (`with_piece`) since the last segment with progress; for a lumped
        mass, flights between two impacts do not count
    """

    path: float
    impacts: int
    meetings: int
    pieces: int
    contacts: int
    speed2: float
    ground_speed: float
    facet: int
    idle: int


class State(NamedTuple):
    """The state of a rock between two events: its motion, its contact with the ground, its totals and its outcome.

    left : the facet of the last contact, or both facets of a gully; tally : running totals
    stands : True if the rock is in sustained contact with the facets in `left`, False if it flies
    outcome : number of an `Outcome`, MOVING while the rock moves
    passed : number of the obstacle that the rock has just met, which its next flight ignores; NONE_PASSED for none
    """

    motion: Motion
    left: PreviousContact
    stands: bool
    tally: RockTally
    outcome: int
    passed: int


@kernel
def released(motion: Motion) -> State:
    """Return the state of a rock at its release: in flight, with all totals at zero."""
    tally = RockTally(
        path=0.0,
        impacts=0,
        meetings=0,
        pieces=0,
        contacts=0,
        speed2=dot(motion.v, motion.v),
        ground_speed=math.nan,
        facet=-1,
        idle=0,
    )
    return State(motion=motion, left=NOTHING_LEFT, stands=False, tally=tally, outcome=MOVING, passed=NONE_PASSED)


@kernel
def ended(state: State, outcome: int) -> State:
    """Return the state of a rock whose path ends at its current position, with the given outcome."""
    return State(
        motion=state.motion,
        left=state.left,
        stands=state.stands,
        tally=state.tally,
        outcome=outcome,
        passed=state.passed,
    )


@kernel
def with_piece(tally: RockTally, length: float, motion: Motion, tolerance: float) -> RockTally:
    """Return the rock's running totals after a path segment of the given length (m).

    motion : at the end of the segment

    A segment that is not longer than the tolerance (m) counts as a segment without progress. Exception: if the segment
    raises the largest squared speed by more than the factor GAINED, the number of segments without progress is set to
    at most 1, because gravity moves the rock, and the next segments are longer.
    """
    speed2 = max(tally.speed2, dot(motion.v, motion.v))
    idle = 0 if length > tolerance else tally.idle + 1
    if speed2 > GAINED * tally.speed2:
        idle = min(idle, 1)  # not 0: the rock still moves to and fro between facets (`carrying.held_by`)
    return RockTally(
        path=tally.path + length,
        impacts=tally.impacts,
        meetings=tally.meetings,
        pieces=tally.pieces + 1,
        contacts=tally.contacts,
        speed2=speed2,
        ground_speed=tally.ground_speed,
        facet=tally.facet,
        idle=idle,
    )


@kernel
def with_impact(tally: RockTally, facet: int, motion: Motion, is_bounce: bool) -> RockTally:
    """Return the rock's running totals after an impact on a facet.

    motion : the motion just after the impact
    is_bounce : True if the flight before the impact also began at an impact. The flight then does not count as a
        segment without progress: at a kink of a sharp gully, a rock may bounce from side to side a hundred times
        almost at once, which does not show that the rock is wedged. Bounces that lose no energy end at `max_impacts`
    """
    speed2 = max(tally.speed2, dot(motion.v, motion.v))
    return RockTally(
        path=tally.path,
        impacts=tally.impacts + 1,
        meetings=tally.meetings,
        pieces=tally.pieces,
        contacts=tally.contacts + 1,
        speed2=speed2,
        ground_speed=tally.ground_speed,
        facet=facet,
        idle=max(tally.idle - 1, 0) if is_bounce else tally.idle,
    )


@kernel
def with_meeting(tally: RockTally, facet: int) -> RockTally:
    """Return the rock's running totals after a meeting with an obstacle.

    The meeting counts as a contact, so max_impacts also ends a rock that bounces between obstacles.

    facet : facet that the rock lies on if its motion ends at the obstacle, else -1
    """
    return RockTally(
        path=tally.path,
        impacts=tally.impacts,
        meetings=tally.meetings + 1,
        pieces=tally.pieces,
        contacts=tally.contacts + 1,
        speed2=tally.speed2,
        ground_speed=tally.ground_speed,
        facet=facet if facet >= 0 else tally.facet,
        idle=tally.idle,
    )


@kernel
def past(motion: Motion, number: int) -> int:
    """Return the number of the obstacle that a rock has just passed, so that its next flight ignores it.

    The result is NONE_PASSED if the rock's speed after the obstacle is zero.

    motion : just after the meeting with the obstacle
    """
    v = motion.v
    return NONE_PASSED if v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0 else number


@kernel
def with_ground(tally: RockTally, facet: int, speed: float) -> RockTally:
    """Return the rock's running totals when it begins to slide or roll on a facet, at a speed (m/s).

    `facet` becomes the last facet. The speed is kept as `ground_speed` only if the rock never slid or rolled before.
    """
    first = speed if math.isnan(tally.ground_speed) else tally.ground_speed
    return RockTally(
        path=tally.path,
        impacts=tally.impacts,
        meetings=tally.meetings,
        pieces=tally.pieces,
        contacts=tally.contacts,
        speed2=tally.speed2,
        ground_speed=first,
        facet=facet,
        idle=tally.idle,
    )


@kernel
def with_slide(tally: RockTally, length: float, motion: Motion, tolerance: float, bends: bool) -> RockTally:
    """Return the rock's running totals after a segment of sliding of the given length (m).

    motion : at the end of the segment
    tolerance : m, length up to which a segment counts as a segment without progress
    bends : True if the segment ends only because the path bends, and the same slide continues. The segment then counts
        neither as a contact nor as a segment without progress
    """
    after = with_piece(tally, length, motion, tolerance)
    contacts, idle = tally.contacts + 1, after.idle
    if bends:
        contacts, idle = tally.contacts, min(tally.idle, after.idle)
    return RockTally(
        path=after.path,
        impacts=after.impacts,
        meetings=after.meetings,
        pieces=after.pieces,
        contacts=contacts,
        speed2=after.speed2,
        ground_speed=after.ground_speed,
        facet=after.facet,
        idle=idle,
    )
