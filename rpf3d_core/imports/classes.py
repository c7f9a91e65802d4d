"""Group grid cells with equal ground into classes, because a scene has values for zones and not for cells.

A facet has the ground of the cell that contains the centroid of the facet. The vertices of the mesh are the centres of
cells, and the diagonal of each square runs from north-west to south-east. Therefore the centroids of the two facets lie
a sixth of a cell inside the cells at the north-east and the south-west corner of the square. The two facets with the
ground of an inner cell have together the area of the cell, and touch at the centre of the cell.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.imports.grids import Cells
from rpf3d_core.terrain.frame import FloatArray

MOST_CLASSES = 200
"""Largest number of zones of an imported scene; on a million facets, each zone adds about 0.1 s."""

BINS = (4096, 1024, 512, 200, 150, 100, 75, 50, 40, 30, 25, 20, *range(16, 0, -1))
"""Numbers of equal intervals (bins) for the numbers of a grid, in the order in which they are tried."""


class Classes(NamedTuple):
    """The C classes of grid cells: a class becomes a zone, and all its cells get the same K values, one for each grid.

    number : (H, W) int32, class of each cell, counted from 1; 0 for a cell without facets
    values : (C, K) values of each class, in the units of the grids
    facets : (C,) number of facets of each class
    distinct : number of classes that the cells would have without bins
    error : (K,) largest difference between the value of a cell and the value of its class; 0 without bins
    """

    number: NDArray[np.int32]
    values: FloatArray
    facets: NDArray[np.int64]
    distinct: int
    error: FloatArray


def facets_of_cells(ground: Cells) -> NDArray[np.int64]:
    """Return the number (H, W) of facets that get their ground from each cell: 2, or fewer next to missing ground.

    A facet belongs to the cell that contains its centroid. Outside the grid, ground counts as missing.

    ground : (H, W) True where a cell has a height
    """
    square = ground[:-1, :-1] & ground[:-1, 1:] & ground[1:, :-1] & ground[1:, 1:]
    facets = np.zeros(ground.shape, np.int64)
    facets[:-1, 1:] += square
    facets[1:, :-1] += square
    return facets


def classes_of(grids: tuple[FloatArray, ...], binned: tuple[bool, ...], facets: NDArray[np.int64]) -> Classes:
    """Return the classes of all cells with facets: cells with equal values in all grids are in one class.

    Classes are in ascending order of their values. If there would be more than MOST_CLASSES (200) classes, the values
    of some grids (`binned`) are sorted into bins of equal width, which are as narrow as possible. The value of a class
    is then the mean over its cells.

    Parameters
    ----------
    grids : K grids (H, W), each in its own unit, finite where there are facets
    binned : (K,) True if the values of a grid may be sorted into bins (codes must not)
    facets : (H, W) from `facets_of_cells`
    """
    there = facets > 0
    numbers = np.stack([grid[there] for grid in grids], axis=1)
    rows, row = _distinct(numbers)
    place = np.arange(len(rows))
    if len(rows) > MOST_CLASSES:
        place = _few(rows, np.array(binned))
    values = _means(rows, place, np.bincount(row))
    number = np.zeros(there.shape, np.int32)
    number[there] = place[row] + 1
    its_facets = np.bincount(place[row], weights=facets[there]).astype(np.int64)
    return Classes(
        number=number,
        values=values,
        facets=its_facets,
        distinct=len(rows),
        error=np.abs(rows - values[place]).max(axis=0),
    )


def _few(rows: FloatArray, binned: Cells) -> NDArray[np.int64]:
    """Return the class (N,), from 0, of each distinct row of values (N, K): rows in the same bins are in one class.

    The largest number of bins in BINS is used that gives at most MOST_CLASSES (200) classes. If no number of bins does,
    each column to bin gets a single bin, and there are more classes.

    binned : (K,) True for columns whose values may be sorted into bins
    """
    for bins in BINS:
        _, place = _distinct(_steps(rows, binned, bins))
        if place.max() < MOST_CLASSES:
            break
    return place


def _distinct(rows: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return the distinct rows (C, K) of rows (N, K) in ascending order, and for each row its index (N,) among them.

    `np.unique` with an axis gives the same result, but takes many times as long.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.concatenate([[True], (ordered[1:] != ordered[:-1]).any(axis=1)])
    place = np.empty(len(rows), np.int64)
    place[order] = np.cumsum(new) - 1
    return ordered[new], place


def _steps(numbers: FloatArray, binned: Cells, bins: int) -> FloatArray:
    """Return a copy of numbers (N, K), in which each number of the columns to bin is replaced by the index of its bin.

    binned : (K,) True for columns to bin
    bins : number of bins of equal width between the smallest and the largest number of a column
    """
    low, high = numbers.min(axis=0), numbers.max(axis=0)
    width = np.where(high > low, high - low, 1.0)
    steps = np.minimum(np.floor((numbers - low) / width * bins), bins - 1)
    return np.asarray(np.where(binned, steps, numbers))


def _means(rows: FloatArray, place: NDArray[np.int64], count: NDArray[np.int64]) -> FloatArray:
    """Return the values (C, K) of each class: the mean of its rows (N, K), weighted by the number of cells of each row.

    The mean is exact if all rows of a class are equal.

    place : (N,) class of each row; count : (N,) number of cells with each row
    """
    first = rows[np.unique(place, return_index=True)[1]]
    off = [np.bincount(place, weights=count * column) for column in (rows - first[place]).T]
    return np.asarray(first + np.stack(off, axis=1) / np.bincount(place, weights=count)[:, None])
