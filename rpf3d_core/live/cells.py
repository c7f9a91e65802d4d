"""Find which cells of a map lie over ground, and how high the ground is there; both are needed to draw a map."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.bucket_grid import CellRectangle
from rpf3d_core.detection.bucket_locator import BucketLocator
from rpf3d_core.detection.bucket_patch import Plan, facets_in
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.terrain.facets import Terrain


class TerrainCells(NamedTuple):
    """Where the C cells of a map lie over ground, and how high the ground is; computed once for each terrain.

    covered : (C,) True if there is ground below the middle of the cell
    height : (C,) m, local frame, height of the highest ground below the middle of the cell. If there is none: mean
        height of the corners of the highest facet whose box in plan touches the cell; NaN without such a facet
    """

    covered: NDArray[np.bool_]
    height: NDArray[np.float32]


def cells_over(terrain: Terrain, raster: Raster) -> TerrainCells:
    """Return where the cells of a map lie over ground, and how high the ground is there; raster : cells of the map."""
    covered = np.zeros(raster.nx * raster.ny, dtype=np.bool_)
    height = np.full(raster.nx * raster.ny, np.nan, dtype=np.float32)
    cover(terrain.vertices, terrain.triangles, raster, covered, height)
    return TerrainCells(covered, height)


def cells_after(
    before: TerrainCells, terrain: Terrain, raster: Raster, locator: BucketLocator, low: Plan, high: Plan
) -> TerrainCells:
    """Return the cells of a map after a part of the terrain changed; only the cells over this part are computed again.

    terrain : after the change; raster : cells of the map
    low, high : corners in plan (m, local frame) of the box in which the terrain changed
    before : the cells before the change, which the function does not change; locator : search structure over the facets
    """
    columns = _span(low[0], high[0], raster.x, raster.cell, raster.nx)
    rows = _span(low[1], high[1], raster.y, raster.cell, raster.ny)
    covered, height = before.covered.copy(), before.height.copy()
    covered.reshape(raster.ny, raster.nx)[rows, columns] = False
    height.reshape(raster.ny, raster.nx)[rows, columns] = np.nan
    west, south = raster.x + raster.cell * columns.start, raster.y + raster.cell * rows.start
    east, north = raster.x + raster.cell * columns.stop, raster.y + raster.cell * rows.stop
    i = _span(west, east, locator.x, locator.cell, locator.nx)
    j = _span(south, north, locator.y, locator.cell, locator.ny)
    near = facets_in(locator, CellRectangle(left=i.start, right=i.stop, bottom=j.start, top=j.stop))
    cover(terrain.vertices, np.ascontiguousarray(terrain.triangles[near]), raster, covered, height)
    return TerrainCells(covered, height)


def _span(low: float, high: float, origin: float, cell: float, count: int) -> slice:
    """Return the range of columns, or rows, of a map whose cells overlap the interval from `low` to `high` (m).

    The range has at least one cell: the nearest one if the interval is outside the map.

    origin : m, where the map begins; cell : m, side of a cell; count : number of columns, or rows, of the map
    """
    first, last = (int(np.clip(np.floor((edge - origin) / cell), 0, count - 1)) for edge in (low, high))
    return slice(first, last + 1)


@loop
def cover(vertices: Any, triangles: Any, raster: Raster, covered: Any, height: Any) -> None:
    """Write into `covered` (C,) which cells of a map lie over ground, and into `height` (C,) m how high the ground is.

    Both arrays are as in `TerrainCells`.

    In all cells to be computed, `covered` must be False and `height` NaN before the call. Each facet is compared with
    all cells in the facet's box in plan.

    vertices : (V, 3) m, local frame; triangles : (F, 3) indices into vertices; raster : cells of the map
    """
    x, y, cell, nx, ny = raster.x, raster.y, raster.cell, raster.nx, raster.ny
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        bx, by, bz = vertices[b, 0], vertices[b, 1], vertices[b, 2]
        cx, cy, cz = vertices[c, 0], vertices[c, 1], vertices[c, 2]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        west, east = int((min(ax, bx, cx) - x) / cell), int((max(ax, bx, cx) - x) / cell)
        south, north = int((min(ay, by, cy) - y) / cell), int((max(ay, by, cy) - y) / cell)
        for j in range(max(south, 0), min(north, ny - 1) + 1):
            for i in range(max(west, 0), min(east, nx - 1) + 1):
                px, py, at = x + (i + 0.5) * cell, y + (j + 0.5) * cell, j * nx + i
                u = (bx - px) * (cy - py) - (cx - px) * (by - py)
                v = (cx - px) * (ay - py) - (ax - px) * (cy - py)
                w = area - u - v
                inside = area != 0.0 and u * area >= 0.0 and v * area >= 0.0 and w * area >= 0.0
                z = (u * az + v * bz + w * cz) / area if inside else (az + bz + cz) / 3.0
                known = height[at] == height[at]
                if not known or (inside and not covered[at]) or (inside == covered[at] and z > height[at]):
                    height[at] = z
                if inside:
                    covered[at] = True
