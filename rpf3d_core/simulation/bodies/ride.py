"""The state of one body between two events of its path, and functions for the state after simple events."""

from typing import Any, NamedTuple

from rpf3d_core.effects.hooks import Meeting
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.bodies.around import meet_obstacle
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion
from rpf3d_core.simulation.bodies.nearby import gather
from rpf3d_core.simulation.bodies.rest import LEANING, NOT_STOPPED, Rest, no_rest
from rpf3d_core.simulation.bodies.room import BodyRoom
from rpf3d_core.simulation.bodies.touch import BAND
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.simulation.record import Record
from rpf3d_core.simulation.state import RockTally
from rpf3d_core.values import MOVING, Outcome, Vec
from rpf3d_core.vectors import norm

MARGIN = 1.0
"""Distance from the sphere around the body up to which facets are listed, divided by the body's reach (-)."""
FIRST_STEP = 4e-3
"""Length (s) of the first step after an impact."""
BRISK = 0.5
"""Speed (m/s) of a body after a flight above which its time at rest begins again (`after_flight`)."""
NO_ROOM = -2
"""Value in place of an outcome if the facets near the body do not fit into the working memory."""
STOPPED = int(Outcome.STOPPED)


class Ride(NamedTuple):
    """The state of one body between two events.

    centre : (3,) m, position around which the nearby facets (`BodyRoom.facets`) were listed
    moved : path bound (m): no point of the body has moved farther than this since the release, along its path
    contacts : number of contacts, 0 in flight; h : length of the next step in contact (s)
    rest : times since which the body stands, is slow, or stays in one place; tally : running totals
    outcome : MOVING while the body moves
    why : number of the `Stop` reason, or NOT_STOPPED
    passed : number of the obstacle that the body has just met, which its next flight ignores; NONE_PASSED for none
    slip : m, on which slip friction depends (`kinetics.slippage`); None if no ground has slip friction
    """

    motion: BodyMotion
    centre: Vec
    moved: float
    contacts: int
    h: float
    rest: Rest
    tally: RockTally
    outcome: int
    why: int
    passed: int
    slip: Any


@kernel
def after_flight(ride: Ride, motion: BodyMotion, moved: float, tally: RockTally, outcome: int, passed: int) -> Ride:
    """Return the state of a body in flight, after a flight or after a meeting with an obstacle.

    ride : state before; motion, moved, tally, outcome, passed : values after, as in `Ride`

    If the body is faster than BRISK (m/s), its times of rest begin again (`no_rest`).
    """
    rest = ride.rest if norm(motion.v) <= BRISK else no_rest(motion)
    return Ride(
        motion=motion, centre=ride.centre, moved=moved, contacts=0, h=FIRST_STEP, rest=rest, tally=tally,
        outcome=outcome, why=NOT_STOPPED, passed=passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def in_contact(ride: Ride, motion: BodyMotion, count: int, tally: RockTally, passed: int) -> Ride:
    """Return the state of a body after a flight or an impact, with `count` contacts (0 in flight).

    ride : state before; motion, tally, passed : values after, as in `Ride`
    """
    return Ride(
        motion=motion, centre=ride.centre, moved=ride.moved, contacts=count, h=FIRST_STEP, rest=ride.rest,
        tally=tally, outcome=MOVING, why=NOT_STOPPED, passed=passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def ended(ride: Ride, outcome: int) -> Ride:
    """Return the state of a body whose path ends at its current position, with the given outcome."""
    return Ride(
        motion=ride.motion, centre=ride.centre, moved=ride.moved, contacts=ride.contacts, h=ride.h, rest=ride.rest,
        tally=ride.tally, outcome=outcome, why=ride.why, passed=ride.passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def margin_of(body: Body) -> float:
    """Return how far (m) the centre of a body may move before the facets nearby must be listed again."""
    return MARGIN * body.reach - BAND * body.skin


@kernel
def listed_around(body: Body, room: BodyRoom, locator: Any, physics: Physics, ride: Ride) -> Ride:
    """List the facets around a body in `room`; return the state after this, with outcome NO_ROOM if they do not fit."""
    fits = gather(room, locator, physics.facets, ride.motion.x, (1.0 + MARGIN) * body.reach)
    return Ride(
        motion=ride.motion, centre=ride.motion.x, moved=ride.moved, contacts=ride.contacts, h=ride.h, rest=ride.rest,
        tally=ride.tally, outcome=ride.outcome if fits else NO_ROOM, why=ride.why, passed=ride.passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def with_slip(ride: Ride, slip: Any) -> Ride:
    """Return the state of a body with another slip; slip : m, or None if no ground has slip friction."""
    return Ride(
        motion=ride.motion, centre=ride.centre, moved=ride.moved, contacts=ride.contacts, h=ride.h, rest=ride.rest,
        tally=ride.tally, outcome=ride.outcome, why=ride.why, passed=ride.passed, slip=slip,
    )  # fmt: skip


@kernel
def leaning(ride: Ride) -> Ride:
    """Return the state of a body that has stopped because it leans against an obstacle."""
    return Ride(
        motion=ride.motion, centre=ride.centre, moved=ride.moved, contacts=ride.contacts, h=ride.h, rest=ride.rest,
        tally=ride.tally, outcome=STOPPED, why=LEANING, passed=ride.passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def past_obstacle(
    body: Body, physics: Physics, ride: Ride, meeting: Meeting, rock: RockContext, record: Record
) -> Ride:  # fmt: skip
    """Return the state of a body after it meets an obstacle at its current position; the meeting is recorded."""
    met = meet_obstacle(physics.effects, body, ride.motion, ride.tally, meeting, rock, record)
    return after_flight(ride, met.motion, ride.moved, met.tally, met.outcome, met.passed)
