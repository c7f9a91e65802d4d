"""Working memory (room) for the flight of a body: facets nearby and contacts; allocated once for many rocks."""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.body.contacts import CONTACT_COLUMNS, SOLVER_COLUMNS

CONTACTS = 48
"""Largest number of contacts of a body at one time."""
FEWEST_FACETS = 256
"""Number of facets near a body for which memory is allocated at first."""
POLYGON = 64
"""Largest number of corners of a contact polygon."""

GAP, NORMAL, OFFSET, UNTIL, MARK, GUESS, NEAREST, ACTIVE, EXPECTED, BEGUN = 0, 1, 4, 5, 6, 7, 10, 13, 14, 15
"""First columns of the values in a row of `BodyRoom.planes`: the results of the last examination of a facet.

GAP : distance between body and facet, or a lower bound of it (m)
NORMAL : unit normal of the separating plane, from the facet to the body, in the axes of space
OFFSET : NORMAL . p (m), p the point of the facet nearest to the body: the body lies on the side NORMAL . y > OFFSET
UNTIL : time from the start of the flight (s) up to which the facet need not be examined again
MARK : path bound of the body at the last examination, as in `Ride` (m); GUESS : NORMAL in the body's axes
NEAREST : point of the body nearest to the facet, in the body's axes (m); ACTIVE : AWAY, TOUCHED or COVERED
EXPECTED : gap (m) at the end of a step, as predicted from the impulses
BEGUN : GAP, GUESS and NEAREST at the start of the step, in seven columns
"""
PLANE_COLUMNS = 22
AWAY, TOUCHED, COVERED = 0.0, 1.0, 2.0
"""States of a facet nearby.

AWAY : outside the band of contact; TOUCHED : within the band; COVERED : within the band, but the nearest point is on a
border of the facet that another facet covers (`touch.mark_covered`)
"""
UNKNOWN = -1.0
"""Value of the gap of a facet that has not been examined."""


class BodyRoom(NamedTuple):
    """Working memory for F facets near a body and K contacts.

    facets : (F,) numbers of the facets nearby, ascending
    count : (1,) number of facets nearby, above F if they do not fit
    planes : (F, PLANE_COLUMNS) results of the last examination of each facet
    points, later : (K, CONTACT_COLUMNS) current contacts, and contacts at the end of a step
    rows : (K, SOLVER_COLUMNS) memory of the solver of impacts
    polygon, clipped : (POLYGON, 4) corners of a contact polygon and their gaps (m)
    arms : (4, N) the body's corners and their distances from the centre of mass (m), from `clearance.set_arms`
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


def room_for(facets: int, corners: int) -> BodyRoom:
    """Return working memory for bodies with up to `facets` facets nearby and up to `corners` corners."""
    return BodyRoom(
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
