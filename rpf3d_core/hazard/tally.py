"""What all rocks together did in each cell of one kind: the sum of the visits of single rocks.

Everything that is kept is a count, a largest or smallest value, or a sum of whole numbers. So the order in which visits
are added changes nothing: any number of threads, batches and parts of an ensemble give the same bits.

The memory that a visit touches decides what it costs. So the counts and sums of a cell fill one cache line
(`walks/cache_lines.py`), bins are bytes, and lines are prefetched. Overflows of a byte are carried (`carries.py`).
"""

import math
import threading
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.hazard.bins import PER_OCTAVE, Scales, bin_of
from rpf3d_core.hazard.carries import AT_ONCE, Carries, in_pairs
from rpf3d_core.hazard.walks.cache_lines import (
    LINE,
    LINE_DEPOSITS,
    LINE_FIRST,
    LINE_IMPACTS,
    LINE_MOST,
    LINE_PASSAGES,
    LINE_ROCKS,
    LINE_SUMS,
    CacheLines,
    Found,
    add_found,
    empty_lines,
    found_in,
)
from rpf3d_core.hazard.walks.visits import DEPOSITS, FIRST, HEIGHT, IMPACTS, PASSAGES, SPEED2, USED, Visits, energy2_of
from rpf3d_core.hazard.walks.ways import WAY_BYTES, add_way
from rpf3d_core.jit.background import Call
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.jit.memory import longer
from rpf3d_core.jit.prefetch import prefetch

FEWEST_SLOTS = 1024
"""Slots when memory is first allocated, unless there are fewer cells."""
GROWTH = 4
"""Factor by which full slots grow: the copied bytes then stay a small part of all bytes written."""
AHEAD = 32
"""Visits whose memory is prefetched before the first of them is added: more than the processor looks ahead."""
MOST_MERGES = PER_OCTAVE.bit_length() - 1
"""Most mergings in pairs: after them a bin is an octave wide."""
BYTES_PER_CELL = 132
"""Bytes that every cell needs, whether rocks come to it or not: for its slot number here, in the visits of a thread, in
the sheet of facets, and in layers if rocks come."""
BYTES_PER_SLOT = LINE + 4
"""Bytes that a cell needs in addition to its bins once rocks have come to it."""
LEAST_SHARE = 0.2
"""Share of the memory for maps that bins may take, even if the cells leave less."""
SUM_UNITS = 2.0**34
"""Sums are counted in units of the largest value over 2^34, so that 2^29 rocks fit in 64 bits."""


class Slots(NamedTuple):
    """The figures of S cells that rocks came to.

    cell : (S,); lines : one cache line for each cell, with sums in units of `Scales.top` over SUM_UNITS
    bins : (S, B) rocks in each bin of energy, then of speed, then of height, without carries
    ways : (S, 2) as in `hazard.walks.ways`; None if not gathered
    """

    cell: Any
    lines: CacheLines
    bins: Any
    ways: Any = None


class Ahead(NamedTuple):
    """Scratch: where the next visits will be added.

    slot : (A,); values : (A, 3) energy, speed and height over `Scales.top`; bits : the same memory as whole numbers
    bins : (A, 3) the bin of each value
    """

    slot: Any
    values: Any
    bits: Any
    bins: Any


