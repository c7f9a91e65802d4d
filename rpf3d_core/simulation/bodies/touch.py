"""Find the contacts of a body at one position: points of the body with a gap of at most BAND skins from a facet."""

from typing import Any

from rpf3d_core.body.contacts import (
    ARM,
    CONTACT_COLUMNS,
    FACET,
    IMPULSE,
    MU,
    NORMAL,
    RESTITUTION,
    ROLLING,
    put,
    vector,
)
from rpf3d_core.body.contacts import GAP as ROW_GAP
from rpf3d_core.body.quaternions import turned_back
from rpf3d_core.detection.closest import distance_to_facet
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.materials.library import surface_of
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion, place_of
from rpf3d_core.simulation.bodies.patch import contact_polygon
from rpf3d_core.simulation.bodies.room import (
    ACTIVE,
    AWAY,
    CONTACTS,
    COVERED,
    GAP,
    GUESS,
    MARK,
    NEAREST,
    TOUCHED,
    UNKNOWN,
    BodyRoom,
)
from rpf3d_core.simulation.bodies.survey import facet_in_body, look, stays_above
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.terrain.facet_geometry import stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, norm, scale, subtract

BAND = 2.0
"""Largest gap of a contact, divided by the skin (-): facets within this gap are within the band of contact."""
SAME_PLANE = 1e-9
"""Largest difference from 1 of the cosine between contact normal and facet normal (-) if both normals count as equal.

The contact is then in the interior of the facet, not on its border.
"""
NEARER = 1e-9
"""Share (-) of the gap by which another facet must be nearer to the body's nearest point, to cover a facet's border."""
SAME_POINT = 1e-6
"""Largest distance between two contacts that count as one, divided by the body's reach (-).

The limit for the length of the difference between their unit normals is the same.
"""
KEPT = 0.05
"""Largest distance (-), divided by the body's reach, between a contact and the same contact in the previous step."""


@routine
def touch(body: Body, room: BodyRoom, facets: Facets, motion: BodyMotion, moved: float) -> None:
    """Mark the nearby facets with a gap of at most BAND times the body's skin as TOUCHED, and all others as AWAY.

    The marks are in `room.planes`, column ACTIVE. Facets whose gap may be that small are examined again.

    moved : path bound of the body, as in `Ride` (m)
    """
    band = BAND * body.skin
    for k in range(room.count[0]):
        plane = room.planes[k]
        known = plane[GAP] != UNKNOWN
        near = not known or plane[GAP] - abs(moved - plane[MARK]) <= band
        if near and known and plane[MARK] != moved:
            near = not stays_above(body, room, motion, k, band, moved)
        if near and (plane[MARK] != moved or not known):
            look(body, room, facets, motion, k, moved)
        plane[ACTIVE] = TOUCHED if near and plane[GAP] <= band else AWAY


@kernel
def mark_covered(body: Body, room: BodyRoom, facets: Facets, motion: BodyMotion) -> None:
    """Mark a touched facet as COVERED if the body is nearest to its border, and another touched facet is nearer there.

    Let P be the point of the body nearest to the touched facet. The facet is covered if another touched facet is nearer
    to P than the facet itself. A contact with a covered facet acts along the facet's own normal, so bodies slide
    smoothly over the borders of facets that lie in one plane. The facet with the smallest gap is never marked.
    """
    nearest = _nearest(room)
    for k in range(room.count[0]):
        if room.planes[k, ACTIVE] == AWAY or k == nearest:
            continue
        n = vector(room.planes[k], GUESS)
        m = _facet_normal(facets, room.facets[k], motion, n)
        if dot(m, n) < 1.0 - SAME_PLANE and _is_covered(body, room, facets, motion, k):
            room.planes[k, ACTIVE] = COVERED


