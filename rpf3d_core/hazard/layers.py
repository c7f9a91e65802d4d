"""Compute the values of a hazard map from the counts of a tally: shares, means and percentiles of each reached cell."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.hazard.bins import bin_edges, bin_values, relative_error
from rpf3d_core.hazard.maps import FEWEST_ROCKS, PERCENTILES, CellStatistics, CountArray, Layers, StatisticArray
from rpf3d_core.hazard.slots import SUM_UNITS
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.cache_lines import Found
from rpf3d_core.hazard.walks.ways import WAY_UNITS
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.terrain.frame import FloatArray

ENERGY = 0
"""Index of energy among the three quantities that are sorted into bins: energy, speed, height."""
FEW = 100_000
"""Largest number of bins, over all cells, for which NumPy finds the percentiles; above it, a compiled loop does."""


def layers_of(tally: CellTally) -> Layers:
    """Return the map values of all cells that rocks reached, from the counts of the tally."""
    found = tally.found()
    edges = [_edges(tally, q) for q in range(3)]
    percentiles = _percentiles_of(tally, found, edges)
    energy, speed, height = (_spread(tally, found, q, percentiles[q]) for q in range(3))
    return Layers(
        len(tally.slot), found.cell, found.rocks, found.passages, found.impacts, found.deposits, found.first,
        energy, speed, height, max(relative_error(some) for some in edges),
        *(() if found.ways is None else (found.ways / WAY_UNITS,)),
    )  # fmt: skip


def without_passages(layers: Layers) -> Layers:
    """Return map values of zones or areas with all passages set to 0: only map cells and facets have passages."""
    return replace(layers, passages=np.zeros_like(layers.passages))


def _edges(tally: CellTally, q: int) -> FloatArray:
    """Return the edges (B + 1,) of the B bins of a quantity q, in its unit; bins may have been merged in pairs.

    If speeds have no bins, their edges follow from the edges of the energies.

    q : 0 energy (J), 1 speed (m/s), 2 height (m)
    """
    top, bins, per_octave = tally.scales
    if bins[q] == 0:
        return top[q] * np.sqrt(_edges(tally, ENERGY) / top[ENERGY])
    return bin_edges(top[q], bins[q], per_octave)[:: 2**tally.merges]


def _percentiles_of(tally: CellTally, found: Found, edges: list[FloatArray]) -> StatisticArray:
    """Return the percentiles (3, S, P) of energy (J), speed (m/s) and height (m) in S cells; NaN for too few rocks.

    edges : edges of the bins of energy, speed and height, from `_edges`
    """
    found_values = np.full((3, len(found.cell), len(PERCENTILES)), np.nan, dtype=np.float32)
    values, many, first = [bin_values(some) for some in edges], np.flatnonzero(found.rocks >= FEWEST_ROCKS), 0
    for bins in tally.bins_found(many):
        some = many[first : first + len(bins)]
        ranks = -((-found.rocks[some, None] * np.array(PERCENTILES)) // 100)
        for q in range(3):
            if q == ENERGY or tally.scales.bins[q] > 0:  # Without its own bins, speed uses the bins of energy.
                place = _places(bins, _columns(tally, q), ranks)
            found_values[q, some] = values[q][place]
        first += len(bins)
    return found_values


def bins_of(tally: CellTally, q: int, some: NDArray[np.intp]) -> NDArray[np.uint32]:
    """Return the counts (S, B) in the bins of a quantity q (0 energy, 1 speed, 2 height) for some reached cells.

    some : (S,) slots of the cells
    """
    whole = tally.carries.whole(tally.slots.bins, some)
    return np.ascontiguousarray(whole[:, _columns(tally, q)])


def rank_values(tally: CellTally, q: int, bins: NDArray[np.uint32], ranks: CountArray) -> FloatArray:
    """Return for each of N cells the value (N,) of quantity q that the rock with a given rank has in the cell.

    The value is the geometric mean of the edges of the bin in which the rock is counted.
    q : 0 energy (J), 1 speed (m/s), 2 height (m); bins : (N, B) counts of the cells in the bins of q
    ranks : (N,) place of the rock among the rocks of its cell in ascending order, from 1
    """
    place = _places(bins, slice(0, bins.shape[1]), ranks[:, None])[:, 0]
    return bin_values(_edges(tally, q))[place]


def _columns(tally: CellTally, q: int) -> slice:
    """Return the columns of a tally's bins that belong to a quantity q (0 energy, 1 speed, 2 height).

    If bins have been merged in pairs, the columns are columns of merged bins.
    """
    bins = tally.scales.bins
    return slice(sum(bins[:q]) >> tally.merges, sum(bins[: q + 1]) >> tally.merges)


def _places(bins: NDArray[np.uint32], columns: slice, ranks: CountArray) -> CountArray:
    """Return the bin (N, P) that contains each of P percentiles of a quantity in N cells.

    bins : (N, B) counts of all quantities; columns : the columns of this quantity
    ranks : (N, P) rank of each percentile among the rocks of its cell, from 1; ascending in each row
    """
    if bins.size <= FEW:
        up_to = np.cumsum(bins[:, columns], axis=1)
        return np.stack([np.count_nonzero(up_to < rank[:, None], axis=1) for rank in ranks.T], axis=1)
    places = np.empty(ranks.shape, dtype=np.int64)
    _find_ranks(bins, columns.start, ranks, places)
    return places


def _spread(tally: CellTally, found: Found, q: int, percentiles: StatisticArray) -> CellStatistics:
    """Return largest value, mean and percentiles of a quantity q (0 energy, 1 speed, 2 height) in each of S cells.

    percentiles : (S, P) from the bins; they are limited to the largest value
    """
    largest = found.most[:, q]
    mean = found.sums[:, q] * (tally.scales.top[q] / SUM_UNITS) / found.rocks
    return CellStatistics(largest, mean.astype(np.float32), *np.minimum(percentiles.T, largest))


@loop
def _find_ranks(bins: Any, begin: int, ranks: Any, places: Any) -> None:
    """Write to `places` (N, P) the bin that contains the rock of each rank (N, P) in N cells.

    bins : (N, B) counts; begin : column of the first bin of the quantity, which has the number 0 in `places`
    ranks : (N, P) place of the rock among the rocks of its cell in ascending order, from 1; ascending in each row
    """
    for s in range(len(ranks)):
        seen, b = np.int64(0), begin
        for k in range(ranks.shape[1]):
            while seen + bins[s, b] < ranks[s, k]:
                seen += bins[s, b]
                b += 1
            places[s, k] = b - begin
