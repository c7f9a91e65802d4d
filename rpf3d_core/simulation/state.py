"""The state of one rock between two events, and the tally of its path so far."""

import math
from typing import NamedTuple

from rpf3d_core.detection.contact import NOTHING_LEFT, PreviousContact
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import MOVING, Motion
from rpf3d_core.vectors import dot

NONE_PASSED = -1
"""Number in place of an obstacle's for a rock that has met no obstacle since its last impact."""


class RockTally(NamedTuple):
    """Totals of a rock so far.

    path : length, m; impacts : on the ground; meetings : with obstacles
    pieces : path segments: flights, settlings, slides; contacts : impacts, meetings and slides
    speed2 : largest squared speed (m^2/s^2)
    ground_speed : speed at the first sustained contact (m/s), NaN before it; facet : of the last contact, -1 before it
    idle : path segments in a row without progress
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
    """A rock between two events: it flies, or `stands` in sustained contact with the facets of `left`.

    passed : number of the obstacle that the rock met last and has passed, until its next impact elsewhere; else
        NONE_PASSED
    """

    motion: Motion
    left: PreviousContact
    stands: bool
    tally: RockTally
    outcome: int
    passed: int


@kernel
def released(motion: Motion) -> State:
    """Return the state of a rock at its release."""
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
    """Return the state of a rock that ends at its position with an outcome."""
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
    """Return the tally after a path segment of some length (m) that ended with `motion`.

    A segment no longer than the tolerance (m) is no progress.
    """
    idle = 0 if length > tolerance else tally.idle + 1
    speed2 = max(tally.speed2, dot(motion.v, motion.v))
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
def with_impact(tally: RockTally, facet: int, motion: Motion) -> RockTally:
    """Return the tally after an impact on a facet, after which the rock moves with `motion`."""
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
        idle=tally.idle,
    )


@kernel
def with_meeting(tally: RockTally, facet: int) -> RockTally:
    """Return the tally after an obstacle, which counts as a contact, so that no rock goes back and forth for ever.

    facet : that the rock lies on if it ends there, else -1
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
    """Return the number of the obstacle that a rock has passed; NONE_PASSED if its speed after the obstacle is zero."""
    v = motion.v
    return NONE_PASSED if v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0 else number


@kernel
def with_ground(tally: RockTally, facet: int, speed: float) -> RockTally:
    """Return the tally of a rock that enters sustained contact with a facet at some speed (m/s)."""
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
    """Return the tally after a segment of sliding of some length (m) that ended with `motion`.

    A segment that only bends is no contact, and no sign that the rock makes no progress: the same slide goes on.
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
