"""Find the next contact of a rock: search, search again with wider facets, and check for a fall through the ground.

A locator finds the first contact of an arc (`contact.py`). This module decides whether this contact is final. If there
is no contact, or if the rock meets a different side of the ground than at its last contact, the search runs again with
facets that are wider by a crack. If the rock may have fallen through the ground, lines of sight decide (`fallen.py`).
"""

import math
from typing import Any

from rpf3d_core.arc import Arc, fall_time
from rpf3d_core.detection.contact import LINE_OF_SIGHT, NO_ROCK, Contact, PreviousContact, first_contact
from rpf3d_core.detection.fallen import answered, inquiry, line_of_sight
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.terrain.facet_geometry import NEAR
from rpf3d_core.terrain.facets import CRACK, Facets

LAST_LOOK = 1.0 + 2.0**-40
"""Tolerance of the last search, for a rock that fell through the ground, in crack widths; just above 1.

The value is above 1 only to distinguish the last search from the second search.
"""
FALLEN = -2
"""Number in place of a facet: the rock has fallen through the ground."""


@model_function
def comes_behind(contact: object, left: PreviousContact) -> bool:
    """Return True if a rock meets a different side of the ground than at its last contact: it may have fallen through.

    Before the first contact, a contact with the back of a facet counts as a different side. The result is False for
    spheres, for lines of sight, and for a rock that bounces to and fro between two sheets of ground.

    contact : the contact that a search has found; left : the last contact
    """


@comes_behind.otherwise
def not_known_to(contact: object, left: PreviousContact) -> bool:
    """Return False: the contact of a sphere does not store which side of the ground the sphere touches."""
    return False


@comes_behind.rule(Contact)
def meets_the_other_side(contact: Contact, left: PreviousContact) -> bool:
    """Return True if a rock meets a different side of the ground than at its last contact.

    On ground without holes, such a rock has fallen through the ground. The result is False in two cases: for a line of
    sight, and for a rock that bounces to and fro between two sheets of ground.

    left : the last contact
    """
    to_and_fro = left.before >= 0 and not left.resting and contact.facet == left.before
    return left.facet != NO_ROCK and contact.side != left.side and not to_and_fro


@model_function
def notices_falls(locator: object) -> bool:
    """Return True if a search with this locator also checks whether a rock has fallen through the ground.

    The check concerns rocks that leave the terrain, or meet a different side of the ground than at their last contact.
    """


@notices_falls.otherwise
def takes_them_as_they_are(locator: object) -> bool:
    """Return False: with this locator, a search does not check whether a rock has fallen through the ground.

    Methods with fixed time steps exist to show such falls. Spheres are not checked, because their contacts do not store
    the side of the ground.
    """
    return False


@model_function
def sight(contact: object) -> tuple[float, float]:
    """Return where a line of sight meets a facet, as a share (0 to 1) of the line's length, and the side of the facet.

    A line of sight leads straight up or down, from a place at the rock's path to beyond the terrain. The check whether
    a rock has fallen through the ground (`fallen.py`) needs share and side. The share is inf if the line meets no
    facet. The side is +1.0 for the free side and -1.0 for the back.

    contact : the contact of the line with the facet; one rule for each class of contacts
    """


@sight.otherwise
def sees_nothing(contact: object) -> tuple[float, float]:
    """Return (inf, 1.0), which means that the line of sight meets no facet.

    The check whether a rock fell through the ground does not use contacts of spheres.
    """
    return math.inf, 1.0


@sight.rule(Contact)
def seen(contact: Contact) -> tuple[float, float]:
    """Return the contact of a line of sight, as a share (0 to 1) of the line's length, and the side of the facet.

    The share is the time of the contact, because an arc along a line of sight takes one second; inf for no contact.
    """
    return (contact.t if contact.t <= 1.0 else math.inf), contact.side


@model_function
def fall_of(contact: object) -> Any:
    """Return the contact by which a search reports that the rock has fallen through the ground.

    contact : the last contact that the search found; one rule for each class of contacts
    """


@fall_of.otherwise
def no_fall(contact: object) -> Any:
    """Return the contact of a sphere unchanged, because a sphere has no check for a fall through the ground."""
    return contact


@fall_of.rule(Contact)
def fall_of_point(contact: Contact) -> Contact:
    """Return a contact that reports the fall of a lumped mass through the ground: time inf, and the facet FALLEN."""
    return Contact(t=math.inf, facet=FALLEN, side=1.0, approach=0.0)


@model_function
def is_fall(contact: object) -> bool:
    """Return True if a contact reports that the rock has fallen through the ground, as made by `fall_of`."""


