"""Read the rocks of a Rockyfor3D folder, which Rockyfor3D calls blocks: source cells, densities and volumes."""

import math
from typing import NamedTuple

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.imports.grids import Cells, Grids, refuse_where
from rpf3d_core.imports.rims import surrounded, within
from rpf3d_core.terrain.frame import FloatArray

DENSITY, AXES, SHAPE = "rockdensity", ("d1", "d2", "d3"), "blshape"

FILLED = {1: ("rectangular", 1.0), 2: ("ellipsoidal", math.pi / 6.0), 3: ("spherical", math.pi / 6.0),
          4: ("disc", math.pi / 4.0)}  # fmt: skip
"""Name of each rock shape, and the share (-) of its box d1 x d2 x d3 that it fills, by code.

A disc is a cylinder of thickness d3.
"""

IGNORED_RIM = 2
"""Number of rows and columns on each side of the grid in which Rockyfor3D ignores source cells.

Source: the readme of a plugin that writes the input of Rockyfor3D.
"""


class Blocks(NamedTuple):
    """The rocks of N source cells, row by row.

    cells : (H, W) True for a source cell
    left_out : two numbers of source cells that are not used: at the rim of the grid, and next to missing ground
    density : (N,) kg/m3; volume : (N,) m3; shapes : names of the shapes that occur
    """

    cells: Cells
    left_out: tuple[int, int]
    density: FloatArray
    volume: FloatArray
    shapes: tuple[str, ...]

    @property
    def radius(self) -> float:
        """Radius (m) of the mean rock: a sphere of the mean volume."""
        return float((3.0 * self.volume.mean() / (4.0 * math.pi)) ** (1.0 / 3.0))


def blocks_of(grids: Grids) -> Blocks:
    """Return the rocks of all source cells, that is cells with a rock density above 0.

    Raises
    ------
    InputError
        A density is negative or missing, there is no source cell, or a source cell has no valid size or shape. The
        message names the file, and the cell with a wrong value.
    """
    density = grids.values[DENSITY]
    wrong = grids.ground & ~(density >= 0.0)
    refuse_where(grids, DENSITY, wrong, "must be a density (kg/m3), or 0 where no rock falls")
    wanted = grids.ground & (density > 0.0)
    inside = within(wanted.shape, IGNORED_RIM)
    cells = wanted & inside & surrounded(grids.ground)
    if not cells.any():
        raise InputError(
            f"{grids.files[DENSITY]}: is 0 everywhere but in the outer {IGNORED_RIM} rows and columns and next to "
            "missing ground, so no rock falls; source cells must have the density of their rock (kg/m3)"
        )
    _refuse_sizeless(grids, cells)
    box = np.prod([grids.values[axis][cells] for axis in AXES], axis=0)
    codes = grids.values[SHAPE][cells].astype(int)
    share = np.array([FILLED[code][1] for code in codes.tolist()])
    at_rim = int((wanted & ~inside).sum())
    left_out = at_rim, int(wanted.sum() - cells.sum()) - at_rim
    names = tuple(FILLED[code][0] for code in np.unique(codes).tolist())
    return Blocks(cells=cells, left_out=left_out, density=density[cells], volume=box * share, shapes=names)


def _refuse_sizeless(grids: Grids, cells: Cells) -> None:
    for axis in AXES:
        refuse_where(grids, axis, cells & ~(grids.values[axis] > 0.0), "must be above 0 m in every source cell")
    codes = ", ".join(f"{code} ({name})" for code, (name, _) in FILLED.items())
    unknown = cells & ~np.isin(grids.values[SHAPE], list(FILLED))
    refuse_where(grids, SHAPE, unknown, f"must be one of {codes} in every source cell")
