"""From a tally to layers: shares, means and percentiles of every cell that rocks came to."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.compiling import loop
from rpf3d_core.hazard.bins import bin_edges, bin_values, relative_error
from rpf3d_core.hazard.lines import Found
from rpf3d_core.hazard.maps import FEWEST_ROCKS, PERCENTILES, CountArray, Layers, Spread
from rpf3d_core.hazard.tally import SUM_UNITS, Tally
from rpf3d_core.terrain.frame import FloatArray

ENERGY = 0
"""The first of the three quantities that have bins: energy, speed, height."""
FEW = 100_000
"""Bins up to which NumPy tells the percentiles, cell by cell: it is done before the loop has been compiled."""


def layers_of(tally: Tally) -> Layers:
    """The layers of the cells of a tally that rocks came to."""
    found = tally.found()
    edges = [_edges(tally, q) for q in range(3)]
    percentiles = _percentiles_of(tally, found, edges)
    energy, speed, height = (_spread(tally, found, q, percentiles[q]) for q in range(3))
    return Layers(
        len(tally.slot), found.cell, found.rocks, found.passages, found.impacts, found.deposits, found.first,
        energy, speed, height, max(relative_error(some) for some in edges),
    )  # fmt: skip


def without_passages(layers: Layers) -> Layers:
    """The layers of zones and areas: a rock goes from facet to facet of a zone without leaving it."""
    return replace(layers, passages=np.zeros_like(layers.passages))


def _edges(tally: Tally, q: int) -> FloatArray:
    """Edges of the bins of a quantity, as they are after merging; of speeds without bins, what energies stand for."""
    top, bins, per_octave = tally.scales
    if bins[q] == 0:
        return top[q] * np.sqrt(_edges(tally, ENERGY) / top[ENERGY])
    return bin_edges(top[q], bins[q], per_octave)[:: 2**tally.merges]


def _percentiles_of(tally: Tally, found: Found, edges: list[FloatArray]) -> FloatArray:
    """Percentiles (3, S, P) of the three quantities in S cells, as values of bins; NaN where few rocks came."""
    told = np.full((3, len(found.cell), len(PERCENTILES)), np.nan)
    many = np.flatnonzero(found.rocks >= FEWEST_ROCKS)
    first = 0
    for bins in tally.bins_found(many):
        some = many[first : first + len(bins)]
        for q in range(3):
            told[q, some] = _told(bins[:, _columns(tally, q)], found.rocks[some], bin_values(edges[q]))
        first += len(bins)
    return told


def _columns(tally: Tally, q: int) -> slice:
    """Where the bins of a quantity stand, as they are after merging."""
    bins = tally.scales.bins
    if bins[q] == 0:
        return _columns(tally, ENERGY)
    return slice(sum(bins[:q]) >> tally.merges, sum(bins[: q + 1]) >> tally.merges)


def _told(bins: NDArray[np.uint32], rocks: CountArray, values: FloatArray) -> FloatArray:
    """Percentiles (N, P) of cells with bins (N, B), which stand for values (B,)."""
    if bins.size <= FEW:
        up_to, ranks = np.cumsum(bins, axis=1), -((-rocks[:, None] * np.array(PERCENTILES)) // 100)
        place = [np.searchsorted(*some) for some in zip(up_to, ranks, strict=True)]
        return values[np.array(place, dtype=np.int64).reshape(-1, len(PERCENTILES))]
    told = np.empty((len(rocks), len(PERCENTILES)))
    _percentiles(np.ascontiguousarray(bins), rocks, values, np.array(PERCENTILES), told)
    return told


def _spread(tally: Tally, found: Found, q: int, percentiles: FloatArray) -> Spread:
    """The spread of one quantity over the rocks of each cell, from its percentiles (S, P)."""
    largest = found.most[:, q]
    percentiles = np.minimum(percentiles, largest[:, None])
    mean = found.sums[:, q] * (tally.scales.top[q] / SUM_UNITS) / found.rocks
    return Spread(*(column.astype(np.float32) for column in (largest, mean, *percentiles.T)))


@loop
def _percentiles(bins: Any, rocks: Any, values: Any, percentiles: Any, out: Any) -> None:
    """Percentiles of each cell: the value of the bin in which the rock of rank ceil(p n) stands."""
    for s in range(len(rocks)):
        n, seen, b = rocks[s], np.int64(0), 0
        for k in range(len(percentiles)):
            rank = -((-n * percentiles[k]) // 100)
            while seen + bins[s, b] < rank:
                seen += bins[s, b]
                b += 1
            out[s, k] = values[b]
