"""From a tally to layers: shares, means and percentiles of every cell that rocks came to."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.hazard.bins import bin_edges, bin_values, relative_error
from rpf3d_core.hazard.maps import FEWEST_ROCKS, PERCENTILES, CellStatistics, CountArray, Layers, StatisticArray
from rpf3d_core.hazard.tally import SUM_UNITS, CellTally
from rpf3d_core.hazard.walks.cache_lines import Found
from rpf3d_core.hazard.walks.ways import WAY_UNITS
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.terrain.frame import FloatArray

ENERGY = 0
"""The first of the three quantities that have bins: energy, speed, height."""
FEW = 100_000
"""Bins of some cells, of all quantities together, up to which NumPy looks for ranks: before the loop is compiled."""


def layers_of(tally: CellTally) -> Layers:
    """The layers of the cells of a tally that rocks came to."""
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
    """The layers of zones and areas: a rock goes from facet to facet of a zone without leaving it."""
    return replace(layers, passages=np.zeros_like(layers.passages))


def _edges(tally: CellTally, q: int) -> FloatArray:
    """Edges of the bins of a quantity, as they are after merging; of speeds without bins, what energies stand for."""
    top, bins, per_octave = tally.scales
    if bins[q] == 0:
        return top[q] * np.sqrt(_edges(tally, ENERGY) / top[ENERGY])
    return bin_edges(top[q], bins[q], per_octave)[:: 2**tally.merges]


def _percentiles_of(tally: CellTally, found: Found, edges: list[FloatArray]) -> StatisticArray:
    """Percentiles (3, S, P) of the three quantities in S cells, as values of bins; NaN where few rocks came."""
    told = np.full((3, len(found.cell), len(PERCENTILES)), np.nan, dtype=np.float32)
    values, many, first = [bin_values(some) for some in edges], np.flatnonzero(found.rocks >= FEWEST_ROCKS), 0
    for bins in tally.bins_found(many):
        some = many[first : first + len(bins)]
        ranks = -((-found.rocks[some, None] * np.array(PERCENTILES)) // 100)
        for q in range(3):
            if q == ENERGY or tally.scales.bins[q] > 0:  # or speed, which is told from the energy's
                place = _places(bins, _columns(tally, q), ranks)
            told[q, some] = values[q][place]
        first += len(bins)
    return told


def _columns(tally: CellTally, q: int) -> slice:
    """Where the bins of a quantity stand, as they are after merging."""
    bins = tally.scales.bins
    return slice(sum(bins[:q]) >> tally.merges, sum(bins[: q + 1]) >> tally.merges)


def _places(bins: NDArray[np.uint32], columns: slice, ranks: CountArray) -> CountArray:
    """The bin, among some columns of bins (N, B), that the rock of each rank (N, P), ascending, stands in: (N, P)."""
    if bins.size <= FEW:
        up_to = np.cumsum(bins[:, columns], axis=1)
        return np.stack([np.count_nonzero(up_to < rank[:, None], axis=1) for rank in ranks.T], axis=1)
    places = np.empty(ranks.shape, dtype=np.int64)
    _find_ranks(bins, columns.start, ranks, places)
    return places


def _spread(tally: CellTally, found: Found, q: int, percentiles: StatisticArray) -> CellStatistics:
    """The spread of one quantity over the rocks of each cell, from its percentiles (S, P)."""
    largest = found.most[:, q]
    mean = found.sums[:, q] * (tally.scales.top[q] / SUM_UNITS) / found.rocks
    return CellStatistics(largest, mean.astype(np.float32), *np.minimum(percentiles.T, largest))


@loop
def _find_ranks(bins: Any, begin: int, ranks: Any, places: Any) -> None:
    """Fill in where the rocks of ascending ranks stand in each cell, counted from column `begin` on."""
    for s in range(len(ranks)):
        seen, b = np.int64(0), begin
        for k in range(ranks.shape[1]):
            while seen + bins[s, b] < ranks[s, k]:
                seen += bins[s, b]
                b += 1
            places[s, k] = b - begin
