"""Count what all rocks did in the cells of one kind: map cells, facets, zones or areas of interest.

A tally contains only counts, largest or smallest values, and sums of whole numbers. So the order in which visits are
added changes nothing: any number of threads, batches and parts of an ensemble give the same bits.

The cost of a visit depends on the memory that it touches. So the counts and sums of a cell fill one cache line
(`walks/cache_lines.py`), bins are bytes, and lines are prefetched. Overflows of a byte are carried (`carries.py`).
"""

import threading
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.hazard.bins import PER_OCTAVE, Scales
from rpf3d_core.hazard.carries import AT_ONCE, Carries, in_pairs
from rpf3d_core.hazard.slots import SlotTable, empty_slots, fold_visits, nothing_ahead, number_cells
from rpf3d_core.hazard.walks.cache_lines import LINE, Found, add_found, found_in
from rpf3d_core.hazard.walks.visits import USED, Visits
from rpf3d_core.hazard.walks.ways import WAY_BYTES
from rpf3d_core.jit.background import Call
from rpf3d_core.jit.memory import longer

FEWEST_SLOTS = 1024
"""Number of slots (rows for reached cells) when memory is first allocated, unless there are fewer cells."""
GROWTH = 4
"""Factor by which the memory grows when all slots are in use.

With this factor, copies are a small part of all bytes that are written.
"""
MOST_MERGES = PER_OCTAVE.bit_length() - 1
"""Largest number of times that bins are merged in pairs to save memory: a bin is then an octave wide."""
BYTES_PER_CELL = 132
"""Memory (bytes) that is planned for each cell of a map, without bins.

It covers the slot number of the cell, its entries in the visits of a thread and in the known neighbours of facets
(`Sheet`), and its map values if rocks reach it.
"""
BYTES_PER_SLOT = LINE + 4
"""Memory (bytes) that a reached cell needs in addition to its bins."""
LEAST_SHARE = 0.2
"""Share of the memory for maps (-) that bins may always take, even if the memory for cells leaves less."""


