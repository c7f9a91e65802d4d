"""The free flights of a body: to a contact, an obstacle, a gap of the terrain, its boundary, or the time limit."""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc, arc_length
from rpf3d_core.detection.caps import Loss, loss_on
from rpf3d_core.detection.contact import NO_CONTACT
from rpf3d_core.detection.search import flight_end
from rpf3d_core.detection.sphere_course import Course
from rpf3d_core.detection.swept import stretch_end, swept_contact
from rpf3d_core.effects.hooks import NO_MEETING, Meeting, first_obstacle, longest_flight
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.slippage import slip_in_air
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.bodies.around import braked, height_of
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion, FreeFlight, flight_of, motion_after
from rpf3d_core.simulation.bodies.notes import motion_of, note_segment
from rpf3d_core.simulation.bodies.ride import MARGIN, Ride, after_flight, ended, margin_of, past_obstacle, with_slip
from rpf3d_core.simulation.bodies.room import BodyRoom
from rpf3d_core.simulation.bodies.survey import first_meeting, travelled
from rpf3d_core.simulation.march import hovers
from rpf3d_core.simulation.parabola import AGAIN
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.simulation.record import Record
from rpf3d_core.simulation.state import RockTally, with_slide
from rpf3d_core.values import MOVING, Mode, Outcome
from rpf3d_core.vectors import norm, subtract

FLIGHT = int(Mode.FLIGHT)
LEFT_TERRAIN, MAX_TIME, MAX_IMPACTS = int(Outcome.LEFT_TERRAIN), int(Outcome.MAX_TIME), int(Outcome.MAX_IMPACTS)


class Path(NamedTuple):
    """A free flight of a body for t seconds, and the events that may end it.

    start, flight : motion at the beginning, and the free flight from there
    k : index in `BodyRoom.facets` of the facet with which contact begins at t, unless the body meets an obstacle
        before; -1 if no contact begins
    left : time until max_time (s); end : time until the body has left the terrain (s)
    longest : planned duration, for which one free flight may replace the flight through the air (s); inf if no effect
        acts in the air
    meeting, loss : first obstacle and first passage through a cap; neither is earlier than t
    """

    start: BodyMotion
    flight: FreeFlight
    t: float
    k: int
    left: float
    end: float
    longest: float
    meeting: Meeting
    loss: Loss


@kernel
def _free_flight(
    body: Body, room: BodyRoom, locator: Any, physics: Physics, ride: Ride, start: BodyMotion, longest: float
) -> Path:  # fmt: skip
    """Return the free flight that begins with the motion `start`, up to a contact or a cap.

    The flight also ends where the facets nearby must be listed again, where the body leaves the terrain, and at a time
    limit. Obstacles are not searched.

    ride : state of the body before the flight; longest : planned duration, as in `Path` (s)
    """
    facets, settings = physics.facets, physics.settings
    arc = Arc(x=start.x, v=start.v, gravity=settings.gravity)
    end, left = flight_end(facets, arc, body.reach), settings.max_time - start.t
    down = (0.0, 0.0, -settings.gravity)
    flight, most, k = flight_of(body, start, settings.gravity), min(end, left, longest), -1
    if room.count[0] == 0:
        wide = Course(x=start.x, v=start.v, a=down, radius=(1.0 + 0.5 * MARGIN) * body.reach, gravity=settings.gravity)
        t = min(swept_contact(locator, facets, wide, most).t, most)
    else:
        course = Course(x=start.x, v=start.v, a=down, radius=body.reach, gravity=settings.gravity)
        way = max(margin_of(body) - norm(subtract(start.x, ride.centre)), 0.0)
        met = first_meeting(body, room, facets, flight, stretch_end(course, 0.0, way, most), ride.moved)
        t, k = met.t, met.k
    loss = loss_on(physics.caps, arc, NO_CONTACT, t)
    if loss.t < t:
        t, k = loss.t, -1
    return Path(
        start=start, flight=flight, t=t, k=k, left=left, end=end, longest=longest, meeting=NO_MEETING, loss=loss
    )


