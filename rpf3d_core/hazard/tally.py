"""What all rocks together did in each cell of one kind: the visits of one rock after another, folded in.

Everything that is kept is a count, a largest or smallest value, or a sum of whole numbers, so the order of folding
changes nothing: any number of threads, batches and parts of an ensemble give the same bits.

A visit costs as much as the memory it touches: so each cell's counts and sums fill one line of the cache, and its bins
are bytes. What a byte cannot hold is carried (`carries.py`).
"""

import math
import threading
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.compiling import loop
from rpf3d_core.hazard.bins import PER_OCTAVE, Scales, bin_of
from rpf3d_core.hazard.carries import AT_ONCE, Carries, in_pairs
from rpf3d_core.hazard.visits import DEPOSITS, FIRST, HEIGHT, IMPACTS, PASSAGES, SPEED2, USED, Visits

FEWEST_SLOTS = 1024
MOST_MERGES = PER_OCTAVE.bit_length() - 1
"""After so many mergings in pairs a bin is an octave wide."""
BYTES_PER_CELL = 128
"""That every cell needs, whether rocks come to it or not: its place here, in the visits of a thread, and in layers."""
BYTES_PER_SLOT = 84
"""That a cell needs beside its bins once rocks have come to it."""
LEAST_SHARE = 0.2
"""Of the memory for maps that bins may take, however little the cells leave."""
SUM_UNITS = 2.0**34
"""A sum counts in units of the largest value over 2^34, so that 2^29 rocks fit in 64 bits."""
ROCKS, SUMS = 0, 4
"""Columns of counts: rocks, passages, impacts, deposits; then the sums of energy, speed and height."""


class Slots(NamedTuple):
    """What is kept of S cells that rocks came to.

    cell : (S,); counts : (S, 8) rocks, passages, impacts, deposits, and sums in units of `Scales.top` over SUM_UNITS
    most : (S, 4) float32, largest energy (J), speed (m/s) and height (m), and earliest arrival (s)
    bins : (S, B) rocks in each bin of energy, then of speed, then of height, less what was carried
    """

    cell: Any
    counts: Any
    most: Any
    bins: Any


