"""Make convex polyhedra: the hull of points, its faces, and its volume, centre of mass and principal moments.

The hull comes from Qhull through scipy (Barber, Dobkin & Huhdanpaa 1996, ACM TOMS 22:469). Its triangles are merged
into polygons, because contacts need the true faces and edges of a rock. Volume, moments and axes are sums in a fixed
order; a library of linear algebra only decides whether a body is flat.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.formats.surface import FARTHEST
from rpf3d_core.shapes.principal_axes import principal_axes
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.welding import weld

Face = tuple[int, ...]
Tensor = tuple[tuple[float, ...], ...]
Triangles = NDArray[np.int64]

SAME_PLACE = 1e-6
"""Distance, as a share of the size of a body, within which points count as equal and triangles as in one plane (-)."""

FLAT = 1e-5
"""Thickness of a body, as a share (-) of its length, up to which the body counts as flat."""

SMALLEST = 1e-9
"""Smallest size (m) of a body; a smaller size comes from damage or from wrong units."""

FEWEST_FACES = 3
"""Least number of faces that meet at a corner of a polyhedron; a point where only two faces meet lies on an edge."""


class Polyhedron(NamedTuple):
    """A convex polyhedron of uniform density: centre of mass at the origin, principal axes, right-handed.

    name : of the shape, for messages
    corners : (C, 3) m, in the order in which the faces use them first
    faces : F polygons of corner numbers, anticlockwise as seen from outside
    normals : (F, 3) outward unit normals of the faces
    volume : m3
    moments : (3,) principal moments of inertia per unit of mass, ascending, m2
    """

    name: str
    corners: FloatArray
    faces: tuple[Face, ...]
    normals: FloatArray
    volume: float
    moments: FloatArray


def polyhedron_of(points: FloatArray, name: str) -> Polyhedron:
    """Return the convex hull of points as a polyhedron about its centre of mass, in its principal axes.

    The order of the points does not matter. The body is turned, not mirrored. If the input's axes are principal axes,
    the body keeps them, in the order of ascending moments.

    Points at most a millionth of the size of the body apart are one corner. Triangles that lie in the plane of a larger
    neighbour, within this distance, are part of its face. Volume and moments are those of the merged faces. They are
    exact to rounding, unless merged triangles are only nearly coplanar.

    points : (P, 3) m; name : of the shape, for messages

    Raises
    ------
    InputError
        The array is not (P, 3); fewer than 4 points differ; a coordinate is not finite or beyond FARTHEST; the points
        lie in one plane; or the body is smaller than SMALLEST.
    """
    points = _checked(points)
    faces = _faces(points, *_hull_triangles(points))
    used = list(dict.fromkeys(corner for face in faces for corner in face))
    number = {point: corner for corner, point in enumerate(used)}
    faces = [tuple(number[corner] for corner in face) for face in faces]
    corners = points[used]
    volume, centre = volume_and_centre(corners, faces)
    moments, axes = principal_axes(_inertia(corners - centre, faces, volume))
    corners = _along_axes(corners - centre, axes)
    return Polyhedron(
        name=name,
        corners=corners,
        faces=tuple(faces),
        normals=_normals(corners, faces),
        volume=volume,
        moments=np.array(moments),
    )


def scaled_to_volume(polyhedron: Polyhedron, volume: float) -> Polyhedron:
    """Return a polyhedron of the same shape with another volume (m3).

    Raises
    ------
    InputError
        The volume is not a positive, finite number.
    """
    if not 0.0 < volume < math.inf:
        raise InputError(f"the volume of a rock is {volume} m3; it must be a positive number")
    k = math.cbrt(volume / polyhedron.volume)
    return polyhedron._replace(corners=k * polyhedron.corners, volume=float(volume), moments=k * k * polyhedron.moments)


def hull_volume(points: FloatArray) -> float:
    """Return the volume (m3) of the convex hull of points (P, 3) m; raise InputError as `polyhedron_of` does."""
    points = _checked(points)
    triangles, _, _ = _hull_triangles(points)
    return volume_and_centre(points, triangles.tolist())[0]


def _checked(points: FloatArray) -> FloatArray:
    """Return points (P, 3) m, sorted and welded, relative to their mean.

    Raise InputError if the points make no solid, as in `polyhedron_of`.
    """
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"the corners of a rock must be points (x, y, z), but have the shape {points.shape}")
    if not (np.abs(points) <= FARTHEST).all():
        raise InputError(f"a corner is NaN, infinite or beyond {FARTHEST:,.0f} m; write a finite number, in metres")
    points = np.unique(points + 0.0, axis=0)  # + 0.0 turns -0.0 into 0.0
    if len(points) >= 4:
        points = points - points.mean(axis=0)
        points = weld(points, SAME_PLACE * _extent(points))[0]
    if len(points) < 4:
        raise InputError(f"the rock has {len(points)} different corners; a solid has at least 4")
    sizes = np.linalg.svd(points, compute_uv=False)
    if not sizes[2] > FLAT * sizes[0]:
        raise InputError("all corners of the rock lie in one plane; a rock must have a thickness")
    if _extent(points) < SMALLEST:
        raise InputError(f"the rock is {_extent(points):.1e} m long; its lengths must be in metres")
    return points


def _extent(points: FloatArray) -> float:
    """Return the largest extent (m) of points along an axis: the size that tolerances refer to."""
    return float(np.ptp(points, axis=0).max())


def _hull_triangles(points: FloatArray) -> tuple[Triangles, Triangles, FloatArray]:
    """Return the triangles of the hull of points (P, 3) m, with their neighbours and their outward unit normals.

    Triangles are sorted by area, the largest first, and their corners run anticlockwise as seen from outside.

    Results: triangles (T, 3) as point numbers, neighbours (T, 3) as triangle numbers, normals (T, 3).
    """
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    triangles = hull.simplices.astype(np.int64)
    neighbours = hull.neighbors.astype(np.int64)
    normals = np.ascontiguousarray(hull.equations[:, :3])
    a, b, c = (points[triangles[:, k]] for k in range(3))
    double = np.cross(b - a, c - a)
    largest = int(np.argmax((double * double).sum(axis=1)))
    inward = bool((double[largest] * normals[largest]).sum() < 0.0)
    turn = _wrong_way(triangles.tolist(), neighbours.tolist(), largest, inward)
    triangles[turn] = triangles[turn][:, ::-1]
    order = np.argsort(-(double * double).sum(axis=1), kind="stable")
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return triangles[order], place[neighbours[order]], normals[order]


def _wrong_way(triangles: list[list[int]], neighbours: list[list[int]], first: int, wrong: bool) -> NDArray[np.bool_]:
    """Return flags (T,), True for each triangle that is clockwise as seen from outside.

    Narrow triangles have no reliable normal. The direction is therefore passed from neighbour to neighbour, beginning
    with the triangle `first`, which has a known direction.

    triangles : T times three point numbers; neighbours : T times the numbers of three neighbouring triangles
    first : number of a triangle with a known direction; wrong : True if the triangle `first` is clockwise
    """
    found = {first: wrong}
    waiting = [first]
    while waiting:
        here = waiting.pop()
        sides = _sides(triangles[here])
        for there in neighbours[here]:
            if there not in found:
                same_direction = bool(sides & _sides(triangles[there]))
                found[there] = found[here] != same_direction
                waiting.append(there)
    return np.array([found[triangle] for triangle in range(len(triangles))])


def _sides(polygon: Sequence[int]) -> set[tuple[int, int]]:
    """Return the directed edges of a polygon, each as two point numbers."""
    return set(pairwise((*polygon, polygon[0])))


def _faces(points: FloatArray, triangles: Triangles, neighbours: Triangles, normals: FloatArray) -> list[Face]:
    """Return the faces of a hull: polygons of point numbers, made of neighbouring triangles in one plane.

    A point on an edge between two faces is left out, unless a third face has a corner there.

    points : (P, 3) m; triangles, neighbours, normals : from `_hull_triangles`
    """
    polygons = list[Face]()
    corners: list[Face] = [tuple(triangle) for triangle in triangles.tolist()]
    for group in _groups(points, triangles, neighbours.tolist(), normals):
        outline = _outline([corners[triangle] for triangle in group])
        polygons.extend([outline] if outline else [corners[triangle] for triangle in group])
    return _without_edge_points(polygons)


def _without_edge_points(polygons: list[Face]) -> list[Face]:
    """Return polygons without the points at which fewer than three polygons meet.

    A polygon with fewer than three remaining points is removed. Then fewer polygons meet at its points, so the search
    is repeated until nothing changes.
    """
    while True:
        meeting = np.bincount([corner for polygon in polygons for corner in polygon])
        cut = [tuple(corner for corner in polygon if meeting[corner] >= FEWEST_FACES) for polygon in polygons]
        cut = [polygon for polygon in cut if len(polygon) >= 3]
        if cut == polygons:
            return cut
        polygons = cut


def _groups(
    points: FloatArray, triangles: Triangles, neighbours: list[list[int]], normals: FloatArray
) -> list[list[int]]:
    """Return groups of connected triangles, as triangle numbers; each group lies in the plane of its first triangle.

    The triangles must be sorted by descending area, so that the largest triangle of each face defines the plane. The
    distance from the plane decides, not the angle. So a triangle that is too narrow for a normal joins its neighbour.

    points : (P, 3) m; triangles, neighbours, normals : from `_hull_triangles`
    """
    group_of = [-1] * len(neighbours)
    groups = list[list[int]]()
    tolerance = SAME_PLACE * _extent(points)
    for first in range(len(neighbours)):
        if group_of[first] >= 0:
            continue
        height = _along_axes(points - points[triangles[first, 0]], [normals[first]])
        near = (np.abs(height[:, 0])[triangles].max(axis=1) <= tolerance).tolist()
        group = [first]
        group_of[first] = len(groups)
        for here in group:  # the list grows during the loop
            for there in neighbours[here]:
                if near[there] and group_of[there] < 0:
                    group_of[there] = len(groups)
                    group.append(there)
        groups.append(group)
    return groups


def _outline(triangles: Sequence[Face]) -> Face | None:
    """Return the polygon around connected triangles, as point numbers, beginning with the smallest number.

    Return None if the outline is not one polygon.
    """
    sides = set[tuple[int, int]]().union(*map(_sides, triangles))
    rim = [(begin, end) for begin, end in sides if (end, begin) not in sides]
    following = dict(rim)
    outline = [min(following)]
    while (corner := following[outline[-1]]) != outline[0] and len(outline) < len(rim):
        outline.append(corner)
    return tuple(outline) if len(outline) == len(rim) == len(following) else None


def _fans(faces: Iterable[Sequence[int]]) -> Triangles:
    """Return triangles (T, 3) of corner numbers that fill the faces, as fans around the first corner of each face."""
    return np.array([(face[0], *side) for face in faces for side in pairwise(face[1:])])


def volume_and_centre(corners: FloatArray, faces: Iterable[Sequence[int]]) -> tuple[float, FloatArray]:
    """Return the volume (m3) and the centre of mass (3,) m of a solid, summed over tetrahedra with the origin.

    corners : (C, 3) m; faces : polygons of corner numbers, anticlockwise as seen from outside
    """
    a, b, c = (corners[column] for column in _fans(faces).T)
    sixfold = (a * np.cross(b, c)).sum(axis=1)
    total = sixfold.sum()
    centre: FloatArray = (sixfold[:, None] * (a + b + c)).sum(axis=0) / (4.0 * total)
    return float(total / 6.0), centre


def _inertia(corners: FloatArray, faces: Iterable[Sequence[int]], volume: float) -> Tensor:
    """Return the inertia tensor (3, 3) of a solid about the origin, per unit of mass (m2).

    The integral of x_i x_j over a tetrahedron with corners 0, a, b, c is V/20 times
    a_i a_j + b_i b_j + c_i c_j + s_i s_j, where s = a + b + c and V is the volume of the tetrahedron.

    corners, faces : as in `volume_and_centre`; volume : of the solid, m3
    """
    a, b, c = (corners[column] for column in _fans(faces).T)
    weight = (a * np.cross(b, c)).sum(axis=1) / (120.0 * volume)
    second = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            terms = (p[:, i] * p[:, j] for p in (a, b, c, a + b + c))
            second[i, j] = (weight * sum(terms)).sum()
    x, y, z = second[0, 0], second[1, 1], second[2, 2]
    tensor: Any = np.diag([y + z, x + z, x + y]) - (second - np.diag([x, y, z]))
    return tuple(map(tuple, tensor.tolist()))


def _along_axes(points: FloatArray, axes: Iterable[Sequence[float]]) -> FloatArray:
    """Return the components (P, A) m of points (P, 3) m along A axes, with 0.0 in place of -0.0."""
    x, y, z = points.T
    return np.stack([x * axis[0] + y * axis[1] + z * axis[2] + 0.0 for axis in axes], axis=1)


def _normals(corners: FloatArray, faces: Iterable[Sequence[int]]) -> FloatArray:
    """Return the outward unit normals (F, 3) of faces: the vector areas of the polygons, scaled to length 1.

    corners, faces : as in `volume_and_centre`
    """
    normals = list[FloatArray]()
    for face in faces:
        spokes = corners[list(face[1:])] - corners[face[0]]
        area = np.cross(spokes[:-1], spokes[1:]).sum(axis=0)
        normals.append(area / math.sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2]) + 0.0)
    return np.array(normals)
