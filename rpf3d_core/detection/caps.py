"""Detect rocks that fall through a gap of the terrain; triangles called caps close each gap (`terrain/gaps.py`).

Caps are separate facets with their own locator, so the search for contacts with the ground ignores them. In a run, the
engine for a terrain without gaps has None in place of caps, and compiles nothing of this file. The live simulator
always uses caps: a terrain without gaps has dummy caps, which no rock can touch.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import Arc, position, time_over, velocity
from rpf3d_core.detection.cap_neighbours import NO_CAP
from rpf3d_core.detection.contact import NO_CONTACT, NOTHING_LEFT, Contact, PreviousContact, first_contact
from rpf3d_core.detection.fallen import STRAIGHT
from rpf3d_core.detection.stretch import left_of
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.terrain.facet_geometry import NEAR, REACH, contains, corner, is_at_box, stored_normal
from rpf3d_core.terrain.facets import CRACK, Facets
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, cross, dot, norm, subtract

ON_GROUND = REACH / CRACK
"""Length of a rock's path behind a cap, in tolerances of the caps, up to which a ground contact takes precedence.

So the ground still carries a rock at the edge of a hole.
"""
ON_RIM = NEAR / CRACK
"""Distance in plan from a cap, in tolerances of the caps, up to which a rock counts as over the cap.

