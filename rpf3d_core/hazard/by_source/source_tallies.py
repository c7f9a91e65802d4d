"""Count the rocks of each source separately in zones and areas of interest, and in map cells if memory allows.

Shares over the rocks of all sources depend on how many rocks each source has: many rocks of a harmless source hide the
rocks of a dangerous one. So the places are counted for each source, too. All P places of the first source come first,
then all places of the second source, and so on: place p of source s is number s P + p.
"""

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.hazard.bins import Scales
from rpf3d_core.hazard.by_source.source_cells import SourceCells, WorstCells, fold_sources
from rpf3d_core.hazard.layers import layers_of, without_passages
from rpf3d_core.hazard.maps import CellStatistics, Layers
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.walk import Scratch
from rpf3d_core.values import Outcome

MEMORY = 64e6
"""Bytes of bins above which zones, or areas, of all sources get coarse bins like map cells.

With coarse bins, p95 energies are less exact.
"""


class SourceMaps(NamedTuple):
    """The values of zones and areas for each of S sources, with Z zones and A areas.

    names : of the sources; flown, lost : (S,) rocks flown from each source, and lost to holes
    zones, areas : values of S Z zones, and of S A areas
    cells : the largest values of any single source in each map cell; None if the counts needed too much memory
    barriers : (S,) for each source, `hazard.barriers.BarrierFigures` of each barrier; empty without barriers
    """

    names: tuple[str, ...]
    flown: IntArray
    lost: IntArray
    zones: Layers
    areas: Layers
    cells: WorstCells | None = None
    barriers: tuple[tuple[Any, ...], ...] = ()


@dataclass(frozen=True, eq=False)
class SourceTallies:
    """The counts (tallies) of zones, areas and map cells for each of S sources.

    names : of the sources; zones, inside : tallies of S Z zones, and of S A areas; cells : counts of map cells
    flown, lost : (S,) rocks flown from each source, and lost to holes
    """

    names: tuple[str, ...]
    zones: CellTally
    inside: CellTally
    cells: SourceCells
    flown: IntArray
    lost: IntArray
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def note_flown(self, batch: Batch, source: IntArray) -> None:
        """Count the N rocks of a batch; source : (N,) number of each rock's source. Any thread may call this method."""
        lost = batch.counts[:, 0] == Outcome.LOST_TO_HOLE
        with self._lock:
            np.add.at(self.flown, source, 1)
            np.add.at(self.lost, source[lost], 1)

    def fold(self, scratch: Scratch, source: IntArray) -> None:
        """Add visits to zones, areas and map cells to the counts of their sources; the visits do not change.

        source : (N,) number of the source of each rock of the batch
        """
        for tally, visits in ((self.zones, scratch.zones), (self.inside, scratch.areas)):
            fold_sources(tally, visits, source, len(tally.slot) // len(self.names))
        self.cells.fold(scratch.squares, source)

    def add(self, other: "SourceTallies") -> None:
        """Add the counts of another part of the same ensemble."""
        self.zones.add(other.zones)
        self.inside.add(other.inside)
        self.cells.add(other.cells.tally)
        self.note_counts(other.flown, other.lost)

    def note_counts(self, flown: IntArray, lost: IntArray) -> None:
        """Add numbers (S,) of rocks of each source of another part: rocks flown, and rocks lost to holes."""
        with self._lock:
            self.flown[:] += flown
            self.lost[:] += lost

    def emptied(self) -> "SourceTallies":
        """Return empty counts of the same sources, zones and areas, without counts of map cells."""
        zones, inside = (_empty(tally, len(tally.slot), tally.scales) for tally in (self.zones, self.inside))
        flown, lost = np.zeros_like(self.flown), np.zeros_like(self.lost)
        return SourceTallies(self.names, zones, inside, SourceCells(None, 0), flown, lost)

    def maps(self, squares: Layers) -> SourceMaps:
        """Return the values of zones, areas and map cells for each source; counting may continue afterwards.

        squares : values of all rocks in map cells
        """
        zones, areas = (without_passages(layers_of(tally)) for tally in (self.zones, self.inside))
        flown, cells = self.flown.copy(), self.cells.worst(squares, self.flown)
        return SourceMaps(self.names, flown, self.lost.copy(), zones, areas, cells)


def source_tallies(names: Sequence[str], zones: CellTally, inside: CellTally, squares: CellTally) -> SourceTallies:
    """Return empty counts of zones, areas and map cells for each of S sources.

    names : of the sources; zones, inside : tallies of the Z zones and A areas, whose bins are used if memory allows
    squares : tally of the map cells, whose bins are used for too many places
    """

    def of_each(tally: CellTally) -> CellTally:
        cells = len(names) * len(tally.slot)
        fits = cells * sum(tally.scales.bins) <= MEMORY
        return _empty(tally, cells, tally.scales if fits else squares.scales)

    none = np.zeros(len(names), dtype=np.int64)
    cells = SourceCells(squares, len(names))
    return SourceTallies(tuple(names), of_each(zones), of_each(inside), cells, flown=none, lost=none.copy())


def _empty(tally: CellTally, cells: int, scales: Scales) -> CellTally:
    """Return an empty tally of `cells` cells whose bins are never merged, with the settings of `tally`.

    The reason is that `by_set.set_places` subtracts earlier counts of bins from later counts.
    """
    return CellTally(cells, scales, math.inf, tally.compiled)


def part_of(layers: Layers, number: int, sources: int) -> Layers:
    """Return the values of the places of one source.

    layers : values of the places of all sources; number : of the source, from 0; sources : number of sources
    """
    count = layers.count // sources
    first, last = np.searchsorted(layers.cell, [number * count, (number + 1) * count]).tolist()
    some = slice(first, last)
    changed: dict[str, Any] = {name: getattr(layers, name)[some] for name in _ARRAYS}
    changed["cell"] = changed["cell"] - number * count
    for name in ("energy", "speed", "height"):
        spread = vars(getattr(layers, name))
        changed[name] = CellStatistics(**{key: values[some] for key, values in spread.items()})
    return replace(layers, count=count, **changed)


_ARRAYS = ("cell", "rocks", "passages", "impacts", "deposits", "first_arrival")
"""Arrays of `Layers` with one value for each reached place."""
