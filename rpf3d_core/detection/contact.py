"""Contacts of an arc with the terrain: the result of a locator, and the previous contact that a locator needs."""

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
    """The facets of the rock's last contact, where its arc begins, and the side of the ground that the rock is on.

    facet, other : the facet, and a second facet if both facets hold the rock in a gully; -1 for none
    side : +1.0 for the free side, -1.0 for the back
    resting : True if the rock was sliding there or at rest, so its speed along the normal is only rounding
    before : the facet that the rock left at the same place just before `facet`; -1 for none
    """

    facet: int
    other: int
    side: float
    resting: bool
    before: int


GRAZING = 1e-9
"""Sine of the angle between a rock's velocity and a facet, below which the rock moves along the facet.

A million times the rounding of b / |v|, where b is the speed along the normal and v is the velocity.
"""
NO_CONTACT = Contact(t=math.inf, facet=-1, side=1.0, approach=0.0)
NOTHING_LEFT = PreviousContact(facet=-1, other=-1, side=1.0, resting=False, before=-1)


@model_function
def first_contact(locator: object, facets: Facets, arc: Arc, left: PreviousContact, end: float) -> Contact:
    """Return the earliest contact of an arc before `end` (s), or NO_CONTACT; one rule per locator.

    A locator selects the facets to test, and their order. Every locator gives the same result.
    """


@model_function
def radius_of(locator: object) -> float:
    """Return the radius (m) of the rock whose contacts a locator finds; 0 for a lumped mass."""


@radius_of.otherwise
def of_a_point(locator: object) -> float:
    """Return 0 m: a lumped mass has no radius."""
    return 0.0


@model_function
def plain_locator(locator: object) -> Any:
    """Return the locator for lumped masses that a locator uses inside."""


@plain_locator.otherwise
def plain_already(locator: object) -> Any:
    """Return the locator unchanged: it is a locator for lumped masses."""
    return locator
