"""Convert a received survey to a mesh."""

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.live.survey import GridSurvey, MeshSurvey
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.grid_triangles import grid_triangles

Survey = GridSurvey | MeshSurvey


def ground_mesh(survey: Survey) -> MeshSurvey:
    """Return a received survey as a mesh, for drawing or recording; points in rows are joined to triangles.

    Raises TerrainError for a grid without a complete square.
    """
    return grid_mesh(survey.points) if isinstance(survey, GridSurvey) else survey


def grid_mesh(points: FloatArray) -> MeshSurvey:
    """Return the mesh over points in rows, (H, W, 3) m, with NaN for a hole.

    Four neighbouring points form a square of two triangles. All squares are cut along the same diagonal, as the squares
    of an elevation grid (`terrain.grid_triangles`). A square with a hole at a corner is a hole. Raises TerrainError if
    no square is left.
    """
    there = ~np.isnan(points).any(axis=-1)
    triangles = grid_triangles(there)
    if not len(triangles):
        raise TerrainError("the grid has no square of four points without a hole; the terrain needs at least one")
    return MeshSurvey(points[there], triangles)
