"""Find where a rock on the ground meets another piece of terrain: a slide itself follows the facets of one piece only.

A terrain may consist of several pieces that pass through each other, such as a slope and a muck pile in a separate
file. Facets that share vertices belong to one piece. A flight meets the facets of all pieces. The search of this file
looks for facets of other pieces along the straight line between both ends of a ground segment. In a run, the engine for
a terrain whose pieces cannot pass through each other has None in place of pieces, and compiles nothing of this file. In
the live simulator, such an engine has `TerrainPieces` with `overlap` False.

For a rock on the free side of the ground, a facet counts only if the line passes through the facet from its free side
to its back; for a rock on the back of the ground, only in the reverse direction. At the end of the line, the rock must
be behind the facet by more than rounding. Otherwise the search along the next ground segment may find the facet. A
facet at the start of the line counts only if the rock then stays over the facet (`_leads_over`).

Pieces that only touch, such as tiles of one surface, must not stop a rock, although they may overlap by a crack. So at
the rim of a piece, `ALONGSIDE` cracks wide, a facet counts only if two conditions hold: the rock gets deeper than a
crack, and stays over the facet for a longer path than the rim is wide.

A rock that reaches a facet from the other side passes through the facet: such a rock is below the other piece, and
comes out.
"""

from typing import Any, NamedTuple

from rpf3d_core.arc import Arc, position
from rpf3d_core.detection.contact import NO_CONTACT, Contact, PreviousContact, first_contact
from rpf3d_core.detection.fallen import STRAIGHT
from rpf3d_core.detection.narrow_phase import earlier_contact, earlier_of, way_over
from rpf3d_core.detection.ties import wins_tie
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.terrain.facet_geometry import (
    ALONG_EDGE,
    ALONGSIDE,
    NEAR,
    contains,
    corner,
    edge_distance,
    edge_inward,
    stored_normal,
)
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, norm, subtract


class PieceNumbers(NamedTuple):
    """The pieces of a terrain of F facets, that is, groups of facets that share vertices.

    number : (F,) number of the piece that each facet belongs to
    rims : (F,) for each facet, bit k is set if edge k is at the rim of its piece, where no other facet follows
    overlap : False if no two pieces can pass through each other, so that no search is needed
    """

    number: Any
    rims: Any
    overlap: bool


class TerrainPieces(NamedTuple):
    """The pieces of a terrain with the locator over all its facets, for the search along ground segments.

    number : (F,) piece of each facet; rims : (F,) bits for the edges of each facet at the rim of its piece
    overlap : False if no two pieces can pass through each other; all three as in `PieceNumbers`
    """

    locator: Any
    number: Any
    rims: Any
    overlap: bool


class OnGround(NamedTuple):
    """The start of a slide or roll, for the search for facets of other pieces of the terrain.

    The record has the facets that carry the rock, and the piece of every facet. `OnGround` replaces the
    `PreviousContact` that the search along a flight uses.

    facet, other : the facet that carries the rock, and a second facet in a gully, else -1
    side : side of the ground on which the rock is, +1.0 for the free side, -1.0 for the back
    number : (F,) piece of each facet; rims : (F,) bits for the edges of each facet at the rim of its piece
    """

    facet: int
    other: int
    side: float
    number: Any
    rims: Any


@model_function
def contact_on_way(pieces: object, facets: Facets, x: Vec, way: Vec, left: PreviousContact) -> Contact:
    """Return the first contact of a rock that moves straight along the ground with another piece of the terrain.

    A piece is a group of facets that share vertices; pieces may pass through each other.

    `Contact.t` is the share of the path up to the facet (-), inf if there is no contact.

    pieces : `TerrainPieces`, or None if no search is needed
    x, way : start (3,) m, and vector (3,) m from the start to the end; left : the facets that carry the rock
    """


@contact_on_way.otherwise
def nothing_on_way(pieces: object, facets: Facets, x: Vec, way: Vec, left: PreviousContact) -> Contact:
    """Return NO_CONTACT: no pieces of the terrain overlap, so a rock on the ground meets no other piece."""
    return NO_CONTACT