This is the distance from a facet up to which a rock counts as on the facet.
"""


class CapLayout(NamedTuple):
    """How the T caps of a terrain lie: which of them close the same gap.

    neighbours : (3 T,) number of the cap beyond each side of each cap, or NO_CAP (`cap_neighbours.py`)
    ring : (T,) number of the hole in a steep slope that each cap closes; each cap of an outer wall has a number of its
        own; -1 for a cap over a gap that has an area in plan
    layered : True if ground lies above other ground, so that a rock below the upper ground may still hit the free side
        of the lower ground (`terrain.gaps`)
    """

    neighbours: Any
    ring: Any
    layered: bool


class CapFacets(NamedTuple):
    """The caps that close the gaps of a terrain, as facets: a path that passes through a cap ends there.

    facets : the caps; their `zone` is not a zone, but the outcome of a rock that passes through; their tolerance is
        CRACK times the tolerance of the terrain, so that no rock passes between a cap and the ground
    layout : which of the caps close the same gap
    """

    facets: Facets
    layout: CapLayout


class CapLocator(NamedTuple):
    """Caps (triangles that close gaps of a terrain), and the locator that finds passages of rocks through them.

    facets, layout : as in `CapFacets`
    """

    locator: Any
    facets: Facets
    layout: CapLayout


class Loss(NamedTuple):
    """The fall of a rock through a gap: time t (s) from the start of an arc, and outcome; inf and -1 for no fall."""

    t: float
    outcome: int


NO_LOSS = Loss(math.inf, -1)


@model_function
def is_on_free_side(contact: object) -> bool:
    """Return True if a contact is known to be with the free side of the ground, the side that faces the air."""


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
    """Return the first fall of a rock on an arc through a gap, up to the time `end` (s); NO_LOSS if there is none.

    One rule is for terrains with caps, another rule for terrains without caps.

    caps : a `CapLocator`, or None if the terrain has no gap
    contact : the first contact with the ground

    A rock falls through a gap where it passes through a cap from above, unless it comes back through caps of the same
    gap before it passes below the ground. Only the rim of a gap is known. The cap between is an arbitrary surface, and
    a rock that passes below the cap may have stayed in the air of the gap.

    Caps and ground form one closed surface. So a rock that meets the free side of the ground is above the ground,
    unless the terrain is layered. The rock may have been below the ground before, if it has left the ground through
    another gap. If the rock meets the ground on the first ON_GROUND tolerances of its path behind a cap, the contact
    with the ground takes precedence: a rock on the edge of a hole is still on the ground.
    """


@loss_on.otherwise
def no_loss(caps: object, arc: Arc, contact: Any, end: float) -> Loss:
    """Return NO_LOSS: the terrain has no gap, so no rock falls through one; the arguments are not used."""
    return NO_LOSS


@loss_on.rule(CapLocator)
def loss_through_cap(caps: CapLocator, arc: Arc, contact: Any, end: float) -> Loss:
    """Return the first fall of a rock on an arc through a cap; NO_LOSS if the rock falls through no gap.

    contact : the first contact with the ground, which may take precedence; end : s, later passages do not count

    The function follows the arc from cap to cap. A passage at the rim counts only if the rock is then behind a cap
    (`_cap_beyond`). An arc passes through each cap at most twice, so the loop ends even if rounding finds the same two
    caps again and again.

    A rock that meets the free side of the ground has nearly always passed upwards through as many caps as downwards. If
    not, the rock may have come out of the ground exactly through an edge between two facets, without a contact. But the
    rock may also have passed only through the rim of a cap, because caps are wider than their gap by a crack.
    """
    lands = contact.t <= end and not caps.layout.layered and is_on_free_side(contact)
    below, began, left, rest = NO_CONTACT, 0.0, NOTHING_LEFT, arc
    for _ in range(2 * len(caps.layout.ring)):
        crossing = first_contact(caps.locator, caps.facets, rest, left, end - began)
        if not crossing.t <= end - began:
            break
        t, side = began + crossing.t, crossing.side
        if side > 0.0:
            if below.facet >= 0 and not lands:
                break
            later = time_over(arc, t, ON_GROUND * caps.facets.tolerance)
            beyond = _cap_beyond(caps, crossing.facet, position(arc, later))
            if beyond == NO_CAP:  # the rock passed over the rim only, and goes on in front of the cap
                t, side = later, -1.0
            else:
                below = Contact(t=t, facet=beyond, side=side, approach=crossing.approach)
        elif below.facet >= 0:
            if passes_below_ground(caps, below.facet, crossing.facet, position(arc, below.t), position(arc, t)):
                return _loss_at(caps, arc, below, contact)
            below = NO_CONTACT
        began, rest = t, Arc(x=position(arc, t), v=velocity(arc, t), gravity=arc.gravity)
        left = PreviousContact(facet=crossing.facet, other=-1, side=-side, resting=False, before=-1)
    if below.facet < 0:
        return NO_LOSS
    if lands and not passes_below_ground(caps, below.facet, NO_CAP, position(arc, below.t), position(arc, contact.t)):
        return NO_LOSS
    return _loss_at(caps, arc, below, contact)


@kernel
def _loss_at(caps: CapLocator, arc: Arc, below: Contact, contact: Any) -> Loss:
    """Return the fall of a rock through a cap; NO_LOSS if its contact with the ground takes precedence.

    below : passage of the arc through the cap; contact : the first contact with the ground
    """
    if contact.t <= time_over(arc, below.t, ON_GROUND * caps.facets.tolerance):
        return NO_LOSS
    outcome: Any = np.int64(caps.facets.zone[below.facet])  # 64 bits, as in other states
    return Loss(below.t, outcome)


@kernel
def _cap_beyond(caps: CapLocator, f: int, q: Vec) -> int:
    """Return the cap over which the way of a rock leads that passes through cap f; NO_CAP if it leads over the ground.

    The result is nearly always f. A rock that is released exactly on a corner of a gap passes through a cap there, even
    if it then moves away over the ground. Several caps may meet at the corner, of one gap or of several, so cap f alone
    does not decide. A rock that falls straight down on the rim is in the gap. At an outer wall, and at a hole in a
    steep slope, where the ground may overhang, every passage counts.

    q : (3,) m, place of the rock, on its path at most ON_GROUND tolerances after its passage through cap f
    """
    if caps.layout.ring[f] >= 0 or _lies_behind(caps, f, q):
        return f
    for g in range(len(caps.layout.ring)):
        if _lies_behind(caps, g, q):
            return g
    return NO_CAP


@kernel
def _lies_behind(caps: CapLocator, f: int, q: Vec) -> bool:
    """Return True if place q (m) lies behind cap f: at most 2 ON_GROUND tolerances behind it, or 1 in front of it.

    The cap must contain the place in plan, except for ON_RIM tolerances; so a way that leads away over the ground by
    less than 0.3 degrees from the rim counts as a way over the cap. The cap of a hole in a steep slope may contain the
    place in its own plane instead: where the ground overhangs, only one of the two shows that a rock is behind the cap.
    In its own plane, the place may be as far outside the cap as it is behind it, because the next cap lies in another
    plane.

    A cap without an area contains no place.
    """
    facets, n = caps.facets, stored_normal(caps.facets, f)
    deepest = 2.0 * ON_GROUND * facets.tolerance
    height = dot(n, subtract(q, corner(facets, f, 0)))
    if norm(n) == 0.0 or not -deepest <= height <= facets.tolerance or not is_at_box(facets, f, q, deepest):
        return False
    if caps.layout.ring[f] >= 0 and contains(facets, f, q, False, facets.tolerance + abs(height)):
        return True
    for k in range(3):
        begin = corner(facets, f, k)
        edge = subtract(corner(facets, f, (k + 1) % 3), begin)
        slack = ON_RIM * facets.tolerance * math.sqrt(edge[0] * edge[0] + edge[1] * edge[1])
        if left_of(edge, begin, q) < -slack:
            return False
    return True


@kernel
def passes_below_ground(caps: CapLocator, f: int, g: int, p: Vec, q: Vec) -> bool:
    """Return True if a rock passes below the ground between p, where it falls through cap f, and q, above the ground.

    In plan the path of a rock is straight. So the rock has stayed in the air of a gap if the straight way in plan leads
    over caps only, from neighbour to neighbour. For a hole in a steep slope, which has hardly any area in plan, the way
    is straight in the plane of the hole, and it is enough that the rock lands without coming back through a cap.

    If the way leaves the gap in the first ON_GROUND tolerances, the rock has not been in this gap. It was only on the
    rim, for example at a vertex that two gaps have in common.

    g : the cap through which the rock comes back; NO_CAP for a rock that lands at q without coming back through a cap
    p, q : (3,) m
    """
    if g == NO_CAP and caps.layout.ring[f] >= 0:
        return False
    if g != NO_CAP and caps.layout.ring[f] != caps.layout.ring[g]:
        return True
    near = ON_GROUND * caps.facets.tolerance
    return near < _way_over_gap(caps, f, g, p, q) < math.inf


@kernel
def _way_over_gap(caps: CapLocator, f: int, g: int, p: Vec, q: Vec) -> float:
    """Return the length (m) of the straight way from p to q until it leaves the gap that cap f closes.

    The way is straight as seen in plan or, for a hole in a steep slope, at right angles to the plane of the hole. It
    leads from cap to neighbouring cap. The result is inf if the way ends in the gap, or reaches cap g.

    g : NO_CAP to follow the way up to q; p : (3,) m, on cap f; q : (3,) m
    """
    cap: Any = f
    n = _facing(caps, f)
    for _ in range(len(caps.layout.ring)):
        if cap == g:
            return math.inf
        side, share = _side_left(caps.facets, cap, n, p, q)
        if side < 0:
            return math.inf
        beyond: Any = np.int64(caps.layout.neighbours[3 * cap + side])
        if beyond == NO_CAP:
            return share * norm(subtract(q, p))
        cap = beyond
    return norm(subtract(q, p))


@kernel
def _facing(caps: CapLocator, f: int) -> Vec:
    """Return the direction (3,) in which a gap is closed: up, or the normal of the hole in a steep slope.

    f : one of the caps that close the gap
    """
    if caps.layout.ring[f] < 0:
        return (0.0, 0.0, 1.0)
    n = ZERO
    for g in range(len(caps.layout.ring)):
        if caps.layout.ring[g] == caps.layout.ring[f]:
            a, b, c = corner(caps.facets, g, 0), corner(caps.facets, g, 1), corner(caps.facets, g, 2)
            n = add(n, cross(subtract(b, a), subtract(c, a)))
    return n


@kernel
def _side_left(facets: Facets, f: int, n: Vec, p: Vec, q: Vec) -> tuple[int, float]:
    """Return the side (0, 1, 2) over which a straight way from p to q leaves facet f; -1 if it ends in facet f.

    Also return the share (0 to 1) of the way up to this side; inf if the way ends in facet f.

    n : (3,) of any length, direction from which the way is seen, on the free side of the facet
    p, q : (3,) m, p in facet f as seen from there
    """
    side, least = -1, math.inf
    for k in range(3):
        begin = corner(facets, f, k)
        inward = cross(n, subtract(corner(facets, f, (k + 1) % 3), begin))
        first, last = dot(inward, subtract(p, begin)), dot(inward, subtract(q, begin))
        if last < 0.0:
            share = max(first, 0.0) / (max(first, 0.0) - last)
            if share < least:
                side, least = k, share
    return side, least


@kernel
def loss_on_way(caps: Any, x: Vec, way: Vec) -> Loss:
    """Return the first fall of a rock on the ground through a gap, on a straight path from x (3,) m.

    `Loss.t` is here the share of the path up to the cap (-).

    way : (3,) m, from the start to the end of the path
    caps : a `CapLocator`, or None if the terrain has no gap
    """
    return loss_on(caps, Arc(x=x, v=way, gravity=STRAIGHT), NO_CONTACT, 1.0)  # type: ignore[no-any-return]
