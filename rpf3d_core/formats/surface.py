"""The content of a terrain file: points and the triangles between them."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError

MOST_TRIANGLES = (2**31 - 1) // 3
"""Largest number of facets, because facets, vertices and sides of facets are counted in 32 bits."""

FARTHEST = 1e9
"""Largest coordinate (m): float64 still resolves a micrometre. Larger values come from damage or from wrong units."""


class FileMesh(NamedTuple):
    """The content of one file, in its own axes, order and winding, not welded.

    points : (N, 3) float32 or float64, m
    triangles : (F, 3) int32, indices into points; None if points 3 f, 3 f + 1, 3 f + 2 are the corners of facet f
    """

    points: NDArray[Any]
    triangles: NDArray[np.int32] | None = None


def facet_count(surface: FileMesh) -> int:
    """Return the number of triangles F."""
    return len(surface.points) // 3 if surface.triangles is None else len(surface.triangles)


def usable(path: Path, surface: FileMesh) -> FileMesh:
    """Return the checked surface without the points that no facet uses.

    Raises
    ------
    TerrainError
        If the surface is empty, too large, not finite, too far from the origin, or has facets on points that do not
        exist; names the file.
    """
    facets = facet_count(surface)
    if facets == 0:
        raise TerrainError(f"{path}: holds no triangles; a terrain needs at least one")
    if max(facets, len(surface.points) // 3) > MOST_TRIANGLES:
        raise TerrainError(f"{path}: holds {facets:,} triangles, more than the {MOST_TRIANGLES:,} that can be numbered")
    if surface.triangles is not None:
        refuse_wrong_indices(path, surface.triangles, len(surface.points))
        surface = _used_only(surface.points, surface.triangles)
    if not all(column.min() >= -FARTHEST and column.max() <= FARTHEST for column in surface.points.T):
        _refuse_wrong_points(path, surface)
    return surface


def refuse_wrong_indices(path: Path, corners: NDArray[Any], points: int) -> None:
    """Raise a TerrainError if corners, an index array of any shape, name points that do not exist."""
    if corners.size and (corners.min() < 0 or corners.max() >= points):
        wrong = corners[(corners < 0) | (corners >= points)].flat[0]
        raise TerrainError(f"{path}: a facet names point {wrong}, but the file has points 0 to {points - 1}")


def _used_only(points: NDArray[Any], triangles: NDArray[np.int32]) -> FileMesh:
    """Return the mesh with the points that facets use only, renumbered in the same order."""
    used = np.zeros(len(points), bool)
    used[triangles] = True
    if used.all():
        return FileMesh(points, triangles)
    number = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return FileMesh(points[used], number[triangles])


def _refuse_wrong_points(path: Path, surface: FileMesh) -> None:
    """Raise a TerrainError for a surface with a point that is NaN, infinite or too far from the origin."""
    wrong = ~(np.abs(surface.points) <= FARTHEST).all(axis=1)
    corners = wrong if surface.triangles is None else wrong[surface.triangles]
    facets = np.flatnonzero(corners.reshape(-1, 3).any(axis=1))
    if np.isfinite(surface.points).all():
        fault, right = f"{FARTHEST:,.0f} m or more away from the origin", "coordinates are metres"
    else:
        fault, right = "NaN or infinite", "every coordinate must be a finite number"
    raise TerrainError(
        f"{path}: facet number {facets[0]} (from 0) has a vertex that is {fault}, as {len(facets)} in all; {right}"
    )
