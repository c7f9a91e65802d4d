"""Areas of interest as they are shown: their outlines in plan, laid on the ground."""

from collections.abc import Mapping

import numpy as np

from rpf3d_core.hazard.maps import Raster
from rpf3d_core.live.cells import TerrainCells
from rpf3d_core.live.standing import Outlines
from rpf3d_core.terrain.frame import FloatArray, Frame

MOST_STEPS = 2000
"""Of a ring: one that is longer than so many cells is laid on the ground more coarsely."""


def shown_areas(areas: Outlines, cells: TerrainCells, raster: Raster, frame: Frame) -> Mapping[str, list[FloatArray]]:
    """Name -> each ring of the area as a closed line (T, 3) m, map frame, as high as the cells that it goes through.

    areas : rings (P, 2) m, local frame, first corner repeated or not; what of them has no ground below it is as high as
    the line is beside it. A ring that nowhere crosses the raster's cells is left out, be it beside or all around it.
    """
    return {
        name: [frame.points_to_input(line) for ring in rings if len(line := _laid_on(ring, cells, raster))]
        for name, rings in areas.items()
    }


def _laid_on(ring: FloatArray, cells: TerrainCells, raster: Raster) -> FloatArray:
    """A ring as a closed line (T, 3) m, local frame, with a point in each cell; none of a ring off the raster."""
    corners = np.vstack([ring, ring[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    step = max(raster.cell, along[-1] / MOST_STEPS)
    at = np.unique(np.concatenate([along, np.arange(0.0, along[-1], step)]))
    x, y = np.interp(at, along, corners[:, 0]), np.interp(at, along, corners[:, 1])
    z = _height(x, y, cells, raster)
    known = np.isfinite(z)
    if not bool(known.any()):
        return np.empty((0, 3))
    return np.stack([x, y, np.interp(at, at[known], z[known])], axis=-1)


def _height(x: FloatArray, y: FloatArray, cells: TerrainCells, raster: Raster) -> FloatArray:
    """The ground (N,) m at places; NaN off the raster and where no ground is near."""
    column, row = np.floor((x - raster.x) / raster.cell), np.floor((y - raster.y) / raster.cell)
    inside = (column >= 0) & (column < raster.nx) & (row >= 0) & (row < raster.ny)
    cell = np.where(inside, row * raster.nx + column, 0).astype(np.int64)
    return np.where(inside, cells.height[cell].astype(np.float64), np.nan)
