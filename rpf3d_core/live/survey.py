"""Surveys of a terrain as they arrive in messages: points in rows, triangles, or scattered points; map frame."""

from dataclasses import dataclass

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
