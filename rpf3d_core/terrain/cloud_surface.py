"""Make the surface of the ground from a cloud: choose the points of the ground, thin them and connect them.

Large gaps of the cloud stay open.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.cloud_holes import fill_holes
from rpf3d_core.terrain.cloud_mesh import cell_triangles
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.ground_points import default_cell, ground_class, lowest_in_cells

GAP = 4.0
"""Default longest side of a triangle in a hole that is closed, divided by the side of a cell (-)."""


class CloudChoice(NamedTuple):
    """The settings with which a surface is made from a cloud.

    cell : side of a cell (m); the lowest point of each cell is kept; None for a size from the spacing of the points
    widest : m, longest side of a triangle across a hole that is closed; None for GAP times the side of a cell
    classes : LAS classes that are ground; () for the class ground, or for all points except noise if no point has the
        class ground
    """

    cell: float | None = None
    widest: float | None = None
    classes: tuple[int, ...] = ()


DEFAULT = CloudChoice()


class CloudSurface(NamedTuple):
    """The surface made from a cloud, with the figures that are reported to the user.

    points : (V, 3) m, the points of the cloud that are corners of triangles; triangles : (F, 3), facing up
    given : number of points of the cloud; ground : number of these points that are ground; cell : side of a cell, m
    density : ground points per m^2, the median over cells with points; closed : number of closed holes
    holes : (H,) m^2, areas in plan of the holes that stay open
    left : number of cells whose lowest point is left out, because the point is not a corner of a triangle
    """

    points: FloatArray
    triangles: NDArray[np.int32]
    given: int
    ground: int
    cell: float
    density: float
    closed: int
    holes: FloatArray
    left: int

    def describe(self) -> list[str]:
        """Return lines of text for the user: the numbers of points, triangles and holes of the surface."""
        holes = f"{len(self.holes):,} holes left"
        density = f"{float(f'{self.density:.3g}'):,.12g}"
        if len(self.holes):
            holes += f", the largest of {self.holes.max():,.1f} m2, {self.holes.sum():,.1f} m2 in all"
        return [
            f"{self.given:,} points, {self.ground:,} of them ground, {density} points per m2",
            f"the lowest point of each cell of {self.cell:g} m: {len(self.points):,} points, "
            f"{len(self.triangles):,} triangles; overhangs are lost",
            f"{self.closed:,} small holes closed, {holes}; {self.left:,} lonely points left out",
        ]


def cloud_surface(
    points: FloatArray, classes: NDArray[np.uint8] | None = None, choice: CloudChoice = DEFAULT
) -> CloudSurface:
    """Return the surface of the ground from a cloud of points (N, 3) m, z up.

    classes : (N,) LAS class of each point; None if the cloud has no classes

    Raises
    ------
    TerrainError
        Fewer than three points are ground, a point is not finite, the points lie on one line along x or y, the cells
        are too small for the extent of the cloud, no three neighbouring cells have points, or `choice` names classes
        but the cloud has none.
    """
    given = len(points)
    if classes is not None:
        points = points[ground_class(classes, choice.classes)]
    elif choice.classes:
        raise TerrainError("the cloud has no classes; leave the classes out")
    if not np.isfinite(points).all():
        raise TerrainError("the cloud has a point that is NaN or infinite")
    if len(points) < 3:
        raise TerrainError(f"the cloud has {len(points)} points of the ground; a terrain needs at least three")
    cell = default_cell(points) if choice.cell is None else choice.cell
    cells = lowest_in_cells(points, cell)
    kept = points[cells.point]
    plan = kept[:, :2] - kept[:, :2].mean(axis=0)
    triangles = cell_triangles(plan, cells)
    if not len(triangles):
        raise TerrainError(f"no three neighbouring cells of {cell:g} m have points; give larger cells")
    filled = fill_holes(plan, triangles, GAP * cell if choice.widest is None else choice.widest)
    triangles = np.concatenate([triangles, filled.triangles])
    used = np.zeros(len(kept), bool)
    used[triangles] = True
    number = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return CloudSurface(
        points=kept[used], triangles=number[triangles], given=given, ground=len(points),
        cell=cell, density=float(np.median(cells.held)) / cell**2, closed=filled.closed, holes=filled.areas,
        left=int((~used).sum()),
    )  # fmt: skip