class CellTally:
    """Counts over C cells of one kind.

    Bins take at most `limit` bytes. Beyond that they are merged in pairs, at most until each is an octave wide. The
    merging depends only on the cells that rocks came to, so the result does not depend on the order of the rocks.
    compiled : False if so few rocks come that plain Python finishes before the loop is compiled
    ways : whether the lengths of tracks inside cells are gathered
    """

    def __init__(self, cells: int, scales: Scales, limit: float, compiled: bool = True, ways: bool = False) -> None:
        self.scales, self.limit, self.merges = scales, limit, 0
        self.compiled = compiled
        self.slot = np.full(cells, -1, dtype=np.int32)
        self.used = 0
        self.slots = empty_slots(0, sum(scales.bins), ways)
        self.carries = Carries(sum(scales.bins))
        self._ahead, self._fresh = _nothing_ahead(), np.empty(0, dtype=np.int32)
        self._lock = threading.Lock()

    def emptied(self, scales: Scales, limit: float) -> "CellTally":
        """Return an empty tally of the same cells that reuses this tally's memory; do not use this tally afterwards.

        The cost depends on the cells that rocks came to, not on the number of all cells.
        """
        fresh = CellTally(0, scales, limit, self.compiled, self.ways)
        self.slot[self.slots.cell[: self.used]] = -1
        fresh.slot = self.slot
        return fresh

    def widened(self, cells: int) -> None:
        """Make room for `cells` cells in all, if there is less."""
        self.slot = longer(self.slot, cells, -1)

    @property
    def ways(self) -> bool:
        """True if the lengths of tracks inside cells are gathered."""
        return self.slots.ways is not None

    def with_ways(self) -> "CellTally":
        """Return an empty tally of the same cells that gathers the lengths of tracks inside them."""
        return CellTally(len(self.slot), self.scales, self.limit, self.compiled, True)

    def fold(self, visits: Visits) -> None:
        """Add the visits of whole rocks to the tally and empty `visits`; any thread may call."""
        used = int(visits.state[USED])
        with self._lock:
            self._take_in(visits.cell[:used])
            full = self.carries.room_for(3 * used)
            fold = _fold if self.compiled else _fold.py_func  # type: ignore[attr-defined]
            carried = fold(self.slot, self.slots, visits, used, self.scales, self.merges, self._ahead, full)
            self.carries.take(carried)
        visits.state[:] = 0

    def loop(self, visits: Visits) -> Call:
        """Return the compiled loop of `fold` with arguments: no visits."""
        full = self.carries.room_for(0)
        return _fold, (self.slot, self.slots, visits, 0, self.scales, self.merges, self._ahead, full)

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
        """Return the figures of the S cells that rocks came to, in order of cell, without bins (see `bins_found`)."""
        order, ways = self._order(), self.slots.ways
        found = found_in(self.slots.lines, self.slots.cell[order], order)
        return found if ways is None else found._replace(ways=ways[order])

    def bins_found(self, some: NDArray[np.intp] | None = None) -> Iterator[NDArray[np.uint32]]:
        """Yield the bins of these cells including carries, (N, B) at a time: all at once would fill the memory.

        some : numbers of the wanted cells among those of `found`; None for all
        """
        order = self._order() if some is None else self._order()[some]
        for begin in range(0, len(order), AT_ONCE):
            yield self.carries.whole(self.slots.bins, order[begin : begin + AT_ONCE])

    def _order(self) -> NDArray[np.int64]:
        """Return the slots in order of cell."""
        return np.argsort(self.slots.cell[: self.used], kind="stable")

    def _take_in(self, cells: NDArray[np.int32]) -> None:
        """Give a slot to each cell that has none."""
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
        number = _number if self.compiled else _number.py_func  # type: ignore[attr-defined]
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


def empty_slots(room: int, bins: int, ways: bool = False) -> Slots:
    """Return room for S cells with B bins each, and track lengths if asked for; unused slots take no memory."""
    lengths = np.zeros((room, 2), dtype=np.int64) if ways else None
    return Slots(np.empty(room, dtype=np.int32), empty_lines(room), np.zeros((room, bins), dtype=np.uint8), lengths)


def _nothing_ahead() -> Ahead:
    values = np.empty((AHEAD, 3))
    return Ahead(np.empty(AHEAD, dtype=np.int32), values, values.view(np.int64), np.empty((AHEAD, 3), dtype=np.int32))


@loop
def _number(slot: Any, cells: Any, used: int, fresh: Any) -> int:
    """Give slots from number `used` on to cells that have none, in order, and write these to fresh; return how many."""
    new = 0
    for k in range(len(cells)):
        if slot[cells[k]] < 0:
            slot[cells[k]] = used + new
            fresh[new] = cells[k]
            new += 1
    return new


