"""What all rocks together did in each cell of one kind: the visits of one rock after another, folded in.

Everything that is kept is a count, a largest or smallest value, or a sum of whole numbers, so the order of folding
changes nothing: any number of threads, batches and parts of an ensemble give the same bits.
"""

import math
import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.compiling import loop
from rpf3d_core.hazard.bins import PER_OCTAVE, Scales, bin_of
from rpf3d_core.hazard.visits import DEPOSITS, FIRST, IMPACTS, PASSAGES, USED, Visits

FEWEST_SLOTS = 1024
MOST_MERGES = PER_OCTAVE.bit_length() - 1
"""After so many mergings in pairs a bin is an octave wide."""
BYTES_PER_CELL = 128
"""That every cell needs, whether rocks come to it or not: its place here, in the visits of a thread, and in layers."""
LEAST_SHARE = 0.2
"""Of the memory for maps that bins may take, however little the cells leave."""
SUM_UNITS = 2.0**34
"""A sum counts in units of the largest value over 2^34, so that 2^29 rocks fit in 64 bits."""


class Slots(NamedTuple):
    """What is kept of S cells that rocks came to.

    cell : (S,); counts : (S, 4) rocks, passages, impacts, deposits; first : (S,) s
    most : (S, 3) J, m/s, m; sums : (S, 3) in units of `Scales.top` over SUM_UNITS
    bins : (S, B) rocks in each bin of energy, then of speed, then of height
    """

    cell: Any
    counts: Any
    first: Any
    most: Any
    sums: Any
    bins: Any


class Tally:
    """Counts over C cells of one kind.

    Its bins take at most `limit` bytes: beyond that they are merged in pairs, at most until each is an octave wide.
    Because that depends on nothing but the cells that rocks came to, the result still does not depend on their order.
    """

    def __init__(self, cells: int, scales: Scales, limit: float) -> None:
        self.scales, self.limit, self.merges = scales, limit, 0
        self.slot = np.full(cells, -1, dtype=np.int32)
        self.used = 0
        self.slots = _empty_slots(0, sum(scales.bins))
        self._lock = threading.Lock()

    def fold(self, visits: Visits) -> None:
        """Fold the visits of whole rocks in, and forget them; any thread may call."""
        used = int(visits.state[USED])
        with self._lock:
            self._take_in(visits.cell[:used])
            _fold(self.slot, self.slots, visits, used, self.scales, self.merges)
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
            mine.sums[place] += theirs.sums
            mine.first[place] = np.minimum(mine.first[place], theirs.first)
            mine.most[place] = np.maximum(mine.most[place], theirs.most)
            bins = theirs.bins
            for _ in range(self.merges - other.merges):
                bins = _in_pairs(bins)
            mine.bins[place] += bins

    def found(self) -> Slots:
        """What is kept of the cells that rocks came to, in order of cell."""
        order = np.argsort(self.slots.cell[: self.used], kind="stable")
        return Slots(*(column[order] for column in self.slots))

    def _take_in(self, cells: NDArray[np.int32]) -> None:
        """Give a slot to each cell that has none."""
        new = np.unique(cells[self.slot[cells] < 0])
        first, self.used = self.used, self.used + len(new)
        while self.merges < MOST_MERGES and self.used * self.slots.bins.shape[1] * 4 > self.limit:
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
        self.slots = self.slots._replace(bins=_in_pairs(self.slots.bins))


def _empty_slots(room: int, bins: int) -> Slots:
    """Room for S cells with B bins each; what is not used yet takes no memory."""
    return Slots(
        np.empty(room, dtype=np.int32), np.zeros((room, 4), dtype=np.uint32), np.full(room, math.inf),
        np.zeros((room, 3)), np.zeros((room, 3), dtype=np.int64), np.zeros((room, bins), dtype=np.uint32),
    )  # fmt: skip


def _in_pairs(bins: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Counts (S, B) of bins in pairs: (S, B / 2). Each quantity has a whole number of octaves, so pairs stay in it."""
    return np.ascontiguousarray(bins[:, 0::2] + bins[:, 1::2])


@loop
def _fold(slot: Any, slots: Slots, visits: Visits, used: int, scales: Scales, merges: int) -> None:
    """Add up the first `used` visits, each one rock's to one cell."""
    offsets = (0, scales.bins[0], scales.bins[0] + scales.bins[1])
    for k in range(used):
        s = slot[visits.cell[k]]
        slots.counts[s, 0] += 1
        slots.counts[s, 1] += visits.counts[k, PASSAGES]
        slots.counts[s, 2] += visits.counts[k, IMPACTS]
        slots.counts[s, 3] += visits.counts[k, DEPOSITS]
        slots.first[s] = min(slots.first[s], visits.times[k, FIRST])
        for q in range(3):
            value, top = visits.most[k, q], scales.top[q]
            slots.most[s, q] = max(slots.most[s, q], value)
            slots.sums[s, q] += np.int64(value / top * SUM_UNITS)
            slots.bins[s, (offsets[q] + bin_of(value, top, scales.bins[q])) >> merges] += 1
