import numpy as np
import pytest
from input_files.terrain_files import grid

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.survey import mesh_terrain

VERTICES, TRIANGLES = grid(4, 5)


def test_a_mesh_becomes_a_terrain_of_one_zone_about_a_local_origin():
    terrain = mesh_terrain(VERTICES + np.array([1000.0, 2000.0, 0.0]), TRIANGLES, "survey")
    assert terrain.zones == ("survey",)
    assert np.abs(terrain.vertices[:, :2]).max() < 5.0
    assert np.array_equal(np.sort(terrain.triangles, axis=1), np.sort(TRIANGLES, axis=1))


@pytest.mark.parametrize("weld", [None, 0.001])
def test_a_mesh_without_area_is_refused(weld):
    with pytest.raises(TerrainError, match="no facet has an area"):
        mesh_terrain(np.ones_like(VERTICES), TRIANGLES, "survey", weld)


def test_a_mesh_without_triangles_or_with_a_vertex_that_is_not_finite_is_refused():
    with pytest.raises(TerrainError, match="no triangles"):
        mesh_terrain(VERTICES, TRIANGLES[:0], "survey")
    bad = VERTICES.copy()
    bad[3, 1] = np.nan
    with pytest.raises(TerrainError, match="NaN or infinite"):
        mesh_terrain(bad, TRIANGLES, "survey")
