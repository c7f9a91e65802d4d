"""Contacts of an arc with the terrain: the result of a locator, and the previous contact that a locator needs."""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc
from rpf3d_core.jit.dispatch import model_function
from rpf3d_core.terrain.facets import Facets


class Contact(NamedTuple):
    """The contact of a rock (lumped mass) on an arc with a facet: when, where and from which side.

    t : s along the arc, inf if there is no contact; facet : number of the facet, -1 for none
    side : +1.0 if the arc meets the free side of the facet, -1.0 if it meets the back
    approach : speed into the facet (m/s); for a rock at rest, pull of gravity along the facet (m/s^2)
    """

    t: float
    facet: int
    side: float
    approach: float


class PreviousContact(NamedTuple):
    """The facet from which a rock starts its arc, so that a search does not find the same contact again.

    facet, other : the facet of the last contact, and a second facet if the rock moves in a gully between both; -1 for
        none
    side : side of the ground on which the rock is, +1.0 for the free side of `facet`, -1.0 for its back
    resting : True if the rock was sliding or at rest on `facet`, so its speed along the normal is only rounding error
    before : the last facet before `facet`, set in two cases, else -1. First, the rock changes between two facets by
        sliding, without progress. Second, the rock bounces to and fro between two sheets of ground: it met `before` on
        the opposite side, for example the back of `before` and then the free side of `facet`
    """

    facet: int
    other: int
    side: float
    resting: bool
    before: int


GRAZING = 1e-9
"""Sine of the angle between a rock's velocity and a facet, below which the rock counts as moving along the facet.

This is a million times the rounding error of b / |v|, where b is the speed along the normal and v is the velocity.
"""
NO_CONTACT = Contact(t=math.inf, facet=-1, side=1.0, approach=0.0)
NOTHING_LEFT = PreviousContact(facet=-1, other=-1, side=1.0, resting=False, before=-1)
"""The previous contact of a rock at its release: no facet, but the rock is on the free side of the ground."""
NO_ROCK = -2
"""Number in place of the facet of the previous contact, if the arc is a line of sight and not the path of a rock."""
LINE_OF_SIGHT = PreviousContact(facet=NO_ROCK, other=-1, side=1.0, resting=False, before=-1)
"""The previous contact of a line of sight, which may start on either side of the ground."""


@model_function
def first_contact(locator: object, facets: Facets, arc: Arc, left: PreviousContact, end: float) -> Contact:
    """Return the earliest contact of an arc with the terrain up to the time `end` (s); one rule per locator.

    Without such a contact, the result is NO_CONTACT (NO_TOUCH for a sphere), or a contact later than `end`: the caller
    must compare its time with `end`. A locator selects the facets to test, and their order. All locators with an exact
    search give equal contacts up to `end`.

    left : the contact from which the rock starts
    """


@model_function
def radius_of(locator: object) -> float:
    """Return the radius (m) of the rock whose contacts a locator searches; 0 for a lumped mass."""


@radius_of.otherwise
def of_a_point(locator: object) -> float:
    """Return 0 (m), the radius for a locator that searches contacts of lumped masses."""
    return 0.0


@model_function
def plain_locator(locator: object) -> Any:
    """Return the part of a locator that searches exact contacts of lumped masses, for heights above the ground.

    Such a search ignores the radius of a sphere, and does not use fixed time steps.
    """


@plain_locator.otherwise
def plain_already(locator: object) -> Any:
    """Return the locator unchanged, because it is already a locator for lumped masses."""
    return locator
