"""Find the cells of a grid that are far enough from its boundary and from missing ground to be sources."""

import numpy as np

from rpf3d_core.imports.grids import Cells


def within(shape: tuple[int, ...], rim: int) -> Cells:
    """Return flags (H, W) of grid cells: False in the outermost `rim` rows and columns on each side, else True.

    shape : H and W
    """
    inside = np.zeros(shape, bool)
    inside[rim : shape[0] - rim, rim : shape[1] - rim] = True
    return inside


def surrounded(ground: Cells) -> Cells:
    """Return flags (H, W): True if a cell and its eight neighbours have ground.

    A rock that starts anywhere in such a cell is above a facet.

    ground : (H, W) True where a cell has a height
    """
    rows, columns = ground.shape
    inner = np.zeros(ground.shape, bool)
    if min(rows, columns) > 2:
        shifts = [ground[i : rows - 2 + i, j : columns - 2 + j] for i in range(3) for j in range(3)]
        inner[1:-1, 1:-1] = np.logical_and.reduce(shifts)
    return inner
