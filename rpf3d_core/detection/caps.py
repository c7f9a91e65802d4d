"""Detect rocks that fall through a gap of the terrain; triangles called caps close each gap (`terrain/gaps.py`).

Caps are separate facets with their own locator, so the search for contacts with the ground ignores them. An engine for
a terrain without gaps has None in place of caps, and compiles nothing of this file.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import Arc, time_over
from rpf3d_core.detection.contact import NO_CONTACT, NOTHING_LEFT, Contact, first_contact
from rpf3d_core.detection.fallen import STRAIGHT
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import CRACK, Facets
from rpf3d_core.values import Vec

ON_GROUND = REACH / CRACK
"""Path of a rock behind a cap, in tolerances of the caps, up to which a contact with the ground takes precedence.

So the ground still carries a rock at the edge of a hole.
"""


class CapFacets(NamedTuple):
    """The caps that close the gaps of a terrain, as facets: a path that passes through a cap ends there.

    facets : the caps; their `zone` is not a zone, but the outcome of a rock that passes through; their tolerance is
        CRACK times the tolerance of the terrain, so that no rock passes between a cap and the ground
    layered : True if ground lies above other ground, so that a rock below the upper ground may still hit the free side
        of the lower ground (`terrain.gaps`)
    """

    facets: Facets
    layered: bool


class CapLocator(NamedTuple):
    """The caps with the locator that finds passages of rocks through them.

    facets : the caps; layered : True if ground lies above other ground; both as in `CapFacets`
    """

    locator: Any
    facets: Facets
    layered: bool


class Loss(NamedTuple):
    """The fall of a rock through a gap: time t (s) from the start of an arc, and outcome; inf and -1 for no fall."""

    t: float
    outcome: int


NO_LOSS = Loss(math.inf, -1)


@model_function
def is_on_free_side(contact: object) -> bool:
    """Return True if a contact is with the free side of the ground: the rock then cannot have fallen through a gap."""


@is_on_free_side.otherwise
def is_not_known(contact: object) -> bool:
    """Return False: the contact of a sphere does not store which side of the ground the sphere touches."""
    return False


@is_on_free_side.rule(Contact)
def is_on_free_side_of_facet(contact: Contact) -> bool:
    """Return True if a lumped mass meets the free side of the facet, the side that faces the air."""
    return contact.side > 0.0


@model_function
def loss_on(caps: object, arc: Arc, contact: Any, end: float) -> Loss:
    """Return the first passage of an arc through a cap from above, up to the time `end` (s); NO_LOSS if there is none.

    Such a passage means that a rock falls through a gap of the terrain. One rule is for terrains with caps, another
    rule for terrains without caps.

    caps : a `CapLocator`, or None if the terrain has no gap
    contact : the first contact with the ground

    Caps and ground form one closed surface. So a rock that meets the free side of the ground has not fallen below the
    ground, unless the terrain is layered. If the rock meets the ground on the first ON_GROUND tolerances of its path
    behind a cap, the contact with the ground takes precedence: a rock on the edge of a hole is still on the ground.
    """


@loss_on.otherwise
def no_loss(caps: object, arc: Arc, contact: Any, end: float) -> Loss:
    """Return NO_LOSS: the terrain has no gap, so no rock falls through one; the arguments are not used."""
    return NO_LOSS


@loss_on.rule(CapLocator)
def loss_through_cap(caps: CapLocator, arc: Arc, contact: Any, end: float) -> Loss:
    """Return the first passage of an arc through a cap of a terrain with gaps; NO_LOSS if no rock falls through.

    contact : the first contact with the ground, which may take precedence; end : s, later passages do not count
    """
    if contact.t <= end and not caps.layered and is_on_free_side(contact):
        return NO_LOSS
    crossing = first_contact(caps.locator, caps.facets, arc, NOTHING_LEFT, end)
    if crossing.side < 0.0 or not crossing.t <= end:
        return NO_LOSS
    if contact.t <= time_over(arc, crossing.t, ON_GROUND * caps.facets.tolerance):
        return NO_LOSS
    outcome: Any = np.int64(caps.facets.zone[crossing.facet])  # 64 bits, as in other states
    return Loss(crossing.t, outcome)


@kernel
def loss_on_way(caps: Any, x: Vec, way: Vec) -> Loss:
    """Return the first passage of a rock on the ground through a cap, on a straight path from x (3,) m.

    `Loss.t` is here the share of the path up to the cap (-).

    way : (3,) m, from the start to the end of the path
    caps : a `CapLocator`, or None if the terrain has no gap
    """
    return loss_on(caps, Arc(x=x, v=way, gravity=STRAIGHT), NO_CONTACT, 1.0)  # type: ignore[no-any-return]
