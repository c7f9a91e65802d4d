"""The terrain as arrays: `Terrain` for general use, `Facets` for the engines.

Both engines read `Facets`. For the reference engine, `plain` converts the arrays so that indexing gives Python floats.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.terrain.frame import FloatArray, Frame
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, norm, scale, subtract

IntArray = NDArray[np.int32]

RELATIVE_TOLERANCE = 2.0**-40
"""Contact tolerance as a share of the terrain's diagonal (-).

A contact point is computed from coordinates up to the diagonal L with a few dozen roundings, each at most 2^-53 L. The
tolerance 2^-40 L is 200 times larger than their sum; on a pit of 1 km it is 1 nm.
"""


CRACK = 64.0
"""Width, in tolerances, up to which a gap between facets counts as a crack and is ignored.

The width is 2^-34 of the terrain's diagonal: 60 nm on a pit of 1 km, 3 nm on a scene of 60 m. The distance REACH of
`facet_geometry` includes this width, so the locators test all facets that may count.
"""
SURVEYED = 2.0**-57
"""Least contact tolerance as a share of the largest coordinate of the input (-), for small scenes far from the origin.

The input's coordinates are rounded by up to 2^-53 of their size before the origin is subtracted. A vertex on an
edge (T-junction) may then lie off the edge by 2^-51. CRACK = 64 tolerances cover that. Only scenes smaller than
2^-17 of their coordinates are affected: 35 m at a northing of 4,600 km.
"""


class Facets(NamedTuple):
    """The arrays of a terrain that the engines read, for the search for contacts and for motion on the ground.

    geometry : (12 F,) corners and normal of each facet, side by side, so that data used together share cache lines
    corners : (F, 9) m, local frame, three corners per facet, counter-clockwise seen from the free side
    normals : (F, 3) unit, towards the free side; zero for a facet without area, which no rock can touch
    zone : (F,) index into `Terrain.zones`
    low, high : corners of the bounding box, m
    tolerance : distance within which a point counts as on a facet, m
    crack : width up to which a crack between facets is ignored, m
    """

    geometry: Any
    corners: Any
    normals: Any
    zone: Any
    low: Vec
    high: Vec
    tolerance: float
    crack: float


WORLD = Frame()
"""The frame of a terrain whose input is already local: origin 0, z up."""


@dataclass(frozen=True, eq=False)
class Terrain:
    """The terrain as a welded triangle mesh with consistent winding, each facet in one zone.

    vertices : (V, 3) m, local frame, z up
    triangles : (F, 3) indices into vertices, counter-clockwise seen from the free side
    zone : (F,) index into zones
    zones : names, in order of first mention
    frame : conversion to the input's coordinates
    """

    vertices: FloatArray
    triangles: IntArray
    zone: IntArray
    zones: tuple[str, ...]
    frame: Frame = WORLD


def facets_of(terrain: Terrain) -> Facets:
    """Return the arrays of a terrain of F >= 1 facets that the engines read."""
    geometry, (low, high) = _geometry(terrain.vertices, terrain.triangles)
    zone = np.ascontiguousarray(terrain.zone, dtype=np.int32)
    return facets_from(geometry, zone, low, high, contact_tolerance(low, high, terrain.frame.origin))


def facets_from(geometry: FloatArray, zone: IntArray, low: Vec, high: Vec, tolerance: float) -> Facets:
    """Return the arrays of a terrain that the engines read, as views of the given arrays.

    geometry : (F, 12) the three corners (m) and the unit normal of each facet; zone : (F,) zone of each facet
    low, high : corners of the bounding box, m; tolerance : contact tolerance, m
    """
    corners, normals = geometry[:, :9], geometry[:, 9:]
    return Facets(
        geometry=geometry.reshape(-1),
        corners=corners,
        normals=normals,
        zone=zone,
        low=low,
        high=high,
        tolerance=tolerance,
        crack=CRACK * tolerance,
    )


def tolerance_of(terrain: Terrain) -> float:
    """Return the contact tolerance (m) of a terrain, without building the arrays; `facets_of` uses the same value."""
    used = np.zeros(len(terrain.vertices), bool)  # a mask, because sorting the vertices takes eight times as long
    used[terrain.triangles] = True
    corners = terrain.vertices[used]
    low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return contact_tolerance(low, high, terrain.frame.origin)


def contact_tolerance(low: Sequence[float], high: Sequence[float], origin: Sequence[float]) -> float:
    """Return the contact tolerance (m): the distance within which a point counts as on a facet of a terrain.

    low, high : (3,) m, corners of the terrain's box; origin : (3,) m, of the terrain's frame
    """
    largest = max(abs(o) + max(abs(a), abs(b)) for o, a, b in zip(origin, low, high, strict=True))
    return max(RELATIVE_TOLERANCE * math.dist(low, high), SURVEYED * largest)


def unit_normals(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the unit normals (F, 3) of facets; zero for a facet without area.

    vertices : (V, 3) m; triangles : (F, 3)
    """
    return _geometry(vertices, triangles)[0][:, 9:]


