"""Surveys of the same hills for tests of live grounds, and functions that check properties of a ground."""

import numpy as np

from rpf3d_core.live.ground import LiveTerrain
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, MeshSurvey
from rpf3d_core.terrain.grid_rows import grid_mesh
from rpf3d_core.terrain.mesh.edges import edges_of

EAST, NORTH = 5000.0, 3000.0


def heights(x: np.ndarray, y: np.ndarray, seed: int) -> np.ndarray:
    """Return the heights of hills with noise of 0.2 m."""
    return 6.0 * np.sin(x / 9.0) + 4.0 * np.cos(y / 7.0) - 0.5 * x + np.random.default_rng(seed).normal(0, 0.2, x.shape)


def grid(
    rows: int = 40, columns: int = 44, east: float = 0.0, north: float = 0.0, step: float = 1.0, seed: int = 0,
    turned: float = 0.0,
) -> GridSurvey:  # fmt: skip
    """Return a grid of points, rotated counter-clockwise by `turned` (rad) about the first point."""
    v, u = np.mgrid[0:rows, 0:columns] * step
    x = EAST + east + np.cos(turned) * u - np.sin(turned) * v
    y = NORTH + north + np.sin(turned) * u + np.cos(turned) * v
    return GridSurvey(np.stack([x, y, heights(x - EAST, y - NORTH, seed)], axis=-1))


def cloud(count: int, east: float, north: float, width: float, seed: int = 0) -> CloudSurvey:
    """Return points scattered over a square."""
    places = np.random.default_rng(seed).uniform(0.0, width, (count, 2)) + np.array([EAST + east, NORTH + north])
    z = heights(places[:, 0] - EAST, places[:, 1] - NORTH, seed)
    return CloudSurvey(np.column_stack([places, z]))


def mesh(survey: GridSurvey) -> MeshSurvey:
    """Return the mesh of a grid."""
    made = grid_mesh(survey.points)
    return MeshSurvey(made.vertices + np.array(made.origin), made.triangles)


def live_facets(ground: LiveTerrain) -> np.ndarray:
    """Return the indices of the facets whose area is not zero."""
    return np.flatnonzero(ground.facets.normals.any(axis=1))


def corner_sets(ground: LiveTerrain, facets: np.ndarray) -> set[bytes]:
    """Return the corners and normals of facets as bytes."""
    geometry = ground.facets.geometry.reshape(-1, 12)
    return {geometry[f].tobytes() for f in facets}


def edge_counts(ground: LiveTerrain) -> tuple[int, int]:
    """Return the number of edges with one facet, and with more than two; corners with equal bits are one vertex."""
    corners = np.asarray(ground.facets.corners)[live_facets(ground)].reshape(-1, 3)
    vertices, numbers = np.unique(corners, axis=0, return_inverse=True)
    uses = edges_of(numbers.reshape(-1, 3).astype(np.int32), len(vertices)).uses
    return int((uses == 1).sum()), int((uses > 2).sum())