@kernel
def _next_path(
    body: Body, room: BodyRoom, locator: Any, physics: Physics, ride: Ride, rock: RockContext
) -> Path:  # fmt: skip
    """Return the next free flight of a body, up to a contact, an obstacle or a cap, or to a limit of `Path`.

    Before the flight, the drag of half of the planned duration is applied; `fly_on` applies the rest afterwards. If the
    flight ends in the first half of the planned duration, this drag was too much, so the flight is computed again with
    a shorter planned duration, as in `parabola.next_parabola`.
    """
    effects, motion = physics.effects, ride.motion
    longest = longest_flight(effects, motion_of(motion), rock)
    height = height_of(physics, locator, motion)
    while True:
        start = braked(effects, motion, height, 0.5 * longest, rock)
        path = _free_flight(body, room, locator, physics, ride, start, longest)
        arc = Arc(x=start.x, v=start.v, gravity=physics.settings.gravity)
        meeting = first_obstacle(effects, arc, ride.passed, path.t, rock)
        t = min(path.t, meeting.t)
        if longest == math.inf or not 0.0 < t < 0.5 * longest:  # a repeated flight of no time would change nothing
            return Path(
                start=start, flight=path.flight, t=t, k=path.k, left=path.left, end=path.end, longest=longest,
                meeting=meeting, loss=path.loss,
            )  # fmt: skip
        longest = AGAIN * t


@kernel
def fly_on(
    body: Body, room: BodyRoom, locator: Any, physics: Physics, ride: Ride, rock: RockContext, record: Record
) -> tuple[Ride, bool]:  # fmt: skip
    """Return the state of a body after its next free flight, and True if the flight ends with contact.

    Without contact, either the path has ended, as the outcome states, or another free flight follows. Before this
    flight, the facets nearby may have to be listed again.

    record : receives the flight as a path segment, and a meeting with an obstacle
    """
    effects, facets = physics.effects, physics.facets
    path = _next_path(body, room, locator, physics, ride, rock)
    start, t, k = path.start, path.t, path.k
    after, moved = motion_after(path.flight, t), ride.moved + travelled(body, path.flight, t)
    if t > 0.0:
        note_segment(record, ride.tally, body, start, after, FLIGHT)
    arc = Arc(x=start.x, v=start.v, gravity=physics.settings.gravity)
    if path.longest < math.inf:
        height = height_of(physics, locator, after)
        after = braked(effects, after, height, t - 0.5 * path.longest, rock) if t > 0.0 else ride.motion
    tally = _with_flight(ride.tally, arc, t, after, facets.tolerance)
    flown = _slipped(after_flight(ride, after, moved, tally, MOVING, ride.passed), physics, t)
    if path.meeting.t <= t:
        return past_obstacle(body, physics, flown, path.meeting, rock, record), False
    if path.loss.t <= t:
        return ended(flown, path.loss.outcome), False
    if k >= 0:
        return flown, True
    if t >= path.left:
        return ended(flown, MAX_TIME), False
    if t >= path.end:
        return ended(flown, LEFT_TERRAIN), False
    if t >= path.longest and hovers(physics.settings.max_impacts, tally):
        return ended(flown, MAX_IMPACTS), False
    return flown, False


@kernel
def _slipped(ride: Ride, physics: Physics, t: float) -> Ride:
    """Return the state of a body with the slip (m) that is left after t seconds of flight.

    The slip decays at the rate of the zone of the last contact. If no ground has slip friction, the state is unchanged.

    ride : state at the end of the flight
    """
    if physics.rebound.slip is None:
        return ride
    zone = physics.facets.zone[max(ride.tally.facet, 0)]
    slip = slip_in_air(physics.rebound.slip, ride.slip, zone, t)
    return with_slip(ride, slip)


@kernel
def _with_flight(tally: RockTally, arc: Arc, t: float, after: BodyMotion, tolerance: float) -> RockTally:
    """Return the running totals after a flight of t seconds; they are unchanged if t is 0.

    arc : path of the centre; after : motion at the end
    tolerance : m; a flight longer than this sets the number of path segments without progress to 0
    """
    if not t > 0.0:
        return tally
    return with_slide(tally, arc_length(arc, t), motion_of(after), tolerance, True)