class CellTally:
    """Counts of what rocks did in each of C cells of one kind, added while rocks fly.

    If the counts of the reached cells need more than `limit` bytes, bins are merged in pairs, but at most MOST_MERGES
    times. The merging depends only on the cells that rocks reached, not on the order of the rocks.

    cells : C; scales : bins of energy, speed and height
    compiled : False for so few rocks that plain Python finishes before the loop is compiled
    ways : True to count the lengths of paths inside cells
    slot, slots : number of each cell's slot (C,), and the slots with the counts, as in `SlotTable`
    used : number of slots in use, that is, of cells that rocks reached
    carries : overflows of the one-byte bins; merges : number of times that bins were merged in pairs
    """

    def __init__(self, cells: int, scales: Scales, limit: float, compiled: bool = True, ways: bool = False) -> None:
        self.scales, self.limit, self.merges = scales, limit, 0
        self.compiled = compiled
        self.slot = np.full(cells, -1, dtype=np.int32)
        self.used = 0
        self.slots = empty_slots(0, sum(scales.bins), ways)
        self.carries = Carries(sum(scales.bins))
        self._ahead, self._fresh = nothing_ahead(), np.empty(0, dtype=np.int32)
        self._lock = threading.Lock()

    def emptied(self, scales: Scales, limit: float) -> "CellTally":
        """Return an empty tally of the same cells, in the memory of this tally: do not use this tally afterwards.

        The cost depends on the number of cells that rocks reached, not on the number of all cells.

        scales : bins of the new tally; limit : bytes above which its bins are merged
        """
        fresh = CellTally(0, scales, limit, self.compiled, self.ways)
        self.slot[self.slots.cell[: self.used]] = -1
        fresh.slot = self.slot
        return fresh

    def widened(self, cells: int) -> None:
        """Enlarge the memory so that at least `cells` cells can be counted."""
        self.slot = longer(self.slot, cells, -1)

    @property
    def ways(self) -> bool:
        """True if the lengths of paths inside cells are counted."""
        return self.slots.ways is not None

    def with_ways(self) -> "CellTally":
        """Return an empty tally of the same cells that also counts the lengths of paths inside them."""
        return CellTally(len(self.slot), self.scales, self.limit, self.compiled, True)

    def fold(self, visits: Visits) -> None:
        """Add the visits of some rocks to the counts, and empty `visits`; any thread may call this method.

        All visits of a rock must be added at once.
        """
        used = int(visits.state[USED])
        with self._lock:
            self._take_in(visits.cell[:used])
            full = self.carries.room_for(3 * used)
            fold = fold_visits if self.compiled else fold_visits.py_func  # type: ignore[attr-defined]
            carried = fold(self._table, visits._replace(rock=None), used, self._ahead, full)
            self.carries.take(carried)
        visits.state[:] = 0

    def loop(self, visits: Visits) -> Call:
        """Return the compiled loop of `fold` with arguments that add no visits, so that it can be compiled early."""
        full = self.carries.room_for(0)
        return fold_visits, (self._table, visits._replace(rock=None), 0, self._ahead, full)

    @property
    def _table(self) -> SlotTable:
        """All memory of this tally, in the form that compiled loops read."""
        return SlotTable(slot=self.slot, slots=self.slots, scales=self.scales, merges=self.merges)

    def add(self, other: "CellTally") -> None:
        """Add the counts of another tally of the same cells, as if this tally had counted the rocks of both tallies.

        Both tallies need the same scales, and either both or neither count path lengths.
        """
        with self._lock:
            self._take_in(other.slots.cell[: other.used])
            while self.merges < other.merges:
                self._merge_bins()
            place = self.slot[other.slots.cell[: other.used]]
            theirs = found_in(other.slots.lines, other.slots.cell[: other.used], np.arange(other.used))
            add_found(self.slots.lines, place, theirs)
            if self.slots.ways is not None:
                self.slots.ways[place] += other.slots.ways[: other.used]
            bins, carries = other.slots.bins[: other.used], other.carries
            for _ in range(self.merges - other.merges):
                bins, carries = in_pairs(bins, carries)
            self.carries.join(carries, place)
            self.carries.add_bins(self.slots.bins, place, bins)

    def found(self) -> Found:
        """Return the counts of the S cells that rocks reached, in order of cell, without bins (see `bins_found`)."""
        order, ways = self._order(), self.slots.ways
        found = found_in(self.slots.lines, self.slots.cell[order], order)
        return found if ways is None else found._replace(ways=ways[order])

    def bins_found(self, some: NDArray[np.intp] | None = None) -> Iterator[NDArray[np.uint32]]:
        """Yield the true counts in the bins (N, B) of the reached cells, N cells at a time to save memory.

        some : indices of the wanted cells among the cells of `found`; None for all
        """
        order = self._order() if some is None else self._order()[some]
        for begin in range(0, len(order), AT_ONCE):
            yield self.carries.whole(self.slots.bins, order[begin : begin + AT_ONCE])

    def _order(self) -> NDArray[np.int64]:
        """Return the slots of the reached cells, in order of cell."""
        return np.argsort(self.slots.cell[: self.used], kind="stable")

    def _take_in(self, cells: NDArray[np.int32]) -> None:
        """Give a slot (a row of counts) to each given cell without one; merge bins or enlarge the memory if needed."""
        first, new = self.used, self._new_cells(cells)
        self.used += new
        beside = BYTES_PER_SLOT + (WAY_BYTES if self.ways else 0)
        while self.merges < MOST_MERGES and self.used * (self.slots.bins.shape[1] + beside) > self.limit:
            self._merge_bins()
        if self.used > len(self.slots.cell):
            self._grow(min(max(FEWEST_SLOTS, GROWTH * self.used), len(self.slot)))
        self.slots.cell[first : self.used] = self._fresh[:new]

    def _new_cells(self, cells: NDArray[np.int32]) -> int:
        """Find the given cells that have no slot, write them to the start of `_fresh`, and return their number."""
        if len(self._fresh) < len(cells):
            self._fresh = np.empty(len(cells), dtype=np.int32)
        number = number_cells if self.compiled else number_cells.py_func  # type: ignore[attr-defined]
        return int(number(self.slot, cells, self.used, self._fresh))

    def _grow(self, room: int) -> None:
        """Move all counts into larger memory, with `room` slots."""
        grown, used = empty_slots(room, self.slots.bins.shape[1], self.ways), len(self.slots.cell)
        grown.cell[:used], grown.bins[:used] = self.slots.cell, self.slots.bins
        grown.lines.long[:used] = self.slots.lines.long
        if self.ways:
            grown.ways[:used] = self.slots.ways
        self.slots = grown

    def _merge_bins(self) -> None:
        """Merge the bins of all cells in pairs, to halve their memory."""
        self.merges += 1
        bins, self.carries = in_pairs(self.slots.bins, self.carries)
        self.slots = self.slots._replace(bins=bins)
