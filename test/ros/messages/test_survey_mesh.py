"""Tests of the mesh that is made of a received survey."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_core.errors import InputError
from rpf3d_core.live.ground import Workshop
from rpf3d_core.terrain.facets import facets_of
from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import GridSurvey, MeshSurvey

WELD = 1e-4
ROUNDING = 1e-9
"""Largest error (m) of coordinates of 1e4 m after a local origin is subtracted and added; a float64 step is 2e-12 m."""


def grid(height=4, width=5, at=0.0):
    y, x = np.mgrid[0:height, 0:width].astype(float)
    return np.stack([x + at, y + at, 0.1 * x], axis=-1)


def terrain_of(survey):
    return Workshop(WELD, reference=True).whole(survey).terrain


def test_a_grid_makes_two_facets_a_square():
    assert len(grid_mesh(grid()).triangles) == 2 * 3 * 4


def test_a_hole_takes_away_the_squares_around_it():
    points = grid()
    points[1, 1] = np.nan
    mesh = grid_mesh(points)
    assert len(mesh.triangles) == 2 * (3 * 4 - 4)
    assert np.isfinite(mesh.vertices).all()


def test_a_grid_without_a_full_square_is_refused():
    points = grid()
    points[1::2] = np.nan
    with pytest.raises(InputError, match="no square of four points"):
        grid_mesh(points)


@pytest.mark.parametrize("turned", [False, True])
def test_facets_look_up_whichever_way_the_rows_run(turned):
    points = grid()[::-1] if turned else grid()
    assert (facets_of(terrain_of(GridSurvey(points))).normals[:, 2] > 0.0).all()


def test_vertices_return_to_the_map_frame():
    terrain = terrain_of(GridSurvey(grid(at=12_345.0)))
    back = terrain.frame.points_to_input(terrain.vertices)
    assert np.allclose(back, grid(at=12_345.0).reshape(-1, 3), atol=ROUNDING, rtol=0.0)
    assert np.abs(terrain.vertices).max() < 10.0


def test_a_triangle_soup_is_welded():
    mesh = grid_mesh(grid())
    soup = MeshSurvey(mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(3 * len(mesh.triangles)).reshape(-1, 3))
    assert len(terrain_of(soup).vertices) == 4 * 5


def test_the_two_kinds_of_survey_give_the_same_terrain():
    from_grid = terrain_of(GridSurvey(grid()))
    from_mesh = terrain_of(grid_mesh(grid()))
    assert np.array_equal(from_grid.vertices[from_grid.triangles], from_mesh.vertices[from_mesh.triangles])
