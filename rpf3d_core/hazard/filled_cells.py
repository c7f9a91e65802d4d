"""Estimate, from the counts of a map, the larger cell size or the number of rocks that gives most cells a percentile.

A percentile needs FEWEST_ROCKS rocks. The rocks of a larger cell of k x k map cells are not counted, but estimated. A
rock that crosses the larger cell on a straight line visits 4 k / pi map cells on average. So the number of rocks in the
larger cell is about the sum of the rocks in its map cells divided by 4 k / pi, and at least the number of rocks in the
map cell with most rocks.
"""

import math
from collections.abc import Callable
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from rpf3d_core.hazard.maps import FEWEST_ROCKS, CountArray, HazardMaps
from rpf3d_core.hazard.raster import round_cells
from rpf3d_core.terrain.frame import FloatArray

FEWEST_CELLS = 5
"""Smallest number of cells along the longer side of a map with the cell size that is advised."""
MOST = 0.5
"""Share (-) of the reached cells, or of the visits, that must be in cells with at least FEWEST_ROCKS rocks.

A visit is one rock in one cell.
"""


class ReachedCells(NamedTuple):
    """The S cells of a map that rocks reached.

    column, row : (S,) place of each cell, from 0; rocks : (S,) distinct rocks that reached the cell
    cell : m, side of a cell; widest : m, longer side of the whole map
    """

    column: CountArray
    row: CountArray
    rocks: CountArray
    cell: float
    widest: float


def reached_cells(maps: HazardMaps) -> ReachedCells:
    """Return the cells of a run's map that rocks reached."""
    raster = maps.raster
    row, column = np.divmod(maps.cells.cell, raster.nx)
    widest = raster.cell * max(raster.nx, raster.ny)
    return ReachedCells(column=column, row=row, rocks=maps.cells.rocks, cell=raster.cell, widest=widest)


def share_of_cells(rocks: FloatArray | CountArray) -> float:
    """Return the share (-) of the cells with enough rocks for a percentile; rocks : (S,) in each cell, S >= 1."""
    return float((rocks >= FEWEST_ROCKS).mean())


def share_of_visits(rocks: FloatArray | CountArray) -> float:
    """Return the share (-) of all visits in cells with enough rocks for a percentile; a visit is one rock in one cell.

    rocks : (S,) number of rocks in each cell, S >= 1
    """
    return float(rocks[rocks >= FEWEST_ROCKS].sum() / rocks.sum())


def filling_cell(
    reached: ReachedCells, share: Callable[[FloatArray | CountArray], float] = share_of_visits
) -> float | None:
    """Return the smallest round cell size (m), above that of the map, with which most of the map has percentiles.

    The result is None if no size is large enough. "Most" means: at least the share MOST (0.5) of the cells, or of the
    visits, is in cells that at least FEWEST_ROCKS (20) rocks reached. Only sizes with at least FEWEST_CELLS (5) cells
    along the longer side of the map are considered.

    share : `share_of_cells` or `share_of_visits`, which returns the share from the number of rocks (S,) in each cell
    """
    largest = reached.widest / FEWEST_CELLS
    sizes = takewhile(lambda size: size <= largest, (size for size in round_cells() if size > reached.cell))
    return next((size for size in sizes if share(_rocks_in(reached, size)) >= MOST), None)


def rocks_that_fill(reached: ReachedCells, flown: int) -> int:
    """Return the estimated number of rocks that must fly in total, so that enough cells have percentiles.

    With this number, the share MOST of the cells reached so far have at least FEWEST_ROCKS rocks each. The number is
    rounded up to two significant digits.

    flown : number of rocks flown so far
    """
    needed = flown * FEWEST_ROCKS / float(np.quantile(reached.rocks, 1.0 - MOST))
    step = int(10 ** max(math.floor(math.log10(needed)) - 1, 0))
    return math.ceil(needed / step) * step


def _rocks_in(reached: ReachedCells, size: float) -> FloatArray:
    """Return the estimated number of rocks (L,) in each of the L larger cells that rocks reached.

    size : side of a larger cell (m)
    """
    times = size / reached.cell
    places = (np.floor((place + 0.5) / times).astype(np.int64) for place in (reached.row, reached.column))
    row, column = places
    number = np.unique(row * (int(column.max()) + 1) + column, return_inverse=True)[1]
    most = np.zeros(int(number.max()) + 1)
    np.maximum.at(most, number, reached.rocks)
    return np.maximum(most, np.bincount(number, weights=reached.rocks) / (4.0 * times / math.pi))
