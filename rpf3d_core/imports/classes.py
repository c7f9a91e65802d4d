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
"""Zones of one scene: laying their polygons over a million facets takes 0.05 to 0.1 s each."""

BINS = tuple(2**k for k in range(10, -1, -1))
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
    values, place = _distinct(numbers)
    distinct = len(values)
    for bins in BINS if distinct > MOST_CLASSES else ():
        _, place = _distinct(_steps(numbers, np.array(binned), bins))
        if place.max() < MOST_CLASSES:
            break
    if distinct > MOST_CLASSES:
        values = _means(numbers, place)
    number = np.zeros(there.shape, np.int32)
    number[there] = place + 1
    its_facets = np.bincount(place, weights=facets[there]).astype(np.int64)
    return Classes(number, values, its_facets, distinct, np.abs(numbers - values[place]).max(axis=0))


def _distinct(rows: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Distinct rows (C, K) of (N, K), rising, and which of them each row is (N,)."""
    values, place = np.unique(rows, axis=0, return_inverse=True)
    return values, place.reshape(-1)


def _steps(numbers: FloatArray, binned: Cells, bins: int) -> FloatArray:
    """Numbers (N, K) with the step, of so many between the least and the largest, that each lies in."""
    low, high = numbers.min(axis=0), numbers.max(axis=0)
    width = np.where(high > low, high - low, 1.0)
    steps = np.minimum(np.floor((numbers - low) / width * bins), bins - 1)
    return np.asarray(np.where(binned, steps, numbers))


def _means(numbers: FloatArray, place: NDArray[np.int64]) -> FloatArray:
    """Means (C, K) of the numbers (N, K) of each class; exact where all are alike."""
    count = np.bincount(place)
    first = numbers[np.unique(place, return_index=True)[1]]
    off = [np.bincount(place, weights=column) / count for column in (numbers - first[place]).T]
    return first + np.stack(off, axis=1)
