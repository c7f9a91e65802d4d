"""The narrow phase: when an arc meets a facet. Exact, without a time step, shared by both engines.

The height of a parabola above a facet's plane is a quadratic in time, d(t) = c + b t + a t^2. Where it falls through
zero inside the facet the rock hits the free side; where it rises through zero it comes from behind.

Rounding decides nothing silently (docs/design.md, "Contact"):

- A facet the rock has just left is known to be at d = 0: that root is divided out, its later root is kept.
- A rock within tolerance of another facet, or below it by a crack's width at most, and moving into it, hits it now.
- The free side is inclusive by the tolerance, so neighbours overlap and no rock passes between them. The back is
  exclusive by it, so a rock that skims a crest is never taken for one that comes from inside the ground.
- A glancing arc that comes to a plane just before the facet begins meets it where it does begin (`_entry_time`).
- A rock that would leave the terrain, or slid and would come behind it, looks again for facets a little wider
  (`contact_or_crack`). Then a facet also carries a rock that goes along its edge, just outside of it.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc, fall_time, gravity_along, position, velocity
from rpf3d_core.compiling import kernel, model_function
from rpf3d_core.detection.fallen import answered, inquiry, line_of_sight
from rpf3d_core.detection.ties import wins_tie
from rpf3d_core.terrain.facet_geometry import (
    ALONG_EDGE,
    NEAR,
    contains,
    corner,
    edge_distance,
    edge_inward,
    goes_beside,
    leads_on,
    lies_below,
    stored_normal,
)
from rpf3d_core.terrain.facets import CRACK, Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, norm, scale, subtract, without


class Contact(NamedTuple):
    """Contact after t seconds of an arc (inf: none) with a facet, from its free side (+1.0) or its back (-1.0)."""

    t: float
    facet: int
    side: float
    approach: float


class Left(NamedTuple):
    """What the rock stands on, or stood on when its arc began, and the side it is on.

    facet, other : the facet, and the one that holds it in a gully with that; -1 for none
    resting : it slid there, so its speed along the normal is nothing but rounding
    before : the facet it slid off before that one without having moved since, -1 if there is none
    """

    facet: int
    other: int
    side: float
    resting: bool
    before: int


GRAZING = 1e-9
"""Sine of the angle to a facet below which a sliding rock moves along it: a million times the rounding of b / |v|."""
GLANCING = 1.0 / 128.0
"""Sine of the angle to a facet above which rounding of heights, tolerance / 200, is within tolerance along it."""
UPRIGHT = 1e-6
"""Vertical part of a unit normal below which a facet has no plan to speak of: a wall."""
LAST_LOOK = 1.0 + 2.0**-40
"""Tolerance of the last look over a crack; it is larger only to tell that look from the second."""
NO_CONTACT = Contact(math.inf, -1, 1.0, 0.0)
FALLEN = -2
"""What stands for a facet where the rock has fallen through the ground."""
NOTHING_LEFT = Left(-1, -1, 1.0, False, -1)


@model_function
def first_contact(locator: object, facets: Facets, arc: Arc, left: Left, end: float) -> Contact:
    """The earliest contact of an arc before `end` (s), or NO_CONTACT; one rule per locator.

    A locator decides only which facets are looked at and in what order; the answer does not depend on either.
    """


@model_function
def radius_of(locator: object) -> float:
    """Radius (m) of what the locator finds contacts of; a lumped mass has none."""


@radius_of.otherwise
def of_a_point(locator: object) -> float:
    """None."""
    return 0.0


@model_function
def plain_locator(locator: object) -> Any:
    """The locator for points."""


@plain_locator.otherwise
def plain_already(locator: object) -> Any:
    """It is one."""
    return locator


@model_function
def comes_behind(contact: object, left: Left) -> bool:
    """Return whether a rock that was on one side of the ground meets the ground from the other side."""


@comes_behind.otherwise
def not_known_to(contact: object, left: Left) -> bool:
    """Return False: contacts of spheres do not keep their side."""
    return False


@comes_behind.rule(Contact)
def meets_the_other_side(contact: Contact, left: Left) -> bool:
    """Return whether the sides differ: on ground without holes the rock has fallen through it."""
    return left.facet >= 0 and contact.side != left.side


@model_function
def notices_falls(locator: object) -> bool:
    """Return whether a rock that leaves the terrain is looked at once more, or may have fallen through it."""


@notices_falls.otherwise
def takes_them_as_they_are(locator: object) -> bool:
    """Return False: fixed steps are there to show what falls through, and spheres have contacts of their own."""
    return False


@model_function
def sight(contact: object) -> tuple[float, float]:
    """How far along a line of sight it met a facet (share of the line; inf if it met none), and the facet's side."""


