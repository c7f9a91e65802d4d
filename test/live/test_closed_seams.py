"""Tests that the seams of a mesh survey with rounded T-junctions are closed in a live terrain, also under patches."""

import numpy as np
import pytest
from flights.scenes_of_facets import rough_grid
from meshes.rounded_seams import free_sides_inside, rough_ground, rounded, sides_of, with_t_junctions

from rpf3d_core.live.ground import LiveTerrain, Workshop
from rpf3d_core.live.survey import GridSurvey, MeshSurvey
from rpf3d_core.terrain.facets import Terrain

SIZE = 20.0
OUTLINE = np.array([[0.0, 0.0], [SIZE, SIZE]])


def in_place(ground: LiveTerrain) -> Terrain:
    """Return the terrain of a live terrain in the coordinates of the survey, without removed facets."""
    terrain = ground.terrain
    kept = np.setdiff1d(np.arange(len(terrain.triangles)), ground.room.free_rows)
    vertices = terrain.vertices + np.array(terrain.frame.origin)
    return Terrain(vertices, terrain.triangles[kept], terrain.zone[kept], terrain.zones)


def survey_of(seed: int) -> tuple[MeshSurvey, Terrain]:
    draw = np.random.default_rng(seed)
    terrain = rounded(with_t_junctions(draw, rough_ground(draw, SIZE)), 3)
    return MeshSurvey(terrain.vertices, terrain.triangles), terrain


@pytest.mark.parametrize("seed", range(5))
def test_a_whole_survey_is_closed(seed):
    survey, terrain = survey_of(seed)
    ground = Workshop().whole(survey)
    made = in_place(ground)
    assert free_sides_inside(terrain, OUTLINE) > 100 and free_sides_inside(made, OUTLINE) == 0
    assert max(sides_of(made.triangles).values()) == 2
    assert len(made.triangles) == len(ground.facets.zone) == len(ground.facets.normals)
    assert ground.closed_seams > 50
    assert len(ground.border.sides) == sum(uses == 1 for uses in sides_of(made.triangles).values())


@pytest.mark.parametrize("seed", range(3))
def test_a_patch_over_closed_seams_opens_none(seed):
    survey, _ = survey_of(seed)
    workshop = Workshop()
    x, y = np.meshgrid(np.arange(6.0, 13.0, 0.7), np.arange(5.0, 14.0, 0.6))
    patch = GridSurvey(np.stack([x, y, 1.0 - 0.5 * x], axis=2))
    ground = workshop.patched(workshop.whole(survey), patch)
    made = in_place(ground)
    assert ground.patches == 1 and ground.closed_seams > 50
    assert free_sides_inside(made, OUTLINE) == 0 and max(sides_of(made.triangles).values()) == 2


def test_a_survey_without_seams_keeps_its_triangles():
    grid = rough_grid(12, 30.0, 0.3, 0.5)
    ground = Workshop().whole(MeshSurvey(grid.vertices, grid.triangles))
    assert ground.closed_seams == 0
    assert np.array_equal(ground.terrain.triangles, grid.triangles)


def test_memory_is_reused_after_a_survey_with_seams():
    workshop, grid = Workshop(), rough_grid(12, 30.0, 0.3, 0.5)
    for seed in range(4):
        survey, _ = survey_of(seed)
        assert free_sides_inside(in_place(workshop.whole(survey)), OUTLINE) == 0
        plain = workshop.whole(MeshSurvey(grid.vertices, grid.triangles))
        assert np.array_equal(plain.terrain.triangles, grid.triangles)
