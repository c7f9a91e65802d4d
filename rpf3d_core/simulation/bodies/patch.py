"""The polygon in which a face of a body lies over a facet of the terrain; its corners are contacts of the body."""

from typing import Any

from rpf3d_core.body.distance import lowest
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.simulation.bodies.motion import Body
from rpf3d_core.simulation.bodies.room import POLYGON, BodyRoom
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, dot, subtract

FACING = 0.5
"""Smallest cosine of the angles of a contact's normal with the normals of facet and face, for a polygon (-)."""
MOST = 4
"""Largest number of corners of a polygon that become contacts; more contacts would not change the motion."""


@kernel
def facing_face(body: Body, n: Vec) -> int:
    """Return the number of the body's face whose normal is nearest to -n; -1 if its angle to -n is too large (FACING).

    n : (3,) unit normal of a contact, from the ground to the body, in the body's axes
    """
    normals, shape = body.shapes.normals, body.shape
    face = lowest(normals, body.shapes.face_first[shape], body.shapes.face_first[shape + 1], n)
    return face if normals[face, 0] * n[0] + normals[face, 1] * n[1] + normals[face, 2] * n[2] < -FACING else -1


@kernel
def _point(polygon: Any, i: int) -> Vec:
    return polygon[i, 0], polygon[i, 1], polygon[i, 2]


@kernel
def _put(polygon: Any, i: int, p: Vec) -> None:
    polygon[i, 0], polygon[i, 1], polygon[i, 2] = p


@kernel
def _lay_out(body: Body, polygon: Any, face: int) -> int:
    """Write the corners (m) of a face, in the body's axes, into columns 0 to 2 of `polygon`; return their number."""
    shapes = body.shapes
    first, count = shapes.faces[face, 0], int(min(shapes.faces[face, 1], POLYGON - 3))
    for i in range(count):
        row = body.first + shapes.ring[first + i]
        for axis in range(3):
            polygon[i, axis] = body.size * shapes.corners[row, axis]
    return count


@kernel
def _clip(polygon: Any, count: int, clipped: Any, inward: Vec, a: Vec) -> int:
    """Write the part of a polygon on one side of a plane into `clipped`; return the number of its corners.

    polygon : its first `count` rows are the corners; inward, a : (3,) normal towards this side, and a point (m) of the
        plane
    Source: Sutherland & Hodgman 1974, Communications of the ACM 17:32.
    """
    kept = 0
    for i in range(count):
        p, q = _point(polygon, i), _point(polygon, (i + 1) % count)
        here, there = dot(inward, subtract(p, a)), dot(inward, subtract(q, a))
        if here >= 0.0 and kept < POLYGON:
            _put(clipped, kept, p)
            kept += 1
        if (here < 0.0) != (there < 0.0) and kept < POLYGON:
            s = here / (here - there)
            _put(clipped, kept, (p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1]), p[2] + s * (q[2] - p[2])))
            kept += 1
    return kept


@routine
def contact_polygon(body: Body, room: BodyRoom, facet: tuple[Vec, Vec, Vec], m: Vec, n: Vec, band: float) -> int:
    """Write the polygon in which a face of the body covers a facet into `room.polygon`; return its number of corners.

    Body and facet are seen along the normal of the contact. A row of the polygon has a corner (m), in the body's axes,
    and its gap (m) along this normal. At most MOST corners are kept, as `_spanning` selects them. The result is 0 if
    the facet, or every face of the body, is inclined by more than 60 degrees to the plane of the contact (FACING), or
    if no corner has a gap of at most `band`. `room.clipped` is overwritten.

    facet : the facet's corners (m); m : its normal towards the body; n : normal of the contact; all in the body's axes
    band : largest gap (m) of a corner of the polygon; corners with a larger gap are omitted
    """
    face = facing_face(body, n)
    facing = dot(m, n)
    if face < 0 or facing < FACING:
        return 0
    polygon, clipped = room.polygon, room.clipped
    count = _lay_out(body, polygon, face)
    turn = 1.0 if dot(cross(subtract(facet[1], facet[0]), subtract(facet[2], facet[0])), m) > 0.0 else -1.0
    for side in range(3):
        a = facet[0] if side == 0 else (facet[1] if side == 1 else facet[2])
        b = facet[1] if side == 0 else (facet[2] if side == 1 else facet[0])
        inward = cross(n, subtract(b, a))
        inward = (turn * inward[0], turn * inward[1], turn * inward[2])
        count = _clip(polygon, count, clipped, inward, a)
        polygon, clipped = clipped, polygon
    kept = 0
    for i in range(count):
        p = _point(polygon, i)
        gap = dot(m, subtract(p, facet[0])) / facing
        if gap <= band:
            _put(room.polygon, kept, p)
            room.polygon[kept, 3] = gap
            kept += 1
    return _spanning(room.polygon, kept, n)


@kernel
def _swap(polygon: Any, i: int, j: int) -> None:
    for column in range(4):
        keep = polygon[i, column]
        polygon[i, column] = polygon[j, column]
        polygon[j, column] = keep


@kernel
def _spanning(polygon: Any, count: int, n: Vec) -> int:
    """Move the corners of a polygon that become contacts to its first rows; return their number, at most MOST.

    Up to MOST corners all become contacts. Of more corners, these are selected: the corner with the smallest gap, the
    corner farthest from this corner, and on each side of the line through both the corner farthest from this line.

    polygon : (POLYGON, 4), of which `count` rows are used; n : (3,) normal of the contact
    """
    if count <= MOST:
        return count
    best, at = polygon[0, 3], 0
    for i in range(1, count):
        if polygon[i, 3] < best:
            best, at = polygon[i, 3], i
    _swap(polygon, 0, at)
    first, best = _point(polygon, 0), -1.0
    for i in range(1, count):
        away = subtract(_point(polygon, i), first)
        if dot(away, away) > best:
            best, at = dot(away, away), i
    _swap(polygon, 1, at)
    along = subtract(_point(polygon, 1), first)
    most, least, left, right = 0.0, 0.0, -1, -1
    for i in range(2, count):
        area = dot(n, cross(along, subtract(_point(polygon, i), first)))
        if area > most:
            most, left = area, i
        if area < least:
            least, right = area, i
    kept = 2
    if left >= 0:
        _swap(polygon, kept, left)
        right = left if right == kept else right
        kept += 1
    if right >= 0:
        _swap(polygon, kept, right)
        kept += 1
    return kept
