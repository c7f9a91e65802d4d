"""Surveys as values: points in rows, triangles over points, or points alone; map frame, float64."""

from dataclasses import dataclass

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray

MOST_POINTS = 5_000_000
"""Largest number of points in a survey, unless the user sets another: 10 million facets; two grounds take 4.5 GB."""


@dataclass(frozen=True, eq=False)
class GridSurvey:
    """A survey of points in rows.

    points : (H, W, 3) m, map frame, H, W >= 2; NaN where there is a hole
    """

    points: FloatArray


@dataclass(frozen=True, eq=False)
class MeshSurvey:
    """A survey of triangles over points.

    vertices : (V, 3) m, map frame; triangles : (F, 3) indices into vertices
    """

    vertices: FloatArray
    triangles: IntArray


@dataclass(frozen=True, eq=False)
class CloudSurvey:
    """A survey of scattered points.

    points : (N, 3) m, map frame, in no order; a point with a NaN is ignored
    """

    points: FloatArray


Survey = GridSurvey | MeshSurvey | CloudSurvey


def points_of(survey: Survey) -> int:
    """Return the number of points in a survey; for a mesh its vertices, or half its triangles if that is more."""
    if isinstance(survey, MeshSurvey):
        return max(len(survey.vertices), len(survey.triangles) // 2)
    if isinstance(survey, GridSurvey):
        return int(survey.points.shape[0] * survey.points.shape[1])
    return len(survey.points)


def check_points(points: int, most: int = MOST_POINTS) -> None:
    """Refuse a survey of too many points, given the number that a message announces, before memory is used.

    Raises TerrainError, naming the limit.
    """
    if points > most:
        raise TerrainError(f"the survey has {points:,} points, more than the {most:,} that a survey may have")