@sight.otherwise
def sees_nothing(contact: object) -> tuple[float, float]:
    """Nothing: no inquiry looks with it."""
    return math.inf, 1.0


@sight.rule(Contact)
def seen(contact: Contact) -> tuple[float, float]:
    """When it met it, for a line of sight takes one second."""
    return (contact.t if contact.t <= 1.0 else math.inf), contact.side


@model_function
def fall_of(contact: object) -> Any:
    """The contact that stands for a fall through the ground."""


@fall_of.otherwise
def no_fall(contact: object) -> Any:
    """The same: no inquiry has found one."""
    return contact


@fall_of.rule(Contact)
def fall_of_point(contact: Contact) -> Contact:
    """None, but marked."""
    return Contact(math.inf, FALLEN, 1.0, 0.0)


@model_function
def is_fall(contact: object) -> bool:
    """Return whether a contact is one that `fall_of` gave."""


@is_fall.otherwise
def is_no_fall(contact: object) -> bool:
    """Return False."""
    return False


@is_fall.rule(Contact)
def is_marked(contact: Contact) -> bool:
    """Return whether it is marked."""
    return contact.facet == FALLEN


@kernel
def contact_or_crack(locator: object, facets: Facets, arc: Arc, left: Left, end: float, longest: float) -> Contact:
    """The earliest contact of an arc before `end` and `longest` (s); one that finds none looks again, a little wider.

    What is a hole to the tolerance may be a crack to anyone else: the sliver between an edge and a vertex that lies on
    it but for rounding (a T-junction), or the few tolerances that a rock has drifted on its way from facet to facet.
    Only rocks that would leave the terrain, or come behind it, look twice, so all others meet the facets as they are.
    What they pay for it is a rim that is CRACK tolerances wider.

    A rock that would leave or come behind all the same may have fallen (`fallen.py`). If it has, and slid, it looks a
    last time: then any facet takes it that it moves into where it is. At `end` it leaves the box of the terrain, at
    `longest` it does not.
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
            if looks == 1 and (left.resting or not lands):
                tolerance = facets.crack
            elif notices_falls(locator) and (lands or end <= longest):
                asked, flies_to, looks = inquiry(facets, True), contact.t if lands else math.inf, 2
            else:
                return contact
        if asked.open:
            looked, line, stands, before = facets, line_of_sight(facets, arc, asked), NOTHING_LEFT, 1.0
        else:
            looked, line, stands, before = _with_tolerance(facets, tolerance), arc, left, until


@kernel
def _with_tolerance(facets: Facets, tolerance: float) -> Facets:
    """The same facets with a tolerance (m): that of the second look is the crack, that of the last one is more."""
    return Facets(
        facets.geometry, facets.corners, facets.normals, facets.zone, facets.low, facets.high, tolerance, facets.crack
    )


@kernel
def earlier_contact(facets: Facets, f: int, arc: Arc, left: Left, best: Contact) -> Contact:
    """The earlier of `best` and the arc's first contact with facet f.

    Across a crack the next facet may lie higher than the place where the rock sets out. So down to NEAR cracks below a
    facet the rock is on its free side; otherwise it would meet the facet from behind and be sent into the ground.
    """
    n = stored_normal(facets, f)
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return best
    b = dot(n, arc.v)
    a = -0.5 * arc.gravity * n[2]
    if f == left.facet and not left.resting:
        return _prefer(facets, f, arc, n, _return_time(left, b, a), left.side, best)
    c, s = dot(n, subtract(arc.x, corner(facets, f, 0))), left.side
    if -NEAR * facets.crack <= s * c <= NEAR * facets.tolerance:
        return _prefer(facets, f, arc, n, _time_from_near(facets, f, arc, left, s * c, s * b, s * a), s, best)
    best = _prefer(facets, f, arc, n, falling_time(c, b, a), 1.0, best)
    return _prefer(facets, f, arc, n, falling_time(-c, -b, -a), -1.0, best)


@kernel
def falling_time(c: float, b: float, a: float) -> float:
    """When c + b t + a t^2 falls through zero at t >= 0; inf if it never does.

    The root with 2 a t + b < 0, in the form without cancellation between b and the square root.
    """
    if c < 0.0 and a >= 0.0:  # from below it can only rise through zero
        return math.inf
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return math.inf
    if b > 0.0:
        return (-b - math.sqrt(discriminant)) / (2.0 * a) if a < 0.0 else math.inf
    denominator = math.sqrt(discriminant) - b
    if denominator == 0.0:
        return 0.0 if c == 0.0 and a < 0.0 else math.inf
    t = 2.0 * c / denominator
    return t if t >= 0.0 else math.inf


@kernel
def _return_time(left: Left, b: float, a: float) -> float:
    """When the rock comes back to a facet that it has just bounced off: its root at t = 0 divided out."""
    rising, bending = left.side * b, left.side * a
    return -rising / bending if rising > 0.0 and bending < 0.0 else math.inf


@kernel
def _time_from_near(facets: Facets, f: int, arc: Arc, left: Left, c: float, b: float, a: float) -> float:
    """When a rock within tolerance of a plane meets it: now, unless it leaves the plane faster than rounding.

    c, b, a : its height, speed and half its acceleration away from the plane, on the side that the rock is on.
    A rock that rises through the plane from below, as across a crack, meets it where it falls back onto it.
    Moving along the plane counts as meeting it where gravity presses the rock on (a < 0). Gravity presses none on a
    wall, but rounding may take a rock into it by GRAZING of its way: it meets the wall once it is no longer near. A
    rock that slides into the corner under an overhang meets the overhang, though gravity would pull it away: it cannot
    fall through the floor.
    In a second look that goes for every facet, or it would fall beside a face that is nearly a wall before it meets it.
    """
    grazes = b * b <= GRAZING * GRAZING * dot(arc.v, arc.v)
    if grazes and (a < 0.0 or b >= 0.0):
        return 0.0 if a < 0.0 and _carries(facets, f, arc, left) else math.inf
    leaves = b < 0.0 and left.facet >= 0 and facets.tolerance <= facets.crack and not grazes
    if leaves and (_passes_over(facets, f, arc, left) or _goes_elsewhere(facets, f, arc, left)):
        return math.inf
    if left.resting and b < 0.0 and (a > 0.0 or facets.tolerance >= facets.crack) and not grazes:
        return 0.0
    rises = c < -NEAR * facets.tolerance and b > 0.0 and a < 0.0 and b * b > 4.0 * a * c
    spare = NEAR * facets.tolerance if grazes else 0.0
    return falling_time(c if rises else max(c + spare, 0.0), b, a)


@kernel
def _carries(facets: Facets, f: int, arc: Arc, left: Left) -> bool:
    """Whether a rock that moves along the plane of f is carried by f: one that slides there leads onto it.

    The facet it has just slid off takes it back only along an edge. At rest it may go on over any other (`_approach`
    prefers the right one).
    """
    if not left.resting or facets.tolerance > facets.crack:
        return True
    if f == left.facet:
        return _goes_beside(facets, f, arc, left.side)
    return _comes_over(facets, f, arc, left.side)


@kernel
def _passes_over(facets: Facets, f: int, arc: Arc, left: Left) -> bool:
    """Whether a rock that leaves one facet within tolerance of f, towards the plane of f, still misses f.

    It does where the two form a convex edge and it moves away from f: the plane of f lies above its path there, f
    itself does not.
    """
    if not lies_below(facets, left.facet, f, left.side, facets.tolerance):
        return False
    return not _comes_over(facets, f, arc, left.side)


@kernel
def _goes_elsewhere(facets: Facets, f: int, arc: Arc, left: Left) -> bool:
    """Whether a sliding rock at the rim of f, towards the plane of f, is on its way over other ground than f, or none.

    Whichever way the rock goes, it comes over one of the facets that face upwards and meet where it is. To the others
    only its tolerance ties it; beyond the rim of the terrain there is none.
    """
    n, v = stored_normal(facets, f), arc.v
    level2 = v[0] * v[0] + v[1] * v[1]
    if not left.resting or left.side * n[2] <= UPRIGHT or level2 <= GRAZING * GRAZING * dot(v, v):
        return False
    return not _comes_over(facets, f, arc, left.side)


@kernel
def _comes_over(facets: Facets, f: int, arc: Arc, side: float) -> bool:
    """Whether the way of a rock at the rim of f leads over f.

    Above facets that face upwards this is decided in plan, where the facets that meet at a vertex lie around it without
    gap or overlap: the way leads over one of them, whichever it is. Projected squarely on each facet in turn, the same
    way may lead over none, and the rock would fall between them. A wall has no plan; there that projection counts.
    A rock at rest, or one that goes straight into f, does not leave it.
    """
    way = _way_over(facets, f, arc.v, side)
    length = norm(way)
    if length == 0.0 or leads_on(facets, f, arc.x, scale(1.0 / length, way), ALONG_EDGE):
        return True
    return _goes_beside(facets, f, arc, side)


@kernel
def _way_over(facets: Facets, f: int, v: Vec, side: float) -> Vec:
    """The velocity v brought into the plane of f: in plan where f faces upwards, squarely where it is a wall."""
    n = stored_normal(facets, f)
    return (v[0], v[1], -(n[0] * v[0] + n[1] * v[1]) / n[2]) if side * n[2] > UPRIGHT else without(v, n)


@kernel
def _goes_beside(facets: Facets, f: int, arc: Arc, side: float) -> bool:
    """Whether, in a second look, the way of a rock runs along an edge of f, no further outside f than a crack.

    A rock that goes along the line where two facets meet may leave each of them by rounding, and lead onto neither:
    where the line is a T-junction's, or the foot of a wall. One of them must carry it on.
    """
    if facets.tolerance < facets.crack:
        return False
    return goes_beside(facets, f, arc.x, _way_over(facets, f, arc.v, side))


@kernel
def _approach(facets: Facets, f: int, arc: Arc, n: Vec, t: float) -> float:
    """How fast the rock meets the plane of f (m/s); for a rock at rest on several, how fast f would carry it away.

    That is the pull of gravity along f (m/s^2) where the way down leads onto f, so the steepest way down wins.
    """
    if t == 0.0 and arc.v[0] == 0.0 and arc.v[1] == 0.0 and arc.v[2] == 0.0:
        down = gravity_along(n, arc.gravity)
        pull = norm(down)
        leads = pull > 0.0 and leads_on(facets, f, arc.x, scale(1.0 / pull, down), ALONG_EDGE)
        return pull if leads else 0.0
    return abs(dot(n, arc.v) - arc.gravity * n[2] * t)


@kernel
def _prefer(facets: Facets, f: int, arc: Arc, n: Vec, t: float, side: float, best: Contact) -> Contact:
    """Contact at time t with facet f if it is inside the facet and before `best`.

    A contact now, at t = 0, is one within tolerance in every direction, along the facet as across it.
    """
    if t > best.t or t == math.inf:
        return best
    approach = _approach(facets, f, arc, n, t)
    if t == best.t and not wins_tie(facets, f, best.facet, arc, t, approach, best.approach):
        return best
    slack = NEAR * facets.tolerance if t == 0.0 else facets.tolerance
    glances = approach * approach <= GLANCING * GLANCING * dot(arc.v, arc.v)
    if contains(facets, f, position(arc, t), side < 0.0, slack):
        passes = side < 0.0 and glances and _came_over_edge(facets, f, arc, n, t)
        return best if passes else Contact(t, f, side, approach)
    if side < 0.0 or not glances:
        return best
    t = _entry_time(facets, f, arc, n, t)
    if t < best.t or (
        t == best.t and t < math.inf and wins_tie(facets, f, best.facet, arc, t, approach, best.approach)
    ):
        return Contact(t, f, side, approach)
    return best


@kernel
def _entry_time(facets: Facets, f: int, arc: Arc, n: Vec, t: float) -> float:
    """When an arc that passed the plane of f beside f, at time t, comes over f; inf if it has sunk by then.

    Two facets that share an edge are known to rounding, so a glancing arc may come to the plane of one of them just
    before that facet begins and to that of the other just after that one ends: it would slip between them. It meets the
    facet where it comes over it, unless it is more than NEAR tolerances below the plane by then. An arc that bounced
    off the other facet still rises there; it meets f where it falls back onto the plane.
    """
    p, v = position(arc, t), velocity(arc, t)
    later = 0.0
    for k in range(3):
        _, distance = edge_distance(facets, f, k, p)
        if distance < 0.0:
            inward = edge_inward(facets, f, k)
            later = max(later, falling_time(-distance, -dot(inward, v), 0.5 * arc.gravity * inward[2]))
    if later == math.inf:
        return math.inf
    b, a = dot(n, v), -0.5 * arc.gravity * n[2]
    height = (b + a * later) * later
    if height > 0.0:
        later = -b / a if a < 0.0 else math.inf
    if height >= -NEAR * facets.tolerance and contains(facets, f, position(arc, t + later), False, facets.tolerance):
        return t + later
    return math.inf


@kernel
def _came_over_edge(facets: Facets, f: int, arc: Arc, n: Vec, t: float) -> bool:
    """Whether an arc that comes through the plane of f from behind, at time t, was on the plane where f begins.

    A rock in the plane of one facet that flies on over another, bent away from it, comes out of the plane of that just
    behind the edge by rounding. It has not been in the ground.
    """
    p, v = position(arc, t), velocity(arc, t)
    since = math.inf
    for k in range(3):
        inward = edge_inward(facets, f, k)
        _, distance = edge_distance(facets, f, k, p)
        since = min(since, falling_time(distance, -dot(inward, v), -0.5 * arc.gravity * inward[2]))
    depth = (dot(n, v) + 0.5 * arc.gravity * n[2] * since) * since
    return since < t and depth <= NEAR * facets.tolerance


@kernel
def flight_end(facets: Facets, arc: Arc, radius: float) -> float:
    """When an arc has left the box around the terrain, sideways or downwards (s); it cannot hit anything later.

    radius : m, by which the box is wider for a sphere; 0 for a lumped mass

    Downwards it is followed for NEAR CRACK tolerances: a rock that began, or came over a facet, as much below its plane
    is still to hit it.
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
