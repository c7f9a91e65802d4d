"""The content of a terrain file, as all readers return it: points and the triangles between them."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.units import LENGTHS, METRE

MOST_TRIANGLES = (2**31 - 1) // 3
"""Largest number of facets of a terrain, because facets, vertices and facet sides are numbered with 32 bits."""

FARTHEST = 1e9
"""Largest coordinate (m) that is accepted: up to here, float64 resolves a micrometre.

Larger values come from damage or from wrong units.
"""


class FileMesh(NamedTuple):
    """The points and triangles of one terrain file, exactly as in the file: same axes, order and winding, not welded.

    points : (N, 3) float32 or float64, in the unit of the file, which the reader does not convert
    triangles : (F, 3) int32, indices into points; None if every three consecutive points are the corners of one facet
    zone : (F,) int32, indices into zones; None if the file states no zones
    zones : names of the layers or surfaces of the file, which become zones
    remarks : sentences on content of the file that was not read, and on assumptions of the reader
    crs : the coordinate reference system that the file states; None if it states none
    unit : unit of the points that the file states, a key of `units.LENGTHS`; None if it states no unit
    """

    points: NDArray[Any]
    triangles: NDArray[np.int32] | None = None
    zone: NDArray[np.int32] | None = None
    zones: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    crs: str | None = None
    unit: str | None = None


def facet_count(surface: FileMesh) -> int:
    """Return the number F of triangles in the content of a terrain file."""
    return len(surface.points) // 3 if surface.triangles is None else len(surface.triangles)


FAR_AWAY = "coordinates are metres"
"""Advice in the error about points that are too far from the origin, if the user cannot give a unit."""


def in_metres(surface: FileMesh, unit: str | None) -> FileMesh:
    """Return a surface with its points in metres; the field `unit` stays that of the file.

    unit : unit of the points, a key of `units.LENGTHS`; None for metres
    """
    if unit is None or unit == METRE:
        return surface
    return surface._replace(points=surface.points.astype(float) * LENGTHS[unit][1])


def usable(path: Path, surface: FileMesh, metres: float = 1.0, remedy: str = FAR_AWAY) -> FileMesh:
    """Check the content of a mesh file, and return it without the points that no facet uses.

    metres : length of the unit of the points (m)
    remedy : what the user can do about points that are too far from the origin

    Raises
    ------
    TerrainError
        The surface is empty, has too many facets, has points that are not finite or too far from the origin, or has
        facets with missing points; the message names the file.
    """
    facets = facet_count(surface)
    if facets == 0:
        raise TerrainError(f"{path}: holds no triangles; a terrain needs at least one")
    if max(facets, len(surface.points) // 3) > MOST_TRIANGLES:
        raise TerrainError(f"{path}: holds {facets:,} triangles, more than the {MOST_TRIANGLES:,} that can be numbered")
    if surface.triangles is not None:
        refuse_wrong_indices(path, surface.triangles, len(surface.points))
        surface = _used_only(surface, surface.triangles)
    farthest = FARTHEST / metres
    if not all(column.min() >= -farthest and column.max() <= farthest for column in surface.points.T):
        _refuse_wrong_points(path, surface, farthest, remedy)
    return surface


def refuse_wrong_indices(path: Path, corners: NDArray[Any], points: int) -> None:
    """Raise a TerrainError if a facet refers to a point that does not exist.

    corners : point indices, in an array of any shape; points : number of points
    """
    if corners.size and (corners.min() < 0 or corners.max() >= points):
        wrong = corners[(corners < 0) | (corners >= points)].flat[0]
        raise TerrainError(f"{path}: a facet names point {wrong}, but the file has points 0 to {points - 1}")


def _used_only(surface: FileMesh, triangles: NDArray[np.int32]) -> FileMesh:
    """Return the mesh without unused points; the remaining points keep their order and are numbered again.

    triangles : (F, 3) the triangles of `surface`
    """
    used = np.zeros(len(surface.points), bool)
    used[triangles] = True
    if used.all():
        return surface
    number = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return surface._replace(points=surface.points[used], triangles=number[triangles])


def _refuse_wrong_points(path: Path, surface: FileMesh, farthest: float, remedy: str) -> None:
    """Raise a TerrainError that names the first facet with a vertex that is NaN, infinite or beyond `farthest`.

    farthest : largest coordinate, in the unit of the file; remedy : as in `usable`
    """
    wrong = ~(np.abs(surface.points) <= farthest).all(axis=1)
    corners = wrong if surface.triangles is None else wrong[surface.triangles]
    facets = np.flatnonzero(corners.reshape(-1, 3).any(axis=1))
    first = 3 * facets[0] + np.arange(3) if surface.triangles is None else surface.triangles[facets[0]]
    if np.isfinite(surface.points[first]).all():
        fault, right = f"{FARTHEST:,.0f} m or more from the origin", remedy
    else:
        fault, right = "NaN or infinite", "every coordinate must be a finite number"
    of = f"{len(facets):,} of {facet_count(surface):,} facets"
    raise TerrainError(
        f"{path}: facet number {facets[0]} (from 0) has a vertex that is {fault} ({of} have one); {right}"
    )
