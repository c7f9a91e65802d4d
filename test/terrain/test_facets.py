"""Tests of the arrays of facets that the kernels use."""

import numpy as np

from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain


def test_corners_and_normals_are_those_of_the_facet():
    terrain = pit_terrain(Pit(triangles=40_000))
    facets = facets_of(terrain)
    np.testing.assert_array_equal(facets.corners, terrain.vertices[terrain.triangles].reshape(-1, 9))
    a, b, c = terrain.vertices[terrain.triangles].transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    np.testing.assert_allclose(facets.normals, across / np.linalg.norm(across, axis=1)[:, None], atol=1e-14)


def test_the_box_is_that_of_the_vertices_that_facets_have():
    vertices = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [99.0, 99.0, 99.0]])
    terrain = Terrain(vertices, np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32), ("ground",))
    facets = facets_of(terrain)
    assert (facets.low, facets.high) == ((0.0, 0.0, 0.0), (2.0, 3.0, 1.0))


def test_a_facet_without_area_has_no_normal():
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]])
    terrain = Terrain(vertices, np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32), ("ground",))
    assert not facets_of(terrain).normals.any()
