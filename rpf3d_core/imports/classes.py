"""Cells with the same numbers, which become zones: a facet has the ground of the cell that its centroid lies in.

The vertices of the mesh are the centres of cells, and the diagonal of each square runs from north-west to south-east:
so the centroids of its two facets lie a sixth of a cell inside the cell at its north-east and that at its south-west
corner. Each cell within the grid thus gives its ground to two facets, which have its area and meet at its centre.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.imports.grids import Cells
from rpf3d_core.terrain.frame import FloatArray

MOST_CLASSES = 200
"""Zones of one scene: laying their polygons over a million facets takes about 0.1 s each."""

BINS = (4096, 1024, 512, 200, 150, 100, 75, 50, 40, 30, 25, 20, *range(16, 0, -1))
"""Equal steps between the least and the largest number of a grid, tried from the finest."""


class Classes(NamedTuple):
    """Cells by what they have in common.

    number : (H, W) int32, from 1; 0 for a cell that no facet has
    values : (C, K) the K numbers of each class, each in its grid's unit
    facets : (C,) facets of each class
    distinct : how many there would be without bins
    error : (K,) largest difference between the number of a cell and that of its class; 0 where nothing was binned
    """

    number: NDArray[np.int32]
    values: FloatArray
    facets: NDArray[np.int64]
    distinct: int
    error: FloatArray


def facets_of_cells(ground: Cells) -> NDArray[np.int64]:
    """(H, W) how many facets have their centroid in a cell: 2 inside, fewer at the rim of `ground` (H, W)."""
    square = ground[:-1, :-1] & ground[:-1, 1:] & ground[1:, :-1] & ground[1:, 1:]
    facets = np.zeros(ground.shape, np.int64)
    facets[:-1, 1:] += square
    facets[1:, :-1] += square
    return facets


def classes_of(grids: tuple[FloatArray, ...], binned: tuple[bool, ...], facets: NDArray[np.int64]) -> Classes:
    """The classes of the cells that facets have, in rising order of their numbers.

    Where there are more than MOST_CLASSES, numbers that may be binned are put into as many equal steps as leave no
    more; the number of a class is then the mean of its cells.

    Parameters
    ----------
    grids : K grids (H, W), each in its own unit, finite where there are facets
    binned : of each grid, whether its numbers may be put into bins (codes may not)
    facets : (H, W) of `facets_of_cells`
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
    return Classes(number, values, its_facets, len(rows), np.abs(rows - values[place]).max(axis=0))


def _few(rows: FloatArray, binned: Cells) -> NDArray[np.int64]:
    """Classes (N,) of distinct rows (N, K) in the finest bins that leave at most MOST_CLASSES of them."""
    for bins in BINS:
        _, place = _distinct(_steps(rows, binned, bins))
        if place.max() < MOST_CLASSES:
            break
    return place


def _distinct(rows: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Distinct rows (C, K) of (N, K), rising, and which of them each row is (N,).

    As `np.unique` with an axis, which sorts rows as bytes and takes many times as long.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.concatenate([[True], (ordered[1:] != ordered[:-1]).any(axis=1)])
    place = np.empty(len(rows), np.int64)
    place[order] = np.cumsum(new) - 1
    return ordered[new], place


def _steps(numbers: FloatArray, binned: Cells, bins: int) -> FloatArray:
    """Numbers (N, K) with the step, of so many between the least and the largest, that each lies in."""
    low, high = numbers.min(axis=0), numbers.max(axis=0)
    width = np.where(high > low, high - low, 1.0)
    steps = np.minimum(np.floor((numbers - low) / width * bins), bins - 1)
    return np.asarray(np.where(binned, steps, numbers))


def _means(rows: FloatArray, place: NDArray[np.int64], count: NDArray[np.int64]) -> FloatArray:
    """Means (C, K) of the rows (N, K) of each class, which stand for (N,) cells each; exact where all are alike."""
    first = rows[np.unique(place, return_index=True)[1]]
    off = [np.bincount(place, weights=count * column) for column in (rows - first[place]).T]
    return np.asarray(first + np.stack(off, axis=1) / np.bincount(place, weights=count)[:, None])
