"""Convert a received survey to a mesh."""

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, MeshSurvey, Survey
from rpf3d_core.terrain.cloud import cloud_mesh
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.grid_triangles import grid_triangles


def ground_mesh(survey: Survey) -> MeshSurvey:
    """Return a received survey as a mesh, for drawing or recording; points are joined to triangles.

    Scattered points are joined with the default longest side of `terrain.cloud.cloud_mesh`, and grids without a limit,
    so the triangles differ from the simulator's terrain if its parameter `longest_edge` is set.

    Raises TerrainError for a grid without a complete square, and for scattered points without a triangle.
    """
    if isinstance(survey, GridSurvey):
        return grid_mesh(survey.points)
    if isinstance(survey, CloudSurvey):
        mesh = cloud_mesh(survey.points)
        return MeshSurvey(mesh.vertices + np.array(mesh.origin), mesh.triangles)
    return survey


def grid_mesh(points: FloatArray) -> MeshSurvey:
    """Return the mesh over points in H rows and W columns, (H, W, 3) m; a point with a NaN is a hole.

    Four neighbouring points form a square of two triangles. All squares are cut along the same diagonal, as the squares
    of an elevation grid (`terrain.grid_triangles`). A square with a hole at a corner is a hole. Raises TerrainError if
    no square is left.
    """
    there = ~np.isnan(points).any(axis=-1)
    triangles = grid_triangles(there)
    if not len(triangles):
        raise TerrainError("the grid has no square of four points without a hole; the terrain needs at least one")
    return MeshSurvey(points[there], triangles)
