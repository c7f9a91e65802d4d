"""Exact contact of an arc with one facet, without a time step, for both engines (the narrow phase of the search).

The height of a parabola above a facet's plane is a quadratic in time, d(t) = c + b t + a t^2. Where d falls through
zero inside the facet, the rock hits the free side. Where d rises through zero, the rock hits the back.

Fixed rules, and not rounding errors, decide all special cases (docs/explanation/physics.md):

- For a facet that the rock has just left, d = 0 at t = 0: this root is divided out, and the later root is kept.
- A rock within tolerance of another facet, or below that facet by at most a crack's width, hits the facet at t = 0
  if it moves into the facet.
- The free side includes an edge band as wide as the tolerance, so neighbours overlap and no rock passes between them.
  The back excludes this band, so a rock that just touches a crest never counts as a rock from inside the ground.
- A glancing arc may reach the plane of a facet just outside the facet. The arc then meets the facet where it crosses
  the facet's edge (`_entry_time`).
- If a rock would meet no facet, or would meet a different side of the ground than before, the search runs again with
  slightly wider facets (`contact_or_crack`). In this search a facet also counts as the ground under a rock that moves
  along its edge, just outside the facet.
"""

import math

from rpf3d_core.arc import Arc, falling_time, gravity_along, position, velocity
from rpf3d_core.detection.contact import GRAZING, Contact, PreviousContact
from rpf3d_core.detection.ties import wins_tie
from rpf3d_core.jit.dispatch import kernel, model_function
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
    time_into,
)
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, norm, scale, subtract, without

GLANCING = 1.0 / 128.0
"""Sine of the angle between an arc and a facet below which rounding may move the contact along the facet.

Above this sine, the rounding of a height (tolerance / 200) moves a contact along the facet by less than the tolerance.
"""
UPRIGHT = 1e-6
"""Vertical component of a unit normal below which a facet counts as a wall: in plan it is too narrow to test."""


@model_function
def earlier_of(left: object, facets: Facets, f: int, arc: Arc, best: Contact) -> Contact:
    """Return the earlier of two contacts of an arc: `best`, found so far, or the first contact with facet f.

    left : the contact from which the rock starts, of one class for a flying rock and of another class for a rock that
        moves along the ground; there is one rule for each class
    """


@kernel
def earlier_contact(facets: Facets, f: int, arc: Arc, left: PreviousContact, best: Contact) -> Contact:
    """Return the earlier of two contacts of an arc: `best`, found so far, or the first contact with facet f.

    left : the contact from which the rock starts

    Across a crack the next facet may lie higher than the start of the arc. So a rock that is below a facet by at most
    NEAR crack widths is treated as if it were on the side from which it came. Otherwise the rock would meet the facet
    from behind, and the impact would send the rock into the ground.
    """
    n = stored_normal(facets, f)
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return best
    b = dot(n, arc.v)
    a = -0.5 * arc.gravity * n[2]
    if f == left.facet and not left.resting:
        return _prefer(facets, f, arc, n, _return_time(left, b, a), left.side, best)
    c = dot(n, subtract(arc.x, corner(facets, f, 0)))
    if abs(c) <= NEAR * max(facets.crack, facets.tolerance):
        s = -left.side if f == left.before and not left.resting else left.side
        if -NEAR * facets.crack <= s * c <= NEAR * facets.tolerance:
            return _prefer(facets, f, arc, n, _time_from_near(facets, f, arc, left, s * c, s * b, s * a), s, best)
    best = _prefer(facets, f, arc, n, falling_time(c, b, a), 1.0, best)
    return _prefer(facets, f, arc, n, falling_time(-c, -b, -a), -1.0, best)


@earlier_of.rule(PreviousContact)
def earlier_in_flight(left: PreviousContact, facets: Facets, f: int, arc: Arc, best: Contact) -> Contact:
    """Return the earlier of two contacts of a flying rock: `best`, or the first contact with facet f.

    left : the contact from which the rock starts
    """
    return earlier_contact(facets, f, arc, left, best)


@kernel
def _return_time(left: PreviousContact, b: float, a: float) -> float:
    """Return the time (s) when a rock returns to the plane of its last bounce, after the start at t = 0; inf for never.

    left : the last bounce
    b, a : speed (m/s) and half the acceleration (m/s^2) along the facet's normal as stored, towards its free side
    """
    rising, bending = left.side * b, left.side * a
    return -rising / bending if rising > 0.0 and bending < 0.0 else math.inf


