"""Count the rocks of each source in map cells, and find for each cell the largest values of any single source.

Cell c of source s is number s C + c of a tally, with C cells in the map. Memory is bounded: nothing is counted if the
slot numbers of all cells of all sources need more memory than the limit, or if 32 bits are too few to number the cells.
The counts are given up while rocks fly if the cells that rocks of the sources reached need more memory than the limit.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.hazard.by_source.worst import ALL
from rpf3d_core.hazard.layers import ENERGY, bins_of, rank_values
from rpf3d_core.hazard.maps import FEWEST_ROCKS, CountArray, Layers
from rpf3d_core.hazard.tally import BYTES_PER_SLOT, MOST_MERGES, CellTally
from rpf3d_core.hazard.walks.cache_lines import Found
from rpf3d_core.hazard.walks.visits import USED, Visits

P95 = 95
SHARE = 0.5
"""Limit of the memory for the counts of all sources, as a share (-) of the memory for the bins of map cells.

The limit holds separately for the slot numbers of all cells, and for the counts of the cells that rocks reached.
"""
NUMBER_BYTES = 4
"""Memory (bytes) for the slot number of a cell of a source, whether rocks reached the cell or not."""
MOST_NUMBERS = 2**31 - 1
"""Largest number of cells of all sources: cells have 32-bit numbers."""
AT_ONCE = 65_536
"""Number of cells whose percentiles are computed at once, to save memory."""


class WorstCells(NamedTuple):
    """The largest values of any single source in the S map cells that rocks reached, ordered as `HazardMaps.cells`.

    reach : (S,) largest share (-), over all sources, of a source's rocks that reached the cell
    reach_source : (S,) number of the source with this share
    energy : (S,) J, the largest p95 energy of all rocks together and of each source with at least 20 rocks in the cell;
        NaN if unknown
    energy_source : (S,) number of this source, ALL for all rocks or if unknown
    has_few : (S,) True if a source has rocks in the cell, but too few for a p95 energy of its own
    """

    reach: FloatArray
    reach_source: IntArray
    energy: FloatArray
    energy_source: IntArray
    has_few: NDArray[np.bool_]


class SourceCells:
    """The counts of each source in the C cells of a map; the counts are given up if they need too much memory.

    cells : C; tally : counts of all cells of all sources; None if they need too much memory
    most : largest number of reached cells, summed over the sources, above which the counts are given up
    """

    def __init__(self, squares: CellTally | None, sources: int) -> None:
        """Start with empty counts; squares : tally of the map cells for all sources together, None to count nothing.

        sources : number of sources
        """
        self.tally: CellTally | None = None
        self.cells, self.most = 0, 0.0
        if squares is not None:
            limit, numbers = SHARE * squares.limit, sources * len(squares.slot)
            self.cells = len(squares.slot)
            self.most = limit / (BYTES_PER_SLOT + (sum(squares.scales.bins) >> MOST_MERGES))
            if numbers <= MOST_NUMBERS and NUMBER_BYTES * numbers <= limit:
                self.tally = CellTally(numbers, squares.scales, limit, squares.compiled)

    def fold(self, visits: Visits, source: IntArray) -> None:
        """Add the visits to map cells to the counts, which may then be given up; the visits do not change.

        Any thread may call this method, also while another thread gives the counts up.

        source : (N,) number of the source of each rock of the batch
        """
        if (tally := self.tally) is not None:
            fold_sources(tally, visits._replace(way=None), source, self.cells)
            self.check()

    def add(self, other: "CellTally | None") -> None:
        """Add the counts of another part of the same ensemble.

        other : counts of the part; None if the part gave its counts up: these counts are then given up, too
        """
        if other is None:
            self.tally = None
        elif (tally := self.tally) is not None:
            tally.add(other)
            self.check()

    def check(self) -> None:
        """Give the counts up (`tally` becomes None) if the sources' rocks reached more than `most` cells."""
        if (tally := self.tally) is not None and tally.used > self.most:
            self.tally = None

    def worst(self, together: Layers, flown: IntArray) -> WorstCells | None:
        """Return the largest values of any single source in each reached cell; None if the counts were given up.

        together : values of all rocks in map cells; flown : (S,) rocks flown from each source
        """
        if (tally := self.tally) is None:
            return None
        found = tally.found()
        source, cell = np.divmod(found.cell, self.cells)
        energy = _p95_energies(tally, found)
        reach, of_reach = _largest(cell, source, found.rocks / flown[source], together.cell)
        known = np.flatnonzero(np.isfinite(energy))
        most, of_energy = _largest(cell[known], source[known], energy[known], together.cell)
        above = np.nan_to_num(most, nan=-1.0) > np.nan_to_num(together.energy.p95.astype(float), nan=-1.0)
        return WorstCells(
            reach=reach, reach_source=of_reach, energy=np.where(above, most, together.energy.p95),
            energy_source=np.where(above, of_energy, ALL),
            has_few=np.isin(together.cell, cell[found.rocks < FEWEST_ROCKS]),
        )  # fmt: skip


def fold_sources(tally: CellTally, visits: Visits, source: IntArray, cells: int) -> None:
    """Add visits to the cells of their sources; the visits do not change.

    tally : counts of all cells of all sources; visits : to the cells of one kind, with the rock of each visit
    source : (N,) number of the source of each rock of the batch; cells : number of cells of each source
    """
    used = int(visits.state[USED])
    cell = source[visits.rock[:used]] * cells + visits.cell[:used]
    tally.fold(visits._replace(cell=cell.astype(np.int32), state=visits.state.copy(), rock=None))


def _p95_energies(tally: CellTally, found: Found) -> FloatArray:
    """Return the p95 energies (N,) J in the N reached cells of a tally; NaN for too few rocks.

    found : the counts of these cells; an energy from bins is limited to the largest energy in the cell
    """
    energy, many = np.full(len(found.cell), np.nan), np.flatnonzero(found.rocks >= FEWEST_ROCKS)
    for begin in range(0, len(many), AT_ONCE):
        some = many[begin : begin + AT_ONCE]
        bins = bins_of(tally, ENERGY, tally.slot[found.cell[some]].astype(np.intp))
        ranks = -((-found.rocks[some] * P95) // 100)
        energy[some] = np.minimum(rank_values(tally, ENERGY, bins, ranks).astype(np.float32), found.most[some, ENERGY])
    return energy


def _largest(
    cell: CountArray, source: IntArray, values: FloatArray, wanted: CountArray
) -> tuple[FloatArray, IntArray]:
    """Return for each wanted cell the largest value there (S,), and the source of this value (S,).

    A cell without values has NaN and ALL. If sources have equal values, the source with the lowest number counts.

    cell, source, values : (N,) values, each with the number of its cell and of its source
    wanted : (S,) numbers of the wanted cells, ascending
    """
    some = np.isin(cell, wanted)  # while rocks fly, a source may have reached a cell that the map does not have yet
    cell, source, values = cell[some], source[some], values[some]
    order = np.lexsort((-source, values, cell))
    last = order[np.append(cell[order][1:] != cell[order][:-1], True)[: len(order)]]
    largest, of = np.full(len(wanted), np.nan), np.full(len(wanted), ALL, dtype=np.int64)
    place = np.searchsorted(wanted, cell[last])
    largest[place], of[place] = values[last], source[last]
    return largest, of