def area_vectors(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the normals (F, 3) m^2 of facets; the length of each normal is the area of its facet.

    vertices : (V, 3) m; triangles : (F, 3)
    """
    areas = np.empty((len(triangles), 3))
    _measure(*_as_the_loops_want(vertices, triangles), areas)
    return areas


def _geometry(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, tuple[Vec, Vec]]:
    """Return the corners (m) and unit normal of each facet as rows (F, 12), and both corners (m) of the bounding box.

    vertices : (V, 3) m; triangles : (F, 3)
    """
    geometry, box = np.empty((len(triangles), 12)), np.array([[np.inf] * 3, [-np.inf] * 3])
    lay_out(*_as_the_loops_want(vertices, triangles), 0, len(triangles), geometry, box)
    (x, y, z), (u, v, w) = box.tolist()
    return geometry, ((x, y, z), (u, v, w))


def _as_the_loops_want(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Return vertices (V, 3) m and triangles (F, 3) as contiguous float64 and int32 arrays, for compiled loops.

    Arrays that already have this layout are not copied.
    """
    return np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(triangles, dtype=np.int32)


@kernel
def area_vector(a: Vec, b: Vec, c: Vec) -> Vec:
    """Return the normal (3,) m^2 of the triangle a b c (corners in m); its length is the triangle's area."""
    return scale(0.5, cross(subtract(b, a), subtract(c, a)))


@kernel
def _unit_normal(area: Vec) -> Vec:
    """Return the unit normal of a triangle from `area_vector` (3,) m^2; zero if the triangle has no area."""
    length = norm(area)
    if length > 0.0:
        return area[0] / length, area[1] / length, area[2] / length
    return 0.0, 0.0, 0.0


@kernel
def vertex(vertices: Any, v: int) -> Vec:
    """Return the coordinates (m) of one vertex from the array of vertices (V, 3)."""
    return vertices[v, 0], vertices[v, 1], vertices[v, 2]


@loop
def _measure(vertices: Any, triangles: Any, areas: Any) -> None:
    """Write the normal of each facet, with the facet's area as its length (m^2), into `areas` (F, 3).

    vertices : (V, 3) m; triangles : (F, 3)
    """
    for f in range(len(triangles)):
        a, b, c = (vertex(vertices, triangles[f, 0]), vertex(vertices, triangles[f, 1]),
                   vertex(vertices, triangles[f, 2]))  # fmt: skip
        areas[f, 0], areas[f, 1], areas[f, 2] = area_vector(a, b, c)


@loop
def lay_out(vertices: Any, triangles: Any, begin: int, end: int, geometry: Any, box: Any) -> None:
    """Write the corners (m) and unit normals of facets `begin` to `end` - 1 into their rows of `geometry` (F, 12).

    Also extend the terrain's `box` (2, 3) m, its lowest and highest corner, so that it includes these facets.

    vertices : (V, 3) m; triangles : (F, 3)
    """
    for f in range(begin, end):
        a, b, c = (vertex(vertices, triangles[f, 0]), vertex(vertices, triangles[f, 1]),
                   vertex(vertices, triangles[f, 2]))  # fmt: skip
        n = _unit_normal(area_vector(a, b, c))
        for axis in range(3):
            geometry[f, axis], geometry[f, 3 + axis], geometry[f, 6 + axis] = a[axis], b[axis], c[axis]
            geometry[f, 9 + axis] = n[axis]
            box[0, axis] = min(box[0, axis], a[axis], b[axis], c[axis])
            box[1, axis] = max(box[1, axis], a[axis], b[axis], c[axis])


@loop
def lay_out_some(vertices: Any, triangles: Any, rows: Any, geometry: Any) -> None:
    """Write the corners (m) and unit normals of the facets listed in `rows` into their rows of `geometry` (F, 12).

    Only these facets have changed, as after a patch.

    vertices : (V, 3) m; triangles : (F, 3); rows : (N,) numbers of the facets
    """
    for n in range(len(rows)):
        f = rows[n]
        a, b, c = (vertex(vertices, triangles[f, 0]), vertex(vertices, triangles[f, 1]),
                   vertex(vertices, triangles[f, 2]))  # fmt: skip
        normal = _unit_normal(area_vector(a, b, c))
        for axis in range(3):
            geometry[f, axis], geometry[f, 3 + axis], geometry[f, 6 + axis] = a[axis], b[axis], c[axis]
            geometry[f, 9 + axis] = normal[axis]


@loop
def widen_to_corners(corners: Any, marks: Any, begin: int, end: int, box: Any) -> None:
    """Extend a box to include all unmarked facets from `begin` to `end` - 1.

    corners : (F, 9) m; marks : (F,) 0 for an unmarked facet; box : (2, 3) m, lowest and highest corner, changed
    """
    for f in range(begin, end):
        if marks[f] == 0:
            for k in range(9):
                box[0, k % 3], box[1, k % 3] = min(box[0, k % 3], corners[f, k]), max(box[1, k % 3], corners[f, k])


def plain(value: Any) -> Any:
    """Return a copy of a record (and its nested records) with memoryviews in place of arrays, for the reference engine.

    A memoryview shares the memory of its array. Indexing a memoryview gives Python floats, five times as fast as
    indexing a NumPy array.
    """
    return type(value)(*(_plain_part(part) for part in value))


def _plain_part(part: Any) -> Any:
    if isinstance(part, np.ndarray):
        return memoryview(part.data)
    return plain(part) if hasattr(part, "_fields") else part
