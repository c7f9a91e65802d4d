"""Make surveys of the same hills for tests of live terrains, and read properties of a live terrain."""

import numpy as np

from rpf3d_core.live.ground import LiveTerrain
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, MeshSurvey
from rpf3d_core.terrain.grid_rows import grid_mesh
from rpf3d_core.terrain.mesh.edges import edges_of

EAST, NORTH = 5000.0, 3000.0


def heights(x: np.ndarray, y: np.ndarray, seed: int) -> np.ndarray:
    """Return the heights (m) of the hills at places x, y (m), with noise; its standard deviation is 0.2 m."""
    return 6.0 * np.sin(x / 9.0) + 4.0 * np.cos(y / 7.0) - 0.5 * x + np.random.default_rng(seed).normal(0, 0.2, x.shape)


def grid(
    rows: int = 40, columns: int = 44, east: float = 0.0, north: float = 0.0, step: float = 1.0, seed: int = 0,
    turned: float = 0.0,
) -> GridSurvey:  # fmt: skip
    """Return a survey of the hills whose points form a grid, rotated counter-clockwise by `turned` (rad).

    east, north : place of the first point, the centre of the rotation, relative to EAST, NORTH (m)
    step : distance of the points (m); seed : seed of the noise
    """
    v, u = np.mgrid[0:rows, 0:columns] * step
    x = EAST + east + np.cos(turned) * u - np.sin(turned) * v
    y = NORTH + north + np.sin(turned) * u + np.cos(turned) * v
    return GridSurvey(np.stack([x, y, heights(x - EAST, y - NORTH, seed)], axis=-1))


def cloud(count: int, east: float, north: float, width: float, seed: int = 0) -> CloudSurvey:
    """Return a survey of the hills with points scattered over a square.

    east, north : south-western corner relative to EAST, NORTH (m); width : side of the square (m)
    """
    places = np.random.default_rng(seed).uniform(0.0, width, (count, 2)) + np.array([EAST + east, NORTH + north])
    z = heights(places[:, 0] - EAST, places[:, 1] - NORTH, seed)
    return CloudSurvey(np.column_stack([places, z]))


def mesh(survey: GridSurvey) -> MeshSurvey:
    """Return the survey of a grid as a mesh."""
    made = grid_mesh(survey.points)
    return MeshSurvey(made.vertices + np.array(made.origin), made.triangles)


def live_facets(ground: LiveTerrain) -> np.ndarray:
    """Return the indices of the facets whose area is not zero."""
    return np.flatnonzero(ground.facets.normals.any(axis=1))


def corner_sets(ground: LiveTerrain, facets: np.ndarray) -> set[bytes]:
    """Return the set of facets by their content: the bytes of corners and normal of each facet."""
    geometry = ground.facets.geometry.reshape(-1, 12)
    return {geometry[f].tobytes() for f in facets}


def edge_counts(ground: LiveTerrain) -> tuple[int, int]:
    """Return the number of edges of a terrain with one facet, and the number of edges with more than two facets.

    Corners with equal coordinates are one vertex.
    """
    corners = np.asarray(ground.facets.corners)[live_facets(ground)].reshape(-1, 3)
    vertices, numbers = np.unique(corners, axis=0, return_inverse=True)
    uses = edges_of(numbers.reshape(-1, 3).astype(np.int32), len(vertices)).uses
    return int((uses == 1).sum()), int((uses > 2).sum())