@kernel
def _time_from_near(facets: Facets, f: int, arc: Arc, left: PreviousContact, c: float, b: float, a: float) -> float:
    """Return the time (s) when a rock near the plane of facet f meets the plane; 0 for at once, inf for never.

    left : the contact from which the rock starts
    c, b, a : height (m), speed (m/s) and half the acceleration (m/s^2) of the rock above the plane; above means on the
        side from which the rock came

    The first rule that holds decides:
    - A rock that moves along the plane, and that gravity presses against the plane (a < 0), meets the plane at once if
      facet f carries the rock (`_carries`), else never.
    - Gravity does not press a rock against a wall, but rounding may move a rock on its way along the wall into the
      wall, by GRAZING metres per metre of path. The rock meets the wall when it is NEAR tolerances behind its plane.
    - A rock that starts on a facet never meets facet f if the rock moves away across a convex edge, or moves onto
      another facet (`_passes_over`, `_goes_elsewhere`). In the last search (`search.py`) this rule is not used.
    - A rock that slides into the corner under an overhang (a > 0) meets the overhang at once, although gravity pulls
      the rock away: the rock cannot fall through the floor. In the second and the last search, a sliding rock meets
      every near facet at once that it moves into; otherwise the rock would fall past a facet that is nearly vertical.
    - A rock that rises through the plane from below, as across a crack, meets the plane where it falls back.
    - Any other rock meets the plane where it falls through the plane; a rock slightly below counts as on the plane.
    """
    if b * b <= GRAZING * GRAZING * dot(arc.v, arc.v):
        if a < 0.0:
            return 0.0 if _carries(facets, f, arc, left) else math.inf
        return falling_time(max(c + NEAR * facets.tolerance, 0.0), b, a)
    leaves = b < 0.0 and left.facet >= 0 and facets.tolerance <= facets.crack
    if leaves and (_passes_over(facets, f, arc, left) or _goes_elsewhere(facets, f, arc, left)):
        return math.inf
    if left.resting and b < 0.0 and (a > 0.0 or facets.tolerance >= facets.crack):
        return 0.0
    rises = c < -NEAR * facets.tolerance and b > 0.0 and a < 0.0 and b * b > 4.0 * a * c
    return falling_time(c if rises else max(c, 0.0), b, a)


@kernel
def _carries(facets: Facets, f: int, arc: Arc, left: PreviousContact) -> bool:
    """Return True if facet f carries a rock that moves along the facet's plane: the rock is then in contact at once.

    left : the contact from which the rock starts

    The first rule that applies decides:

    - A rock that was flying is carried by every facet, and so is every rock in the last search (`search.py`).
    - The facet from which the rock starts (`left.facet`) does not carry the rock in the first search. In the second
      search it does if the rock is at rest, or moves along an edge of this facet (`_goes_beside`).
    - Any other facet carries a rock at rest, and a sliding rock that moves onto this facet (`_comes_over`). Among the
      facets under a rock at rest, `_approach` prefers the one with the steepest descent.
    """
    if not left.resting or facets.tolerance > facets.crack:
        return True
    if f == left.facet:
        return _goes_beside(facets, f, arc, left.side)
    return _comes_over(facets, f, arc, left.side)


@kernel
def _passes_over(facets: Facets, f: int, arc: Arc, left: PreviousContact) -> bool:
    """Return True if a rock on its last facet moves towards the plane of the near facet f, but does not hit facet f.

    left : the contact from which the rock starts, on its last facet

    The rock does not hit facet f if the two facets form a convex edge and the rock moves away from facet f. The rock
    then crosses the plane of facet f outside facet f.
    """
    if not lies_below(facets, left.facet, f, left.side, facets.tolerance):
        return False
    return not _comes_over(facets, f, arc, left.side)


