"""Contacts of an arc with the terrain: what a locator returns, and what it must know of the contact before."""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc
from rpf3d_core.jit.dispatch import model_function
from rpf3d_core.terrain.facets import Facets


class Contact(NamedTuple):
    """Contact of an arc with a facet.

    t : s along the arc, inf if there is no contact; facet : number of the facet, -1 for none
    side : +1.0 if the arc meets the free side of the facet, -1.0 if it meets the back
    approach : speed into the facet (m/s); for a rock at rest, pull of gravity along the facet (m/s^2)
    """

    t: float
    facet: int
    side: float
    approach: float


class PreviousContact(NamedTuple):
    """The facets that a rock stands on, or left when its arc began, and the side of the ground that the rock is on.

    facet, other : the facet, and the second facet if both hold the rock in a gully; -1 for none
    side : +1.0 for the free side, -1.0 for the back
    resting : True if the rock slid there, so its speed along the normal is only rounding
    before : the facet that the rock slid off before `facet` without moving since, -1 if there is none
    """

    facet: int
    other: int
    side: float
    resting: bool
    before: int


GRAZING = 1e-9
"""Sine of the angle to a facet below which a sliding rock moves along it: a million times the rounding of b / |v|."""
NO_CONTACT = Contact(t=math.inf, facet=-1, side=1.0, approach=0.0)
NOTHING_LEFT = PreviousContact(facet=-1, other=-1, side=1.0, resting=False, before=-1)


@model_function
def first_contact(locator: object, facets: Facets, arc: Arc, left: PreviousContact, end: float) -> Contact:
    """Return the earliest contact of an arc before `end` (s), or NO_CONTACT; one rule per locator.

    A locator decides only which facets are tested and in what order. The result depends on neither.
    """


@model_function
def radius_of(locator: object) -> float:
    """Return the radius (m) of the body that a locator finds contacts of; 0 for a lumped mass."""


@radius_of.otherwise
def of_a_point(locator: object) -> float:
    """Return 0 m: a lumped mass has no radius."""
    return 0.0


@model_function
def plain_locator(locator: object) -> Any:
    """Return the locator for points that a locator uses."""


@plain_locator.otherwise
def plain_already(locator: object) -> Any:
    """Return the locator itself: it is a locator for points."""
    return locator