@is_fall.otherwise
def is_no_fall(contact: object) -> bool:
    """Return False: contacts of spheres never report that the rock has fallen through the ground."""
    return False


@is_fall.rule(Contact)
def is_marked(contact: Contact) -> bool:
    """Return True if the contact has FALLEN in place of the facet: the rock has fallen through the ground."""
    return contact.facet == FALLEN


@kernel
def contact_or_crack(
    locator: object, facets: Facets, arc: Arc, left: PreviousContact, end: float, longest: float
) -> Contact:
    """Return the earliest contact of an arc with the ground, if needed from a second search with wider facets.

    A gap wider than the tolerance may still be a crack and not a hole, such as the thin gap at a T-junction, where a
    vertex lies on an edge except for rounding. A rock may also have drifted by a few tolerances while it moved from
    facet to facet. The second search runs only if the first search finds no contact, or a contact on a different side
    of the ground than the last contact (`comes_behind`), so all other rocks meet the facets at their true size. In the
    second search the edge band of a facet is CRACK tolerances wide.

    If the rock would leave the terrain, or meet a different side of the ground, in the second search too, a check
    decides whether the rock has fallen through the ground (`fallen.py`). If it has fallen, the result reports the fall
    (`fall_of`). For a rock that was sliding, one more search runs before the fall is reported. In this last search, a
    facet at the rock's position counts as met if the rock moves into the facet. The fall is reported only if the last
    search finds no contact on the side of the ground where the rock was. Three cases are not checked: a line of sight,
    a flight segment that ends in mid-air without a contact, and a locator without checks (`notices_falls`).

    Without a contact up to the earlier of `end` and `longest`, the result is as in `first_contact`.

    left : the contact from which the rock starts
    end : s, when the arc leaves the box around the terrain; longest : s, when the flight segment ends in mid-air
    """
    until, flies_to = min(end, longest), math.inf
    looked, looks, line, stands, before = facets, 0, arc, left, until
    tolerance, asked = facets.tolerance, inquiry(facets, False)
    while True:  # a loop, so that the search is compiled once
        contact: Contact = first_contact(locator, looked, line, stands, before)
        if asked.open:
            share, side = sight(contact)
            asked = answered(arc, flies_to, asked, share * abs(line.v[2]), side)
            if asked.fell and not left.resting:
                return fall_of(contact)  # type: ignore[no-any-return]
            tolerance = LAST_LOOK * facets.crack if asked.fell else tolerance
        else:
            looks += 1
            lands, behind = contact.t <= until, comes_behind(contact, left)
            if looks > 2 or (lands and not behind):
                return fall_of(contact) if asked.fell and (behind or not lands) else contact
            if looks == 1:
                tolerance = facets.crack
            elif notices_falls(locator) and left.facet != NO_ROCK and (lands or end <= longest):
                asked, flies_to, looks = inquiry(facets, True), contact.t if lands else math.inf, 2
            else:
                return contact
        if asked.open:
            looked, line, stands, before = facets, line_of_sight(facets, arc, asked), LINE_OF_SIGHT, 1.0
        else:
            looked, line, stands, before = _with_tolerance(facets, tolerance), arc, left, until


@kernel
def _with_tolerance(facets: Facets, tolerance: float) -> Facets:
    """Return the facets with another contact tolerance (m): a larger tolerance makes facets wider for a search."""
    return Facets(
        geometry=facets.geometry,
        corners=facets.corners,
        normals=facets.normals,
        zone=facets.zone,
        low=facets.low,
        high=facets.high,
        tolerance=tolerance,
        crack=facets.crack,
    )


@kernel
def flight_end(facets: Facets, arc: Arc, radius: float) -> float:
    """Return the time (s) when an arc leaves the box around the terrain, sideways or downwards: a search can end there.

    radius : m, by which the box is wider for a sphere; 0 for a lumped mass

    Downwards the box is larger by NEAR x CRACK tolerances: a rock this far below the plane of a facet, at its start or
    when it passes the facet's edge, can still hit the facet.
    """
    slack = facets.tolerance
    end = fall_time(arc.v[2], max(arc.x[2] - facets.low[2] + NEAR * CRACK * slack + radius, 0.0), arc.gravity)
    wide = slack + radius
    for k in range(2):
        if arc.v[k] > 0.0:
            end = min(end, max((facets.high[k] + wide - arc.x[k]) / arc.v[k], 0.0))
        elif arc.v[k] < 0.0:
            end = min(end, max((facets.low[k] - wide - arc.x[k]) / arc.v[k], 0.0))
    return end