@contact_on_way.rule(TerrainPieces)
def piece_on_way(pieces: TerrainPieces, facets: Facets, x: Vec, way: Vec, left: PreviousContact) -> Contact:
    """Return the first contact with another piece of the terrain on a straight path along the ground.

    x : (3,) m, start of the path; way : (3,) m, from start to end; left : the contact from which the rock starts
    """
    if not pieces.overlap or dot(way, way) == 0.0:
        return NO_CONTACT
    on = OnGround(facet=left.facet, other=left.other, side=left.side, number=pieces.number, rims=pieces.rims)
    return first_contact(pieces.locator, facets, Arc(x=x, v=way, gravity=STRAIGHT), on, 1.0)  # type: ignore[no-any-return]


@earlier_of.rule(OnGround)
def earlier_on_ground(on: OnGround, facets: Facets, f: int, arc: Arc, best: Contact) -> Contact:
    """Return the earlier of two contacts on a path along the ground: `best`, or the contact with facet f.

    Facets that belong to the same piece of terrain as a facet that carries the rock do not count.

    on : the facets that carry the rock; arc : the path, as a straight arc of one second
    """
    if on.number[f] == on.number[on.facet] or (on.other >= 0 and on.number[f] == on.number[on.other]):
        return best
    n, origin = stored_normal(facets, f), corner(facets, f, 0)
    b, c = on.side * dot(n, arc.v), on.side * dot(n, subtract(arc.x, origin))
    if b >= 0.0 or c < -NEAR * facets.crack or c + b >= -facets.tolerance:
        return best
    rims, deep, t = on.rims[f], c + b < -facets.crack, max(c, 0.0) / -b
    if c <= NEAR * facets.crack and contains(facets, f, position(arc, t), False, NEAR * facets.crack):
        x, way = position(arc, t), way_over(facets, f, arc.v, on.side)
        counts = (deep or not _is_at_rim(facets, f, rims, x)) and _leads_over(facets, f, rims, x, way)
        return _sooner(facets, Contact(t=t, facet=f, side=on.side, approach=-b), arc, best) if counts else best
    left = PreviousContact(facet=on.facet, other=-1, side=on.side, resting=True, before=-1)
    found = earlier_contact(facets, f, arc, left, best)
    if found.facet != f or found.side != on.side or found.t > 1.0:
        return best
    return found if deep or not _is_at_rim(facets, f, rims, position(arc, found.t)) else best


@kernel
def _is_at_rim(facets: Facets, f: int, rims: int, x: Vec) -> bool:
    """Return True if x (3,) m on facet f lies within ALONGSIDE cracks of an edge at the rim of the facet's piece.

    rims : bits of these edges, as in `PieceNumbers`
    """
    at_rim, wide = False, ALONGSIDE * facets.crack
    for k in range(3):
        squared, distance = edge_distance(facets, f, k, x)
        at_rim = at_rim or ((rims >> k) & 1 == 1 and (distance <= 0.0 or distance * distance <= wide * wide * squared))
    return at_rim


@kernel
def _leads_over(facets: Facets, f: int, rims: int, x: Vec, way: Vec) -> bool:
    """Return True if a path from x (3,) m straight along `way` (3,) stays over facet f long enough for a contact.

    The path must be longer than ALONGSIDE cracks up to an edge at the rim of the piece, and longer than the tolerance
    up to an edge where another facet follows.

    rims : bits of the edges at the rim of the piece, as in `PieceNumbers`
    """
    length, leads = norm(way), True
    for k in range(3):
        inward = edge_inward(facets, f, k)
        closing = -dot(inward, way)
        if closing > ALONG_EDGE * norm(inward) * length:
            least = ALONGSIDE * facets.crack if (rims >> k) & 1 == 1 else facets.tolerance
            leads = leads and edge_distance(facets, f, k, x)[1] * length > least * closing
    return leads


@kernel
def _sooner(facets: Facets, contact: Contact, arc: Arc, best: Contact) -> Contact:
    """Return the earlier of two contacts of an arc; of two at the same time, the contact that `wins_tie` prefers."""
    if contact.t != best.t:
        return contact if contact.t < best.t else best
    wins = wins_tie(facets, contact.facet, best.facet, arc, contact.t, contact.approach, best.approach)
    return contact if wins else best
