"""Scratch memory for the flight of one body: the facets nearby and the contacts; allocated once for many rocks."""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.body.contacts import CONTACT_COLUMNS, SOLVER_COLUMNS

CONTACTS = 48
"""Largest number of contacts at a time."""
FEWEST_FACETS = 256
"""Number of facets near a body for which there is room at first."""
POLYGON = 64
"""Largest number of corners of a contact polygon."""

GAP, NORMAL, OFFSET, UNTIL, MARK, GUESS, NEAREST, ACTIVE, EXPECTED, BEGUN = 0, 1, 4, 5, 6, 7, 10, 13, 14, 15
"""Columns of `planes`, the last look at each facet nearby.

GAP : distance of body and facet, or a lower bound of it (m); NORMAL : unit, from the facet to the body, in space
OFFSET : NORMAL times the nearest point of the facet (m): the body lies on the side NORMAL . y > OFFSET
UNTIL : time from the start of the flight (s) before which the facet need not be looked at
MARK : path bound of the body at the last look (m); GUESS : the normal in the body's axes
NEAREST : the body's nearest point, in its axes (m); ACTIVE : AWAY, TOUCHED or COVERED
EXPECTED : gap (m) that the solution of a step leads to; BEGUN : GAP, GUESS and NEAREST at the start of the step
"""
PLANE_COLUMNS = 22
AWAY, TOUCHED, COVERED = 0.0, 1.0, 2.0
"""Whether a facet is within the band of contact, and whether its nearest point lies on a border that another covers."""
UNKNOWN = -1.0
"""Gap of a facet that has not been looked at."""


class Room(NamedTuple):
    """Scratch memory: F facets, K contacts.

    facets : (F,) numbers of the facets nearby, ascending; count : (1,) how many, more than F if they do not fit
    planes : (F, PLANE_COLUMNS) the last look at each of them
    points, later : (K, CONTACT_COLUMNS) contacts now, and at the end of a step; rows : (K, SOLVER_COLUMNS)
    polygon, clipped : (POLYGON, 4) corners of a contact polygon and their gaps (m)
    arms : (4, N) the body's corners and their distances from the centre of mass (m), `clearance.set_arms`
    """

    facets: Any
    count: Any
    planes: Any
    points: Any
    later: Any
    rows: Any
    polygon: Any
    clipped: Any
    arms: Any


def room_for(facets: int, corners: int) -> Room:
    """Return scratch memory for given numbers of facets near a body and of corners of a body."""
    return Room(
        facets=np.zeros(facets, dtype=np.int64),
        count=np.zeros(1, dtype=np.int64),
        planes=np.zeros((facets, PLANE_COLUMNS)),
        points=np.zeros((CONTACTS, CONTACT_COLUMNS)),
        later=np.zeros((CONTACTS, CONTACT_COLUMNS)),
        rows=np.zeros((CONTACTS, SOLVER_COLUMNS)),
        polygon=np.zeros((POLYGON, 4)),
        clipped=np.zeros((POLYGON, 4)),
        arms=np.zeros((4, corners)),
    )
