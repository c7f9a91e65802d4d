"""Convert the terrain of a scene into a raster of heights, to measure fixed time steps on a raster."""

from typing import NamedTuple

import numpy as np

from rpf3d_core.accuracy.from_above import highest_ground
from rpf3d_core.accuracy.geometric import over_terrain
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.simulation.engines import Engine, stepping_over_squares
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.grid_triangles import grid_triangles


class Squares(NamedTuple):
    """The squares of a raster of heights: position, size, and which squares are holes.

    x, y : m, south-western corner; cell : m, side of a square; there : (ny, nx) False for squares that are holes
    """

    x: float
    y: float
    cell: float
    there: np.ndarray


def on_raster(prepared: Prepared, cell: float, dt: float) -> Prepared | None:
    """Return the scene with its terrain as a raster of heights, flown in fixed time steps.

    Return None if all squares of the raster are holes. Each height is the height of the highest ground; of an overhang,
    the upper side. Each of the two facets of a square has the zone of the ground at the facet's centroid. A square with
    a corner outside the terrain is a hole, so the raster of a terrain smaller than a cell has only holes.

    cell : m, distance between two heights; dt : s, time step
    """
    terrain, squares = rastered(prepared.terrain, prepared.engine, cell)
    if len(terrain.triangles) == 0:
        return None
    engine = engine_over(prepared.engine.name, terrain)
    raster = (squares.x, squares.y, squares.cell, squares.there)
    return over_terrain(prepared, terrain, stepping_over_squares(engine, *raster, dt))


def rastered(terrain: Terrain, engine: Engine, cell: float) -> tuple[Terrain, Squares]:
    """Return a terrain as a raster of heights, with a height every `cell` m, and the squares between the heights.

    The raster begins at the south-western corner of the terrain. Each square has two facets.
    """
    low, high = np.array(engine.facets.low), np.array(engine.facets.high)
    nx, ny = (max(int(width / cell), 1) for width in (high - low)[:2])
    x, y = np.meshgrid(low[0] + cell * np.arange(nx + 1), low[1] + cell * np.arange(ny + 1))
    nodes = np.stack([x, y, np.full(x.shape, high[2])], axis=-1).reshape(-1, 3)
    ground = highest_ground(engine, nodes)
    there = (ground.facet >= 0).reshape(x.shape)
    nodes[:, 2] = ground.z
    triangles, vertices = grid_triangles(there), nodes[there.ravel()]
    zone = _zones_under(terrain, engine, vertices[triangles].mean(axis=1)) if len(triangles) else np.empty(0, np.int32)
    full = there[:-1, :-1] & there[1:, :-1] & there[:-1, 1:] & there[1:, 1:]
    raster = Terrain(vertices, triangles, zone, terrain.zones, terrain.frame)
    return raster, Squares(x=float(low[0]), y=float(low[1]), cell=cell, there=full)


def _zones_under(terrain: Terrain, engine: Engine, points: FloatArray) -> np.ndarray:
    """Return the zone (N,) of the highest ground above or below N points (N, 3) m; 0 without ground."""
    facet = highest_ground(engine, points).facet
    return np.where(facet >= 0, terrain.zone[facet], 0).astype(np.int32)