@routine
def list_contacts(
    body: Body, room: BodyRoom, points: Any, physics: Physics, motion: BodyMotion, rock: RockContext
) -> int:
    """Write the contacts with all touched and covered facets into `points`; return their number.

    A touched facet has a contact at the nearest point of the body, and contacts at the corners of a polygon
    (`contact_polygon`). A covered facet has only the contacts of the polygon.

    points : (K, CONTACT_COLUMNS); physics : has the facets and their ground properties
    rock : the rock's data, on which varying ground properties depend
    """
    facets, count = physics.facets, 0
    for k in range(room.count[0]):
        if room.planes[k, ACTIVE] == AWAY:
            continue
        f, plane = room.facets[k], room.planes[k]
        n, m = vector(plane, GUESS), _facet_normal(facets, f, motion, vector(plane, GUESS))
        before = count
        if plane[ACTIVE] == COVERED:
            n = m
        else:
            count = _add(body, points, count, vector(plane, NEAREST), n, plane[GAP])
        corners = facet_in_body(facets, f, motion)
        for i in range(contact_polygon(body, room, corners, m, n, BAND * body.skin)):
            arm = (room.polygon[i, 0], room.polygon[i, 1], room.polygon[i, 2])
            count = _add(body, points, count, arm, n, room.polygon[i, 3])
        _set_ground(body, points, before, count, physics, f, rock)
    return count


@kernel
def _nearest(room: BodyRoom) -> int:
    """Return the index in `room.facets` of the touched facet with the smallest gap; -1 if no facet is touched."""
    best, gap = -1, 0.0
    for k in range(room.count[0]):
        plane = room.planes[k]
        if plane[ACTIVE] != AWAY and (best < 0 or plane[GAP] < gap):
            best, gap = k, plane[GAP]
    return best


@kernel
def _facet_normal(facets: Facets, f: int, motion: BodyMotion, n: Vec) -> Vec:
    """Return the unit normal (3,) of facet number f in the body's axes, turned to the side of the contact normal n."""
    m = turned_back(motion.q, stored_normal(facets, f))
    return m if dot(m, n) >= 0.0 else scale(-1.0, m)


@kernel
def _is_covered(body: Body, room: BodyRoom, facets: Facets, motion: BodyMotion, k: int) -> bool:
    """Return True if another touched facet is nearer than nearby facet k to the body's point nearest to facet k.

    k : index of the facet in `room.facets`; motion : current motion of the body
    """
    plane = room.planes[k]
    p = place_of(motion, vector(plane, NEAREST))
    for i in range(room.count[0]):
        other = i != k and room.planes[i, ACTIVE] != AWAY
        if other and distance_to_facet(facets, room.facets[i], p) < plane[GAP] * (1.0 - NEARER):
            return True
    return False


@kernel
def _add(body: Body, points: Any, count: int, arm: Vec, n: Vec, gap: float) -> int:
    """Write a contact into row `count` of `points` if it is new and there is room; return the new number of contacts.

    arm : (3,) m, position of the contact; n : (3,) its normal, both in the body's axes; gap : m
    """
    if count >= CONTACTS:
        return count
    for i in range(count):
        apart = norm(subtract(vector(points[i], ARM), arm))
        if apart <= SAME_POINT * body.reach and norm(subtract(vector(points[i], NORMAL), n)) <= SAME_POINT:
            return count
    row = points[count]
    put(row, ARM, arm)
    put(row, NORMAL, n)
    put(row, IMPULSE, (0.0, 0.0, 0.0))
    row[ROW_GAP] = gap
    return count + 1


@kernel
def _set_ground(body: Body, points: Any, first: int, last: int, physics: Physics, f: int, rock: RockContext) -> None:
    """Write the number of facet f and its ground properties into the rows `first` to `last` - 1 of `points`."""
    if first == last:
        return
    surface = surface_of(physics.materials, physics.facets.zone[f], rock)
    for i in range(first, last):
        row = points[i]
        row[FACET], row[MU], row[ROLLING] = f, surface.mu, surface.mu_r * body.size
        row[RESTITUTION] = surface.R_n


@kernel
def keep_impulses(body: Body, before: Any, count: int, points: Any, now: int) -> None:
    """Copy the impulse of each contact of the previous step to the same contact now, as the first guess of the solver.

    Contacts are the same if they are on the same facet and near each other (KEPT).

    before : contacts of the previous step, of which `count` rows are used; the facet of a copied contact is set to -1
    points : contacts now, of which `now` rows are used
    """
    for i in range(now):
        row = points[i]
        for j in range(count):
            old = before[j]
            apart = norm(subtract(vector(old, ARM), vector(row, ARM)))
            if old[FACET] == row[FACET] and apart <= KEPT * body.reach:
                put(row, IMPULSE, vector(old, IMPULSE))
                old[FACET] = -1.0
                break


@kernel
def copy_contacts(points: Any, count: int, into: Any) -> None:
    """Copy the first `count` rows of contacts from `points` into another array."""
    for i in range(count):
        for column in range(CONTACT_COLUMNS):
            into[i, column] = points[i, column]