class Tally:
    """Counts over C cells of one kind.

    Its bins take at most `limit` bytes: beyond that they are merged in pairs, at most until each is an octave wide.
    Because that depends on nothing but the cells that rocks came to, the result still does not depend on their order.
    compiled : False where so few rocks come that plain Python is done before the loop has been compiled
    """

    def __init__(self, cells: int, scales: Scales, limit: float, compiled: bool = True) -> None:
        self.scales, self.limit, self.merges = scales, limit, 0
        self.compiled = compiled
        self.slot = np.full(cells, -1, dtype=np.int32)
        self.used = 0
        self.slots = _empty_slots(0, sum(scales.bins))
        self.carries = Carries(sum(scales.bins))
        self._lock = threading.Lock()

    def fold(self, visits: Visits) -> None:
        """Fold the visits of whole rocks in, and forget them; any thread may call."""
        used = int(visits.state[USED])
        with self._lock:
            self._take_in(visits.cell[:used])
            full = self.carries.room_for(3 * used)
            fold = _fold if self.compiled else _fold.py_func  # type: ignore[attr-defined]
            carried = fold(self.slot, self.slots, visits, used, self.scales, self.merges, full)
            self.carries.take(carried)
        visits.state[:] = 0

    def add(self, other: "Tally") -> None:
        """Fold another tally of the same cells and scales in: the same bits as if its rocks had been folded here."""
        with self._lock:
            self._take_in(other.slots.cell[: other.used])
            while self.merges < other.merges:
                self._merge_bins()
            place = self.slot[other.slots.cell[: other.used]]
            mine, theirs = self.slots, Slots(*(column[: other.used] for column in other.slots))
            mine.counts[place] += theirs.counts
            mine.most[place] = _joined(mine.most[place], theirs.most)
            bins, carries = theirs.bins, other.carries
            for _ in range(self.merges - other.merges):
                bins, carries = in_pairs(bins, carries)
            self.carries.join(carries, place)
            self.carries.add_bins(mine.bins, place, bins)

    def found(self) -> Slots:
        """What is kept of the S cells that rocks came to, in order of cell, without bins (S, 0): see `bins_found`."""
        order = self._order()
        none = np.empty((len(order), 0), dtype=np.uint8)
        return Slots(self.slots.cell[order], self.slots.counts[order], self.slots.most[order], none)

    def bins_found(self) -> Iterator[NDArray[np.uint32]]:
        """The bins of the same cells with all that was carried, (N, B) at a time: all at once would fill memory."""
        order = self._order()
        for begin in range(0, len(order), AT_ONCE):
            yield self.carries.whole(self.slots.bins, order[begin : begin + AT_ONCE])

    def _order(self) -> NDArray[np.int64]:
        return np.argsort(self.slots.cell[: self.used], kind="stable")

    def _take_in(self, cells: NDArray[np.int32]) -> None:
        """Give a slot to each cell that has none."""
        new = np.unique(cells[self.slot[cells] < 0])
        first, self.used = self.used, self.used + len(new)
        while self.merges < MOST_MERGES and self.used * (self.slots.bins.shape[1] + BYTES_PER_SLOT) > self.limit:
            self._merge_bins()
        if self.used > len(self.slots.cell):
            self._grow(max(FEWEST_SLOTS, self.used + self.used // 2))
        self.slot[new] = np.arange(first, self.used)
        self.slots.cell[first : self.used] = new

    def _grow(self, room: int) -> None:
        grown, used = _empty_slots(room, self.slots.bins.shape[1]), len(self.slots.cell)
        for column, before in zip(grown, self.slots, strict=True):
            column[:used] = before
        self.slots = grown

    def _merge_bins(self) -> None:
        self.merges += 1
        bins, self.carries = in_pairs(self.slots.bins, self.carries)
        self.slots = self.slots._replace(bins=bins)


def _empty_slots(room: int, bins: int) -> Slots:
    """Room for S cells with B bins each; what is not used yet takes no memory."""
    most = np.zeros((room, 4), dtype=np.float32)
    most[:, 3] = np.inf
    return Slots(
        np.empty(room, dtype=np.int32), np.zeros((room, 8), dtype=np.int64), most,
        np.zeros((room, bins), dtype=np.uint8),
    )  # fmt: skip


def _joined(mine: NDArray[np.float32], theirs: NDArray[np.float32]) -> NDArray[np.float32]:
    """The larger of two largest (S, 3) and the earlier of two arrivals."""
    return np.concatenate([np.maximum(mine[:, :3], theirs[:, :3]), np.minimum(mine[:, 3:], theirs[:, 3:])], axis=1)


@loop
def _fold(
    slot: Any, slots: Slots, visits: Visits, used: int, scales: Scales, merges: int, full: Any
) -> int:  # fmt: skip
    """Add up the first `used` visits, each one rock's to one cell; how many bins came full, whose places are in full.

    A place is that of a byte in `bins`: slot times bins plus bin. A byte that would reach 256 begins again at 0.
    """
    offsets = (0, scales.bins[0], scales.bins[0] + scales.bins[1])
    carried = 0
    for k in range(used):
        s = slot[visits.cell[k]]
        slots.counts[s, ROCKS] += 1
        slots.counts[s, 1] += visits.counts[k, PASSAGES]
        slots.counts[s, 2] += visits.counts[k, IMPACTS]
        slots.counts[s, 3] += visits.counts[k, DEPOSITS]
        slots.most[s, 3] = min(slots.most[s, 3], np.float32(visits.times[k, FIRST]))
        speed2 = visits.most[k, SPEED2]
        values = (0.5 * visits.mass[k] * speed2, math.sqrt(speed2), visits.most[k, HEIGHT])
        for q in range(3):
            value, top = values[q], scales.top[q]
            slots.most[s, q] = max(slots.most[s, q], np.float32(value))
            slots.counts[s, SUMS + q] += np.int64(value / top * SUM_UNITS + 0.5)
            b = (offsets[q] + bin_of(value, top, scales.bins[q], scales.per_octave)) >> merges
            if slots.bins[s, b] == 255:
                slots.bins[s, b] = 0
                full[carried] = s * slots.bins.shape[1] + b
                carried += 1
            else:
                slots.bins[s, b] += 1
    return carried
