"""The state of one rock between two events, and what has been tallied on its way."""

import math
from typing import NamedTuple

from rpf3d_core.detection.contact import NOTHING_LEFT, PreviousContact
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import MOVING, Motion
from rpf3d_core.vectors import dot

NONE_PASSED = -1
"""Stands for the number of an obstacle where a rock has met none since its last impact."""


class RockTally(NamedTuple):
    """What a rock has gathered so far.

    path : m; impacts : on the ground; meetings : with obstacles; pieces : of path: flights, settlings, slides
    contacts : impacts, meetings and slides
    speed2 : largest squared speed (m^2/s^2)
    ground_speed : speed at its first sustained contact (m/s), NaN before; facet : of its last contact, -1 before
    idle : pieces of path in a row without getting anywhere
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

    passed : number of the obstacle that it has met last and is past, until its next impact elsewhere; else NONE_PASSED
    """

    motion: Motion
    left: PreviousContact
    stands: bool
    tally: RockTally
    outcome: int
    passed: int


@kernel
def released(motion: Motion) -> State:
    """The state of a rock at its release."""
    tally = RockTally(0.0, 0, 0, 0, 0, dot(motion.v, motion.v), math.nan, -1, 0)
    return State(motion, NOTHING_LEFT, False, tally, MOVING, NONE_PASSED)


@kernel
def ended(state: State, outcome: int) -> State:
    """The state of a rock that ends where it is."""
    return State(state.motion, state.left, state.stands, state.tally, outcome, state.passed)


@kernel
def with_piece(tally: RockTally, length: float, motion: Motion, tolerance: float) -> RockTally:
    """The tally after a piece of path of some length (m) that ended with `motion`.

    A piece no longer than the tolerance has got nowhere.
    """
    idle = 0 if length > tolerance else tally.idle + 1
    speed2 = max(tally.speed2, dot(motion.v, motion.v))
    return RockTally(
        tally.path + length, tally.impacts, tally.meetings, tally.pieces + 1, tally.contacts, speed2,
        tally.ground_speed, tally.facet, idle,
    )  # fmt: skip


@kernel
def with_impact(tally: RockTally, facet: int, motion: Motion) -> RockTally:
    """The tally after an impact on a facet, which left the rock with `motion`."""
    speed2 = max(tally.speed2, dot(motion.v, motion.v))
    return RockTally(
        tally.path, tally.impacts + 1, tally.meetings, tally.pieces, tally.contacts + 1, speed2, tally.ground_speed,
        facet, tally.idle,
    )  # fmt: skip


@kernel
def with_meeting(tally: RockTally, facet: int) -> RockTally:
    """The tally after an obstacle. It counts as a contact, so that no rock goes back and forth for ever.

    facet : on which the rock lies if it ends there, else -1
    """
    return RockTally(
        tally.path, tally.impacts, tally.meetings + 1, tally.pieces, tally.contacts + 1, tally.speed2,
        tally.ground_speed, facet if facet >= 0 else tally.facet, tally.idle,
    )  # fmt: skip


@kernel
def past(motion: Motion, number: int) -> int:
    """The obstacle that a rock has passed which left it with `motion`: none if it has been brought to rest there."""
    v = motion.v
    return NONE_PASSED if v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0 else number


@kernel
def with_ground(tally: RockTally, facet: int, speed: float) -> RockTally:
    """The tally when the rock enters sustained contact with a facet at some speed (m/s)."""
    first = speed if math.isnan(tally.ground_speed) else tally.ground_speed
    return RockTally(
        tally.path, tally.impacts, tally.meetings, tally.pieces, tally.contacts, tally.speed2, first, facet, tally.idle
    )  # fmt: skip


@kernel
def with_slide(tally: RockTally, length: float, motion: Motion, tolerance: float, bends: bool) -> RockTally:
    """The tally after a piece of a slide of some length (m) that ended with `motion`.

    Where the slide only bends it goes on: that is no contact, and no sign that the rock gets nowhere.
    """
    after = with_piece(tally, length, motion, tolerance)
    contacts, idle = tally.contacts + 1, after.idle
    if bends:
        contacts, idle = tally.contacts, min(tally.idle, after.idle)
    return RockTally(
        after.path, after.impacts, after.meetings, after.pieces, contacts, after.speed2, after.ground_speed,
        after.facet, idle,
    )  # fmt: skip
