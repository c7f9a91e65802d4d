"""Find where a rock on the ground meets another piece of terrain: a slide itself follows the facets of one piece only.

A terrain may consist of several pieces that pass through each other, such as a slope and a muck pile in a file of its
own. Facets that share vertices belong to one piece. A flight meets the facets of all pieces. The search of this file
looks for facets of other pieces along the straight line between both ends of a ground segment. An engine for a terrain
whose pieces cannot pass through each other has None in place of pieces, and compiles nothing of this file.

Pieces that only touch, such as tiles of one surface, must not stop a rock. So a facet counts only if the line passes
through the facet from its free side to its back:

- At the end of the line, the rock must be more than a crack's width behind the facet. If the rock is less deep there,
  or meets the facet later, the next search finds the facet.
- At the start of the line, the rock must move over the facet for more than `ALONGSIDE` cracks. The rock has just left
  all other facets there, or passes their corners.

A rock that comes from behind passes through a facet: the rock is then below the other piece, and comes out.
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
    line_exit,
    stored_normal,
)
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, norm, scale, subtract


class PieceNumbers(NamedTuple):
    """The pieces of a terrain: `number` (F,) is the piece of each facet.

    overlap : False if no two pieces can pass through each other, so that no search is needed
    """

    number: Any
    overlap: bool


class TerrainPieces(NamedTuple):
    """The pieces of a terrain with the locator over all its facets, for the search along ground segments.

    number, overlap : see `PieceNumbers`
    """

    locator: Any
    number: Any
    overlap: bool


class OnGround(NamedTuple):
    """The contact of a rock that moves along the ground, in place of the `PreviousContact` of a flight.

    facet, other, side : as in `PreviousContact`; number : (F,) piece of each facet
    """

    facet: int
    other: int
    side: float
    number: Any


@model_function
def contact_on_way(pieces: object, facets: Facets, x: Vec, way: Vec, left: PreviousContact) -> Contact:
    """Return the first contact with a facet of another piece, for a rock that moves straight along the ground.

    `Contact.t` is the share of the path up to the facet (-), inf if there is no contact.

    pieces : `TerrainPieces`, or None if no pieces overlap
    x, way : start (3,) m, and vector (3,) m from the start to the end; left : the facets that carry the rock
    """


@contact_on_way.otherwise
def nothing_on_way(pieces: object, facets: Facets, x: Vec, way: Vec, left: PreviousContact) -> Contact:
    """Return NO_CONTACT: no pieces of the terrain overlap."""
    return NO_CONTACT


@contact_on_way.rule(TerrainPieces)
def piece_on_way(pieces: TerrainPieces, facets: Facets, x: Vec, way: Vec, left: PreviousContact) -> Contact:
    """Return the first contact with a facet of another piece on a straight path along the ground."""
    if not pieces.overlap or dot(way, way) == 0.0:
        return NO_CONTACT
    on = OnGround(facet=left.facet, other=left.other, side=left.side, number=pieces.number)
    return first_contact(pieces.locator, facets, Arc(x=x, v=way, gravity=STRAIGHT), on, 1.0)  # type: ignore[no-any-return]


@earlier_of.rule(OnGround)
def earlier_on_ground(on: OnGround, facets: Facets, f: int, arc: Arc, best: Contact) -> Contact:
    """Return the earlier of two contacts on a path along the ground: `best`, or the contact with facet f.

    The facets of the pieces that carry the rock do not count.
    """
    if on.number[f] == on.number[on.facet] or (on.other >= 0 and on.number[f] == on.number[on.other]):
        return best
    n, origin = stored_normal(facets, f), corner(facets, f, 0)
    b, c = on.side * dot(n, arc.v), on.side * dot(n, subtract(arc.x, origin))
    if b >= 0.0 or c < -NEAR * facets.crack or c + b >= -facets.crack:
        return best
    t = max(c, 0.0) / -b
    if c <= NEAR * facets.crack and contains(facets, f, position(arc, t), False, NEAR * facets.crack):
        leads = _leads_over(facets, f, position(arc, t), way_over(facets, f, arc.v, on.side))
        return _sooner(facets, Contact(t=t, facet=f, side=on.side, approach=-b), arc, best) if leads else best
    left = PreviousContact(facet=on.facet, other=-1, side=on.side, resting=True, before=-1)
    found = earlier_contact(facets, f, arc, left, best)
    return found if found.facet == f and found.side == on.side and found.t <= 1.0 else best


@kernel
def _leads_over(facets: Facets, f: int, x: Vec, way: Vec) -> bool:
    """True if a straight path from x (3,) m along `way` (3,) stays over facet f for more than ALONGSIDE cracks."""
    length = norm(way)
    if length == 0.0:
        return True
    return line_exit(facets, f, x, scale(1.0 / length, way), ALONG_EDGE, 0.0) > ALONGSIDE * facets.crack


@kernel
def _sooner(facets: Facets, contact: Contact, arc: Arc, best: Contact) -> Contact:
    """Return the earlier of two contacts of an arc; of two at the same time, the contact that `wins_tie`."""
    if contact.t != best.t:
        return contact if contact.t < best.t else best
    wins = wins_tie(facets, contact.facet, best.facet, arc, contact.t, contact.approach, best.approach)
    return contact if wins else best
