"""Which cells of a grid are far enough from its edge and from missing ground."""

import numpy as np

from rpf3d_core.imports.grids import Cells


def within(shape: tuple[int, ...], rim: int) -> Cells:
    """(H, W) whether a cell is further than so many rows and columns from the edge."""
    inside = np.zeros(shape, bool)
    inside[rim : shape[0] - rim, rim : shape[1] - rim] = True
    return inside


def surrounded(ground: Cells) -> Cells:
    """(H, W) whether a cell and its eight neighbours have ground (H, W): a rock anywhere in it is above a facet."""
    rows, columns = ground.shape
    inner = np.zeros(ground.shape, bool)
    if min(rows, columns) > 2:
        shifts = [ground[i : rows - 2 + i, j : columns - 2 + j] for i in range(3) for j in range(3)]
        inner[1:-1, 1:-1] = np.logical_and.reduce(shifts)
    return inner
