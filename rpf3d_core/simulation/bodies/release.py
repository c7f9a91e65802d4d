"""The release of a body: lifted straight up until it is clear of the ground, or not released."""

from typing import Any, NamedTuple

from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion
from rpf3d_core.simulation.bodies.nearby import gather
from rpf3d_core.simulation.bodies.ride import NO_ROOM
from rpf3d_core.simulation.bodies.room import GAP, Room
from rpf3d_core.simulation.bodies.survey import look
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, Outcome

LIFTS, HALVES = 60, 20
"""Number of steps of the search for a clear place, and of halvings of the last step."""
STEP = 0.05
"""Height of a step, over the body's reach (-)."""
CLEAR = 1.5
"""Distance from the ground at the release, over the body's skin (-)."""
NEAR = 1.1
"""Distance from the centre within which facets are looked at, over the body's reach (-)."""
NO, YES, CROWDED = 0, 1, 2
"""Answers of the search: a facet is too near; the place is clear; the facets do not fit into the room."""
UNRESOLVED = int(Outcome.UNRESOLVED_CONTACT)


class Release(NamedTuple):
    """The motion of a body at its release, and its outcome.

    outcome : MOVING; NO_ROOM if the facets nearby do not fit into the working memory; UNRESOLVED_CONTACT if the body
        would touch the ground at the release and at every height above that was tried
    """

    motion: BodyMotion
    outcome: int


@kernel
def _at(motion: BodyMotion, z: float) -> BodyMotion:
    """Return a motion at another height (m)."""
    return BodyMotion(t=motion.t, x=(motion.x[0], motion.x[1], z), v=motion.v, q=motion.q, w=motion.w)


@routine
def _is_clear(body: Body, room: Room, locator: Any, facets: Facets, motion: BodyMotion, moved: float) -> int:
    """Return YES if no facet is nearer to the body than a released body should be, else NO; CROWDED without room."""
    if not gather(room, locator, facets, motion.x, NEAR * body.reach):
        return CROWDED
    for k in range(room.count[0]):
        look(body, room, facets, motion, k, moved)
        if room.planes[k, GAP] < CLEAR * body.skin:
            return NO
    return YES


@routine
def lifted(body: Body, room: Room, locator: Any, facets: Facets, motion: BodyMotion) -> Release:
    """Return the release of a body: where the source says, or above it, just clear of the ground.

    Where no place up to LIFTS steps above is clear, the body stays where it is with the outcome UNRESOLVED_CONTACT.
    """
    low, z, found = motion.x[2], motion.x[2], NO
    for i in range(LIFTS):
        found = _is_clear(body, room, locator, facets, _at(motion, z), float(i))
        if found != NO:
            break
        low, z = z, z + STEP * body.reach
    if found != YES:
        return Release(motion=motion, outcome=NO_ROOM if found == CROWDED else UNRESOLVED)
    if z == motion.x[2]:
        return Release(motion=motion, outcome=MOVING)
    high = z
    for i in range(HALVES):
        middle = 0.5 * (low + high)
        found = _is_clear(body, room, locator, facets, _at(motion, middle), float(i))
        if found == CROWDED:
            return Release(motion=motion, outcome=NO_ROOM)
        if found == YES:
            high = middle
        else:
            low = middle
    return Release(motion=_at(motion, high), outcome=MOVING)
