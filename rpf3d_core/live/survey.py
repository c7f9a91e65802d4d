"""Surveys of a terrain as they arrive in messages: points in rows, triangles, or scattered points; map frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray

MOST_POINTS = 5_000_000
"""Largest number of points in a survey, unless the user sets another number, to limit memory.

5 million points give 10 million facets; two such terrains take 4.5 GB.
"""


@dataclass(frozen=True, eq=False)
class GridSurvey:
    """A survey whose points lie in rows, as from a scanner.

    points : (H, W, 3) m, map frame, H, W >= 2; NaN where there is a hole
    """

    points: FloatArray


@dataclass(frozen=True, eq=False)
class MeshSurvey:
    """A survey that is a mesh: points, and triangles between them.

    vertices : (V, 3) m, map frame; triangles : (F, 3) indices into vertices
    """

    vertices: FloatArray
    triangles: IntArray


@dataclass(frozen=True, eq=False)
class CloudSurvey:
    """A survey of scattered points, between which rpf3d makes the triangles itself.

    points : (N, 3) m, map frame, in no order; a point with a NaN is ignored
    """

    points: FloatArray


Survey = GridSurvey | MeshSurvey | CloudSurvey


def points_of(survey: Survey) -> int:
    """Return the number of points in a survey, to compare it with a limit.

    For a mesh, this is the larger of two numbers: the number of vertices, and half the number of triangles.
    """
    if isinstance(survey, MeshSurvey):
        return max(len(survey.vertices), len(survey.triangles) // 2)
    if isinstance(survey, GridSurvey):
        return int(survey.points.shape[0] * survey.points.shape[1])
    return len(survey.points)


def check_points(points: int, most: int = MOST_POINTS) -> None:
    """Raise TerrainError if a survey has more than `most` points; call this before memory is used for the survey.

    points : number of points that the message announces
    """
    if points > most:
        raise TerrainError(f"the survey has {points:,} points; at most {most:,} are allowed (most_points)")


def points_missing_inside(survey: GridSurvey) -> int:
    """Return the number of points of a grid that are holes inside the grid: surrounded by points that are not NaN.

    Holes that reach the border of the grid do not count: the survey may have another outline than its grid.
    """
    missing = np.asarray(np.isnan(survey.points).any(axis=-1))
    if not missing.any():
        return 0
    outside = np.zeros_like(missing)
    for edge in (np.s_[0, :], np.s_[-1, :], np.s_[:, 0], np.s_[:, -1]):
        outside[edge] = missing[edge]
    count = -1
    while count != (count := int(outside.sum())):  # the holes at the border grow inwards
        for axis in (0, 1):
            _grow(outside, missing, axis)
    return int((missing & ~outside).sum())


def _grow(outside: NDArray[np.bool_], missing: NDArray[np.bool_], axis: int) -> None:
    """Extend the holes `outside` along an axis through neighbouring missing points, in both directions, in place."""
    lines, gaps = np.moveaxis(outside, axis, 0), np.moveaxis(missing, axis, 0)
    for i in range(1, len(lines)):
        lines[i] |= lines[i - 1] & gaps[i]
    for i in range(len(lines) - 2, -1, -1):
        lines[i] |= lines[i + 1] & gaps[i]