@kernel
def _goes_elsewhere(facets: Facets, f: int, arc: Arc, left: PreviousContact) -> bool:
    """Return True if a sliding rock at the edge of facet f moves onto another facet or off the terrain, not onto f.

    left : the contact from which the rock starts

    The rock moves towards the plane of facet f. The upward facets that meet at the rock's position cover all directions
    in plan. So the rock moves onto one of these facets, or beyond the outer edge of the terrain, where no facet is. The
    rock is near the other facets only because of the tolerance, and does not hit them.
    """
    n, v = stored_normal(facets, f), arc.v
    level2 = v[0] * v[0] + v[1] * v[1]
    if not left.resting or left.side * n[2] <= UPRIGHT or level2 <= GRAZING * GRAZING * dot(v, v):
        return False
    return not _comes_over(facets, f, arc, left.side)


@kernel
def _comes_over(facets: Facets, f: int, arc: Arc, side: float) -> bool:
    """Return True if a rock at the edge of facet f moves onto facet f.

    If the side of facet f on which the rock is faces up, the rock's direction of motion in plan decides. In plan the
    facets around a vertex have no gap and no overlap, so every direction leads onto one of these facets. If the
    direction were projected at right angles onto each facet, it might lead onto none of them, and the rock would fall
    between the facets. A wall has no area in plan, so for a wall or an overhang the projection at right angles decides.

    The result is also True for a rock at rest, and for a rock that moves straight into facet f (vertically, if the
    facet faces up). In the second and the last search (`search.py`), it is also True for a rock that moves along an
    edge of facet f, at most a crack's width outside the facet (`_goes_beside`).

    side : side of facet f on which the rock is, as in `Contact`
    """
    way = way_over(facets, f, arc.v, side)
    length = norm(way)
    if length == 0.0 or leads_on(facets, f, arc.x, scale(1.0 / length, way), ALONG_EDGE):
        return True
    return _goes_beside(facets, f, arc, side)


@kernel
def way_over(facets: Facets, f: int, v: Vec, side: float) -> Vec:
    """Return the velocity v projected into the plane of facet f: the direction of a rock's motion on the facet.

    On an upward facet the projection is vertical, so v keeps its components in plan. On a wall the projection removes
    the component along the normal.

    side : side of facet f on which the rock is, as in `Contact`
    """
    n = stored_normal(facets, f)
    return (v[0], v[1], -(n[0] * v[0] + n[1] * v[1]) / n[2]) if side * n[2] > UPRIGHT else without(v, n)


@kernel
def _goes_beside(facets: Facets, f: int, arc: Arc, side: float) -> bool:
    """Return True if a rock moves along an edge of facet f, outside the facet by at most a crack's width.

    The result is False in the first search, in which facets have their true size.

    A rock that moves along the edge between two facets may leave both facets by rounding, at a T-junction or at the
    foot of a wall. One of the facets must still carry the rock.

    side : side of facet f on which the rock is, as in `Contact`
    """
    if facets.tolerance < facets.crack:
        return False
    return goes_beside(facets, f, arc.x, way_over(facets, f, arc.v, side))


@kernel
def _approach(facets: Facets, f: int, arc: Arc, n: Vec, t: float) -> float:
    """Return the speed (m/s) at which a rock meets the plane of facet f, to choose between facets met at the same time.

    For a rock at rest, the result is the pull (m/s^2) instead: the component of gravity along facet f if the direction
    of descent leads onto facet f, otherwise 0. So among several facets under a rock at rest, the facet with the
    steepest descent wins.

    n : (3,) normal of facet f; t : time when the rock meets the plane (s)
    """
    if t == 0.0 and arc.v[0] == 0.0 and arc.v[1] == 0.0 and arc.v[2] == 0.0:
        down = gravity_along(n, arc.gravity)
        pull = norm(down)
        leads = pull > 0.0 and leads_on(facets, f, arc.x, scale(1.0 / pull, down), ALONG_EDGE)
        return pull if leads else 0.0
    return abs(dot(n, arc.v) - arc.gravity * n[2] * t)


