"""Add up the visits of all rocks to the cells of one kind.

A tally holds only counts, largest or smallest values, and sums of whole numbers. So the order in which visits are added
changes nothing: any number of threads, batches and parts of an ensemble give the same bits.

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
"""Number of slots when memory is first allocated, unless there are fewer cells."""
GROWTH = 4
"""Factor by which the memory grows when all slots are in use: few of all bytes written are then copies."""
MOST_MERGES = PER_OCTAVE.bit_length() - 1
"""Largest number of times that bins are merged in pairs: a bin is then an octave wide."""
BYTES_PER_CELL = 132
"""Bytes that every cell needs, even if no rock reaches it: for its slot number here, in the visits of a thread, in the
sheet of facets, and in layers if rocks reach it."""
BYTES_PER_SLOT = LINE + 4
"""Bytes that a cell needs in addition to its bins once a rock has reached it."""
LEAST_SHARE = 0.2
"""Share of the memory for maps that bins may take, even if the cells leave less."""


class CellTally:
    """Counts over C cells of one kind.

    Bins take at most `limit` bytes. Beyond that they are merged in pairs, at most until each is an octave wide. The
    merging depends only on the cells that rocks reached, so the result does not depend on the order of the rocks.
    compiled : False for so few rocks that plain Python finishes before the loop is compiled
    ways : True to gather the lengths of tracks inside cells
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
        """Return an empty tally of the same cells that reuses this tally's memory; do not use this tally afterwards.

        The cost depends on the number of cells that rocks reached, not on the number of all cells.
        """
        fresh = CellTally(0, scales, limit, self.compiled, self.ways)
        self.slot[self.slots.cell[: self.used]] = -1
        fresh.slot = self.slot
        return fresh

    def widened(self, cells: int) -> None:
        """Make room for at least `cells` cells."""
        self.slot = longer(self.slot, cells, -1)

    @property
    def ways(self) -> bool:
        """True if the lengths of tracks inside cells are gathered."""
        return self.slots.ways is not None

    def with_ways(self) -> "CellTally":
        """Return an empty tally of the same cells that gathers the lengths of tracks inside them."""
        return CellTally(len(self.slot), self.scales, self.limit, self.compiled, True)

    def fold(self, visits: Visits) -> None:
        """Add visits to the tally, all visits of a rock at once, and empty `visits`; any thread may call."""
        used = int(visits.state[USED])
        with self._lock:
            self._take_in(visits.cell[:used])
            full = self.carries.room_for(3 * used)
            fold = fold_visits if self.compiled else fold_visits.py_func  # type: ignore[attr-defined]
            carried = fold(self._table, visits, used, self._ahead, full)
            self.carries.take(carried)
        visits.state[:] = 0

    def loop(self, visits: Visits) -> Call:
        """Return the compiled loop of `fold` with arguments: no visits."""
        full = self.carries.room_for(0)
        return fold_visits, (self._table, visits, 0, self._ahead, full)

    @property
    def _table(self) -> SlotTable:
        """The memory of this tally, as the loops read it."""
        return SlotTable(slot=self.slot, slots=self.slots, scales=self.scales, merges=self.merges)

    def add(self, other: "CellTally") -> None:
        """Add another tally of the same cells and scales: the same bits as if its rocks had been counted here."""
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
        """Return the figures of the S cells that rocks reached, in order of cell, without bins (see `bins_found`)."""
        order, ways = self._order(), self.slots.ways
        found = found_in(self.slots.lines, self.slots.cell[order], order)
        return found if ways is None else found._replace(ways=ways[order])

    def bins_found(self, some: NDArray[np.intp] | None = None) -> Iterator[NDArray[np.uint32]]:
        """Yield the bins (N, B) of the cells of `found`, carries included, N cells at a time to save memory.

        some : indices of the wanted cells among the cells of `found`; None for all
        """
        order = self._order() if some is None else self._order()[some]
        for begin in range(0, len(order), AT_ONCE):
            yield self.carries.whole(self.slots.bins, order[begin : begin + AT_ONCE])

    def _order(self) -> NDArray[np.int64]:
        """Return the slots in order of cell."""
        return np.argsort(self.slots.cell[: self.used], kind="stable")

    def _take_in(self, cells: NDArray[np.int32]) -> None:
        """Give a slot to each cell without a slot."""
        first, new = self.used, self._new_cells(cells)
        self.used += new
        beside = BYTES_PER_SLOT + (WAY_BYTES if self.ways else 0)
        while self.merges < MOST_MERGES and self.used * (self.slots.bins.shape[1] + beside) > self.limit:
            self._merge_bins()
        if self.used > len(self.slots.cell):
            self._grow(min(max(FEWEST_SLOTS, GROWTH * self.used), len(self.slot)))
        self.slots.cell[first : self.used] = self._fresh[:new]

    def _new_cells(self, cells: NDArray[np.int32]) -> int:
        """Number the cells without a slot, write them to the start of `_fresh`, and return their number."""
        if len(self._fresh) < len(cells):
            self._fresh = np.empty(len(cells), dtype=np.int32)
        number = number_cells if self.compiled else number_cells.py_func  # type: ignore[attr-defined]
        return int(number(self.slot, cells, self.used, self._fresh))

    def _grow(self, room: int) -> None:
        """Move all slots into memory for `room` slots."""
        grown, used = empty_slots(room, self.slots.bins.shape[1], self.ways), len(self.slots.cell)
        grown.cell[:used], grown.bins[:used] = self.slots.cell, self.slots.bins
        grown.lines.long[:used] = self.slots.lines.long
        if self.ways:
            grown.ways[:used] = self.slots.ways
        self.slots = grown

    def _merge_bins(self) -> None:
        """Merge the bins of all slots in pairs."""
        self.merges += 1
        bins, self.carries = in_pairs(self.slots.bins, self.carries)
        self.slots = self.slots._replace(bins=bins)
