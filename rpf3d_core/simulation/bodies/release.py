"""The release of a body: a body that overlaps the ground is lifted straight up until it is clear of the ground.

If the body is clear at none of the heights that are tried, its path ends at once as unresolved contact.
"""

from typing import Any, NamedTuple

from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion
from rpf3d_core.simulation.bodies.nearby import gather
from rpf3d_core.simulation.bodies.ride import NO_ROOM
from rpf3d_core.simulation.bodies.room import GAP, BodyRoom
from rpf3d_core.simulation.bodies.survey import look
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, Outcome

LIFTS, HALVES = 60, 20
"""Number of upward steps in the search for a clear position, and of halvings of the last step."""
STEP = 0.05
"""Height of an upward step, divided by the body's reach (-)."""
CLEAR = 1.5
"""Smallest distance of a released body from the ground, divided by the body's skin (-)."""
NEAR = 1.1
"""Distance from the body's centre within which facets are examined, divided by the body's reach (-)."""
NO, YES, CROWDED = 0, 1, 2
"""Results of a test of a position: a facet is too near; none is too near; the facets nearby do not fit into memory."""
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
    """Return the motion with its position moved to the height z (m)."""
    return BodyMotion(t=motion.t, x=(motion.x[0], motion.x[1], z), v=motion.v, q=motion.q, w=motion.w)


@routine
def _is_clear(body: Body, room: BodyRoom, locator: Any, facets: Facets, motion: BodyMotion, moved: float) -> int:
    """Test whether a body may be released at this position.

    Return YES if every facet is at least CLEAR times the skin away, NO if not, and CROWDED if the facets nearby do not
    fit into the working memory. The skin is the distance from the ground at which contact begins. The lists in `room`
    are overwritten.

    moved : number of the tried height, which is stored in the column MARK of `room.planes` in place of a path bound
    """
    if not gather(room, locator, facets, motion.x, NEAR * body.reach):
        return CROWDED
    for k in range(room.count[0]):
        look(body, room, facets, motion, k, moved)
        if room.planes[k, GAP] < CLEAR * body.skin:
            return NO
    return YES


@routine
def lifted(body: Body, room: BodyRoom, locator: Any, facets: Facets, motion: BodyMotion) -> Release:
    """Return the release of a body: where the source sets it, or lifted until it is just clear of the ground.

    The body is lifted by at most LIFTS - 1 steps of STEP times its reach, and then lowered within the last step until
    it is just clear. If the body is clear at none of the heights, it is released where the source sets it, with outcome
    UNRESOLVED_CONTACT.
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
