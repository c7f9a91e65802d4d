"""Terrain as arrays: `Terrain` for people, `Facets` for the kernels.

Both engines read `Facets`; the reference engine through `plain`, which hands out Python floats.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray, Frame
from rpf3d_core.values import Vec

IntArray = NDArray[np.int32]

BLOCK = 16_384
"""Facets that are laid out at a time: 3 MB."""

RELATIVE_TOLERANCE = 2.0**-40
"""Contact tolerance over the terrain's diagonal (-).

A contact point is computed from coordinates no larger than the diagonal L with a few dozen roundings, each at most
2^-53 L; 2^-40 L leaves a factor of 200 above that, and is 1 nm on a pit of 1 km.
"""


class Facets(NamedTuple):
    """What the kernels know of a terrain.

    geometry : (12 F,) of each facet what follows, side by side: what is looked at together shares lines of the cache
    corners : (F, 9) m, local frame, three corners a facet, counter-clockwise seen from the free side
    normals : (F, 3) unit, towards the free side; zero for a facet without area, which no rock can touch
    zone : (F,) index into `Terrain.zones`
    low, high : corners of the bounding box, m
    tolerance : distance within which a point counts as on a facet, m
    """

    geometry: Any
    corners: Any
    normals: Any
    zone: Any
    low: Vec
    high: Vec
    tolerance: float


WORLD = Frame()
"""The frame of a terrain that is local already: origin 0, z up."""


@dataclass(frozen=True, eq=False)
class Terrain:
    """A welded triangle mesh with consistent winding, each facet in one zone.

    vertices : (V, 3) m, local frame, z up
    triangles : (F, 3) indices into vertices, counter-clockwise seen from the free side
    zone : (F,) index into zones
    zones : names, in order of first mention
    frame : how to return to the input's coordinates
    """

    vertices: FloatArray
    triangles: IntArray
    zone: IntArray
    zones: tuple[str, ...]
    frame: Frame = WORLD


def facets_of(terrain: Terrain) -> Facets:
    """The arrays that the kernels read, made from a terrain of F >= 1 facets."""
    geometry = np.empty((len(terrain.triangles), 12))
    for some in _blocks(len(terrain.triangles)):
        corners = terrain.vertices[terrain.triangles[some].ravel()].reshape(-1, 9)
        geometry[some, :9] = corners
        geometry[some, 9:] = unit_normals(_areas_of_corners(corners))
    low = (float(geometry[:, 0:9:3].min()), float(geometry[:, 1:9:3].min()), float(geometry[:, 2:9:3].min()))
    high = (float(geometry[:, 0:9:3].max()), float(geometry[:, 1:9:3].max()), float(geometry[:, 2:9:3].max()))
    return Facets(
        geometry=geometry.reshape(-1),
        corners=geometry[:, :9],
        normals=geometry[:, 9:],
        zone=np.ascontiguousarray(terrain.zone, dtype=np.int32),
        low=low,
        high=high,
        tolerance=RELATIVE_TOLERANCE * math.dist(low, high),
    )


def tolerance_of(terrain: Terrain) -> float:
    """The tolerance of contacts (m) with the facets of a terrain, as `facets_of` tells it."""
    corners = terrain.vertices[np.unique(terrain.triangles)]
    low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return RELATIVE_TOLERANCE * math.dist(low, high)


def unit_normals(areas: FloatArray) -> FloatArray:
    """Unit normals (F, 3) of area vectors (F, 3); zero where a facet has no area."""
    length = np.sqrt(areas[:, 0] ** 2 + areas[:, 1] ** 2 + areas[:, 2] ** 2)[:, None]
    return np.divide(areas, length, out=np.zeros_like(areas), where=length > 0.0)


def area_vectors(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """The area of each facet times its unit normal (F, 3), m^2, from vertices (V, 3) m and triangles (F, 3)."""
    areas = np.empty((len(triangles), 3))
    for some in _blocks(len(triangles)):
        areas[some] = _areas_of_corners(vertices[triangles[some].ravel()].reshape(-1, 9))
    return areas


def _areas_of_corners(corners: FloatArray) -> FloatArray:
    """Area vectors (N, 3) m^2 of corners (N, 9) m; column by column, which is four times as fast as np.cross."""
    ux, uy, uz = (corners[:, 3:6] - corners[:, 0:3]).T
    wx, wy, wz = (corners[:, 6:9] - corners[:, 0:3]).T
    areas = np.empty((len(corners), 3))
    areas[:, 0] = 0.5 * (uy * wz - uz * wy)
    areas[:, 1] = 0.5 * (uz * wx - ux * wz)
    areas[:, 2] = 0.5 * (ux * wy - uy * wx)
    return areas


def _blocks(facets: int) -> Iterator[slice]:
    """All facets, so many at a time that what is made of them on the way stays in the cache: half the time."""
    return (slice(begin, begin + BLOCK) for begin in range(0, facets, BLOCK))


def plain(value: Any) -> Any:
    """The same record with memoryviews for arrays: indexing them gives Python floats, five times as fast as NumPy.

    Records within it, however deep, alike.
    """
    return type(value)(*(_plain_part(part) for part in value))


def _plain_part(part: Any) -> Any:
    if isinstance(part, np.ndarray):
        return memoryview(part.data)
    return plain(part) if hasattr(part, "_fields") else part