@kernel
def _prefer(facets: Facets, f: int, arc: Arc, n: Vec, t: float, side: float, best: Contact) -> Contact:
    """Return the contact of an arc with facet f at time t (s) if it lies in facet f and is earlier than `best`.

    Otherwise the result is `best`. Of two contacts at the same time, `wins_tie` selects one.

    n : (3,) normal of the facet; t : time (s) when the arc meets the facet's plane, inf for never
    side : as in `Contact`; best : the earliest contact so far

    A glancing arc that meets the plane outside the facet may enter the facet later (`_entry_time`). A glancing arc that
    meets the back has no contact if the rock only came over an edge of the facet (`_came_over_edge`).
    """
    if t > best.t or t == math.inf:
        return best
    approach = _approach(facets, f, arc, n, t)
    if t == best.t and not wins_tie(facets, f, best.facet, arc, t, approach, best.approach):
        return best
    if contains(facets, f, position(arc, t), side < 0.0, _edge_band(facets, arc, n, t, approach)):
        if side < 0.0 and _glances(facets, arc, approach) and _came_over_edge(facets, f, arc, n, t):
            return best
        return Contact(t=t, facet=f, side=side, approach=approach)
    if side < 0.0 or not _glances(facets, arc, approach):
        return best
    t = _entry_time(facets, f, arc, n, t)
    if t < best.t or (
        t == best.t and t < math.inf and wins_tie(facets, f, best.facet, arc, t, approach, best.approach)
    ):
        return Contact(t=t, facet=f, side=side, approach=approach)
    return best


@kernel
def _edge_band(facets: Facets, arc: Arc, n: Vec, t: float, approach: float) -> float:
    """Return the width (m) of the edge band in which a facet still catches a rock that meets its plane at time t.

    n : (3,) normal of the facet; approach : speed (m/s) at which the rock meets the plane

    A contact at t = 0 may be NEAR tolerances away from the facet, along its plane as well as along its normal. A rock
    meets an upright wall when it is NEAR tolerances behind the plane (`_time_from_near`). In a sharp corner of two
    walls, the rock is then farther beyond the edges of both. So the edge band of a vertical wall (UPRIGHT) is as wide
    as a crack, for a contact at t = 0 and for a rock that moves along the wall.
    """
    near = t == 0.0 or approach * approach <= GRAZING * GRAZING * dot(arc.v, arc.v)
    if near and abs(n[2]) <= UPRIGHT:
        return facets.crack
    return NEAR * facets.tolerance if t == 0.0 else facets.tolerance


@kernel
def _glances(facets: Facets, arc: Arc, approach: float) -> bool:
    """Return True if an arc meets a plane at so small an angle that rounding moves the contact along the plane.

    approach : speed (m/s) at which the rock meets the plane

    The search with wider facets counts every angle as small: a crack moves the contact by its width over the sine of
    the angle, which is wider than the edge band.
    """
    if facets.tolerance >= facets.crack:
        return True
    return approach * approach <= GLANCING * GLANCING * dot(arc.v, arc.v)


@kernel
def _entry_time(facets: Facets, f: int, arc: Arc, n: Vec, t: float) -> float:
    """Return the time (s) when an arc enters facet f, if the arc crosses the plane of f at time t (s), but outside f.

    Return inf if the arc crosses no edge of the facet after t, if it is then too far below the plane, or if it falls
    back onto the plane outside the facet.

    The planes of two facets with a common edge are known only to rounding. A glancing arc may cross the plane of each
    facet just outside this facet, and would then pass between the two facets. So the arc meets facet f where it
    crosses the edge of facet f, if it is then at most NEAR tolerances below the plane. If the arc is above the plane at
    the edge, after a bounce off the neighbouring facet, it meets facet f where it falls back onto the plane.

    n : (3,) normal of facet f
    """
    v = velocity(arc, t)
    later = time_into(facets, f, position(arc, t), v, (0.0, 0.0, -arc.gravity), 0.0)
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
    """Return True if a rock that rises through facet f at time t came over an edge of the facet, not out of the ground.

    The rock came over an edge if the arc crossed the line of an edge before t, and was then on the plane of facet f, or
    at most NEAR tolerances behind the plane.

    A rock that flies in the plane of one facet may pass to a neighbouring facet that bends away. Rounding then puts the
    rock just behind the neighbouring facet at the common edge, although the rock has never been in the ground.

    n : (3,) normal of facet f
    """
    p, v = position(arc, t), velocity(arc, t)
    since = math.inf
    for k in range(3):
        inward = edge_inward(facets, f, k)
        _, distance = edge_distance(facets, f, k, p)
        since = min(since, falling_time(distance, -dot(inward, v), -0.5 * arc.gravity * inward[2]))
    depth = (dot(n, v) + 0.5 * arc.gravity * n[2] * since) * since
    return since < t and depth <= NEAR * facets.tolerance
