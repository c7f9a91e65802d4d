"""Prepare areas of interest for display: draw their outlines on the ground."""

from collections.abc import Mapping

import numpy as np

from rpf3d_core.hazard.maps import Raster
from rpf3d_core.live.cells import TerrainCells
from rpf3d_core.live.standing import Outlines
from rpf3d_core.terrain.frame import FloatArray, Frame

MOST_STEPS = 2000
"""Approximate largest number of steps along an outline; for a longer outline, steps are longer than a cell."""


def shown_areas(areas: Outlines, cells: TerrainCells, raster: Raster, frame: Frame) -> Mapping[str, list[FloatArray]]:
    """Return the outlines of each area, by name, as closed lines (T, 3) m on the ground, map frame.

    A line has the height of the ground in the cells that the line crosses. For a part without ground, the height is
    interpolated between the nearest parts with ground on both sides. A ring that crosses no cell with known height is
    left out.

    areas : rings (P, 2) m, local frame, with or without the first corner repeated
    cells : heights of the ground in the cells of `raster`; frame : the terrain's local frame
    """
    return {
        name: [frame.points_to_input(line) for ring in rings if len(line := _laid_on(ring, cells, raster))]
        for name, rings in areas.items()
    }


def _laid_on(ring: FloatArray, cells: TerrainCells, raster: Raster) -> FloatArray:
    """Return one outline as a closed line (T, 3) m on the ground, local frame.

    The points of the line are the corners of the outline, and points between them at distances of about a cell; on a
    long outline, the distances are larger (MOST_STEPS). The line is empty if it crosses no cell with known height.

    ring : (P, 2) m, corners of the outline, local frame; cells, raster : as in `shown_areas`
    """
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
    """Return the height (N,) m of the ground at places (x, y) in plan, (N,) m each; NaN if it is not known.

    The height is not known outside the map, and where `cells` has no height. All lengths are in the local frame.
    """
    column, row = np.floor((x - raster.x) / raster.cell), np.floor((y - raster.y) / raster.cell)
    inside = (column >= 0) & (column < raster.nx) & (row >= 0) & (row < raster.ny)
    cell = np.where(inside, row * raster.nx + column, 0).astype(np.int64)
    return np.where(inside, cells.height[cell].astype(np.float64), np.nan)
