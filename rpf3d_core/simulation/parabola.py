"""The next parabola of a flight: it ends at a contact, an obstacle, a gap, the terrain's boundary or a time limit.

If an effect acts in the air, one parabola may replace the true flight only for a limited time (`effects.air_step`).
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc
from rpf3d_core.detection.caps import Loss, loss_on
from rpf3d_core.detection.contact import LINE_OF_SIGHT, Contact, plain_locator, radius_of
from rpf3d_core.detection.search import contact_or_crack, flight_end
from rpf3d_core.effects.hooks import Meeting, asks_height, first_obstacle, in_air, longest_flight
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.simulation.state import State
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Motion, Vec

AGAIN = 1.5
"""Planned duration of a repeated flight segment, divided by the duration of the first flight (-).

The ratio is above 1, because the repeated flight may take a little longer than the first flight.
"""


class FlightSegment(NamedTuple):
    """A parabola on which a rock flies for t seconds, and the events that may end it.

    start : motion at the beginning; longest : planned duration of the segment, for which the parabola may replace the
        flight through the air (s); inf if no effect acts in the air
    end : time when the parabola leaves the terrain's box, as in `flight_end` (s); left : time until max_time (s)
    contact, meeting, loss : first contact, first obstacle and first fall through a gap; none of them is earlier than t.
        If t is the time of one of them, this event ends the parabola
    """

    start: Motion
    t: float
    longest: float
    end: float
    left: float
    contact: Contact
    meeting: Meeting
    loss: Loss


@kernel
def next_parabola(physics: Physics, locator: Any, state: State, rock: RockContext) -> FlightSegment:
    """Return the parabola that a rock flies next, up to its first contact, obstacle or gap, or up to a time limit.

    Before the parabola, air drag acts for half of the segment's planned duration. If the flight ends in the first half
    of the segment, the drag has acted for longer than the flight lasts. Correcting this would add energy to the rock.
    Instead the flight is computed again, with a segment about as long as the flight.
    """
    facets, settings, effects, motion = physics.facets, physics.settings, physics.effects, state.motion
    height = height_for_effects(effects, plain_locator(locator), facets, motion.x)
    longest = longest_flight(effects, motion, rock)
    while True:  # a loop, so that the search is compiled once
        start = into_air(effects, motion, height, longest, rock)
        arc = Arc(x=start.x, v=start.v, gravity=settings.gravity)
        end, left = flight_end(facets, arc, radius_of(locator)), settings.max_time - start.t
        contact = contact_or_crack(locator, facets, arc, state.left, end, longest)
        t = min(contact.t, end, left, longest)
        loss = loss_on(physics.caps, arc, contact, t)
        t = min(t, loss.t)
        meeting = first_obstacle(effects, arc, state.passed, t, rock)
        t = min(t, meeting.t)
        if longest == math.inf or not t < 0.5 * longest:  # `checked` handles a time that is NaN
            return FlightSegment(
                start=start, t=t, longest=longest, end=end, left=left, contact=contact, meeting=meeting, loss=loss
            )
        longest = AGAIN * t


@kernel
def into_air(effects: Any, motion: Motion, height: float, longest: float, rock: RockContext) -> Motion:
    """Return the motion at the start of a flight segment, after the air has acted for half of the planned duration.

    height : of the rock above the ground, as in `in_air` (m)
    longest : planned duration of the segment (s); inf if no effect acts in the air

    The air acts only before and after a parabola (`effects.air_step`), so contacts are found as exactly as without air.
    """
    if longest == math.inf:
        return motion
    return in_air(effects, motion, height, 0.5 * longest, rock)  # type: ignore[no-any-return]


@kernel
def out_of_air(
    physics: Physics, locator: Any, motion: Motion, t: float, longest: float, rock: RockContext
) -> Motion:  # fmt: skip
    """Return the motion at the end of a flight segment, after the air has acted for the second part of the segment.

    The air has acted for longest / 2 before the parabola (`into_air`). Here it acts for t - longest / 2, so for t in
    total. If no effect acts in the air, the motion is returned unchanged.

    motion : at the end of the parabola; t : duration of the parabola (s), at least longest / 2
    longest : planned duration of the segment (s); inf if no effect acts in the air
    """
    if longest == math.inf:
        return motion
    height = height_for_effects(physics.effects, plain_locator(locator), physics.facets, motion.x)
    return in_air(physics.effects, motion, height, t - 0.5 * longest, rock)  # type: ignore[no-any-return]


@kernel
def height_for_effects(effects: Any, locator: Any, facets: Facets, x: Vec) -> float:
    """Return the height (m) of point x above the ground, for effects such as drag layers.

    The result is inf if no ground lies below x, as over a hole. If no effect needs the height, nothing is searched, and
    the result is 0.0.

    locator : contact search for lumped masses, also if the rock is a sphere or a body
    """
    if not asks_height(effects):
        return 0.0
    height, contact = ground_below(locator, facets, x)
    return height if contact.facet >= 0 else math.inf


@kernel
def ground_below(locator: Any, facets: Facets, x: Vec) -> tuple[float, Contact]:
    """Return the height (m) of point x above the terrain, and the contact straight below x.

    If no ground lies below x, as over a hole, the height is 0.0 and the facet of the contact is below 0. The search
    finds the first contact of a stone that falls from x with gravity 1 m/s^2.
    """
    drop = Arc(x=x, v=(0.0, 0.0, 0.0), gravity=1.0)
    contact = contact_or_crack(locator, facets, drop, LINE_OF_SIGHT, flight_end(facets, drop, 0.0), math.inf)
    return (0.5 * contact.t * contact.t if contact.t < math.inf else 0.0), contact