@loop
def _fold(
    slot: Any, slots: Slots, visits: Visits, used: int, scales: Scales, merges: int, ahead: Ahead, full: Any
) -> int:  # fmt: skip
    """Add the first `used` visits, each of one rock to one cell; return the number of bins that overflowed.

    The places of these bins are written to full. A place is that of a byte in `bins`: slot times bins plus bin. A byte
    that would reach 256 begins again at 0.
    """
    carried = 0
    for first in range(0, used, AHEAD):
        count = min(AHEAD, used - first)
        _look_ahead(slot, slots, visits, first, count, scales, merges, ahead)
        for a in range(count):
            _add_to_line(slots.lines, ahead.slot[a], visits, first + a, ahead.values, a)
            s = ahead.slot[a]
            add_way(slots.ways, visits.way, s, first + a)
            for q in range(3):
                b = ahead.bins[a, q]
                if b < 0:
                    continue
                if slots.bins[s, b] == 255:
                    slots.bins[s, b] = 0
                    full[carried] = np.int64(s) * slots.bins.shape[1] + b
                    carried += 1
                else:
                    slots.bins[s, b] += 1
    return carried


@kernel
def _look_ahead(
    slot: Any, slots: Slots, visits: Visits, first: int, count: int, scales: Scales, merges: int, ahead: Ahead
) -> None:
    """Find where the next visits will be added, and prefetch that memory, so that all of it arrives together."""
    offsets = (0, scales.bins[0], scales.bins[0] + scales.bins[1])
    per_top = (1.0 / scales.top[0], 1.0 / scales.top[1], 1.0 / scales.top[2])
    for a in range(count):
        ahead.slot[a] = slot[visits.cell[first + a]]
        prefetch(slots.lines.long, ahead.slot[a], 0)
    for a in range(count):
        k = first + a
        speed2 = visits.most[k, SPEED2]
        ahead.values[a, 0] = 0.5 * visits.mass[k] * energy2_of(visits.energy2, visits, k) * per_top[0]
        ahead.values[a, 1] = math.sqrt(speed2) * per_top[1]
        ahead.values[a, 2] = visits.most[k, HEIGHT] * per_top[2]
        for q in range(3):
            b = -1
            if scales.bins[q] > 0:
                b = (offsets[q] + bin_of(ahead.bits[a, q], scales.bins[q], scales.per_octave)) >> merges
                prefetch(slots.bins, ahead.slot[a], b)
            ahead.bins[a, q] = b


@kernel
def _add_to_line(lines: CacheLines, s: int, visits: Visits, k: int, values: Any, a: int) -> None:
    """Add visit k to line s; values : (A, 3) energy, speed and height over `Scales.top`, the visit's in row a."""
    t, speed2 = np.float32(visits.times[k, FIRST]), visits.most[k, SPEED2]
    if lines.short[s, LINE_ROCKS] == 0 or t < lines.single[s, LINE_FIRST]:
        lines.single[s, LINE_FIRST] = t
    lines.short[s, LINE_ROCKS] += 1
    lines.short[s, LINE_DEPOSITS] += visits.counts[k, DEPOSITS]
    lines.long[s, LINE_PASSAGES] += visits.counts[k, PASSAGES]
    lines.long[s, LINE_IMPACTS] += visits.counts[k, IMPACTS]
    energy2 = energy2_of(visits.energy2, visits, k)
    most = (0.5 * visits.mass[k] * energy2, math.sqrt(speed2), visits.most[k, HEIGHT])
    for q in range(3):
        lines.single[s, LINE_MOST + q] = max(lines.single[s, LINE_MOST + q], np.float32(most[q]))
        lines.long[s, LINE_SUMS + q] += np.int64(values[a, q] * SUM_UNITS + 0.5)
