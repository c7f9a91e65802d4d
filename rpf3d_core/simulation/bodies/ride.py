"""The state of one body between two events of its path, and functions for the state after simple events."""

from typing import Any, NamedTuple

from rpf3d_core.effects.hooks import Meeting
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.bodies.around import meet_obstacle
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion
from rpf3d_core.simulation.bodies.nearby import gather
from rpf3d_core.simulation.bodies.rest import LEANING, NOT_STOPPED, Rest, no_rest
from rpf3d_core.simulation.bodies.room import Room
from rpf3d_core.simulation.bodies.touch import BAND
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.simulation.record import Record
from rpf3d_core.simulation.state import RockTally
from rpf3d_core.values import MOVING, Outcome, Vec
from rpf3d_core.vectors import norm

MARGIN = 1.0
"""Distance beyond the body's sphere up to which facets are listed, over the body's reach (-)."""
FIRST_STEP = 4e-3
"""Length (s) of the first step after an impact."""
BRISK = 0.5
"""Speed (m/s) after a flight above which a body is not at rest, however slow it was before."""
NO_ROOM = -2
"""Value in place of an outcome if the facets near the body do not fit into the room."""
STOPPED = int(Outcome.STOPPED)


class Ride(NamedTuple):
    """The state of one body between two events.

    centre : place (m) around which the facets in the room were listed; moved : path bound (m) since the release
    contacts : number of contacts, 0 in flight; h : length of the next step in contact (s)
    rest : since when the body has been at rest; why : the `Stop` reason, or NOT_STOPPED
    passed : as in `simulation.state.State`; slip : m, as in `kinetics.slippage`, None without slip friction
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
    """Return the state after a flight; a body that has become fast is not at rest."""
    rest = ride.rest if norm(motion.v) <= BRISK else no_rest(motion)
    return Ride(
        motion=motion, centre=ride.centre, moved=moved, contacts=0, h=FIRST_STEP, rest=rest, tally=tally,
        outcome=outcome, why=NOT_STOPPED, passed=passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def in_contact(ride: Ride, motion: BodyMotion, count: int, tally: RockTally, passed: int) -> Ride:
    """Return the state at the beginning of contact."""
    return Ride(
        motion=motion, centre=ride.centre, moved=ride.moved, contacts=count, h=FIRST_STEP, rest=ride.rest,
        tally=tally, outcome=MOVING, why=NOT_STOPPED, passed=passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def ended(ride: Ride, outcome: int) -> Ride:
    """Return the state of a body whose path ends where it is."""
    return Ride(
        motion=ride.motion, centre=ride.centre, moved=ride.moved, contacts=ride.contacts, h=ride.h, rest=ride.rest,
        tally=ride.tally, outcome=outcome, why=ride.why, passed=ride.passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def margin_of(body: Body) -> float:
    """Return how far (m) the centre may move before the facets nearby must be listed again."""
    return MARGIN * body.reach - BAND * body.skin


@kernel
def listed_around(body: Body, room: Room, locator: Any, physics: Physics, ride: Ride) -> Ride:
    """List the facets around the body, and return the state with the new centre; outcome NO_ROOM if they do not fit."""
    fits = gather(room, locator, physics.facets, ride.motion.x, (1.0 + MARGIN) * body.reach)
    return Ride(
        motion=ride.motion, centre=ride.motion.x, moved=ride.moved, contacts=ride.contacts, h=ride.h, rest=ride.rest,
        tally=ride.tally, outcome=ride.outcome if fits else NO_ROOM, why=ride.why, passed=ride.passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def with_slip(ride: Ride, slip: Any) -> Ride:
    """Return the state with another slip (m)."""
    return Ride(
        motion=ride.motion, centre=ride.centre, moved=ride.moved, contacts=ride.contacts, h=ride.h, rest=ride.rest,
        tally=ride.tally, outcome=ride.outcome, why=ride.why, passed=ride.passed, slip=slip,
    )  # fmt: skip


@kernel
def leaning(ride: Ride) -> Ride:
    """Return the state of a body that has stopped against an obstacle."""
    return Ride(
        motion=ride.motion, centre=ride.centre, moved=ride.moved, contacts=ride.contacts, h=ride.h, rest=ride.rest,
        tally=ride.tally, outcome=STOPPED, why=LEANING, passed=ride.passed, slip=ride.slip,
    )  # fmt: skip


@kernel
def past_obstacle(
    body: Body, physics: Physics, ride: Ride, meeting: Meeting, rock: RockContext, record: Record
) -> Ride:  # fmt: skip
    """Return the state of a body that meets an obstacle where it is."""
    met = meet_obstacle(physics.effects, body, ride.motion, ride.tally, meeting, rock, record)
    return after_flight(ride, met.motion, ride.moved, met.tally, met.outcome, met.passed)
