"""Count the overflows of one-byte bins, so that bins stay small although more than 255 rocks may fall into one."""

import numpy as np
from numpy.typing import NDArray

FULL = 256
"""Number of rocks at which a one-byte bin overflows and starts again at 0."""
WAITING = 1_000_000
"""Number of overflows that are collected before they are counted, to limit the memory."""
AT_ONCE = 16_384
"""Largest number of cells whose bins are converted to wide numbers at once, to limit memory to tens of megabytes."""

Bins = NDArray[np.uint8]
Places = NDArray[np.int64]


class Carries:
    """The overflows (carries) of one-byte bins (S, B): the places of the bins, and how often each bin passed 255.

    The place of a bin is its row (slot) times B plus its column.

    bins : B; places, counts : (N,) places of bins that have overflowed, ascending, and number of their overflows
    """

    def __init__(self, bins: int, places: Places | None = None, counts: Places | None = None) -> None:
        self.bins = bins
        self._places = np.empty(0, dtype=np.int64) if places is None else places
        self._counts = np.empty(0, dtype=np.int64) if counts is None else counts
        self._waiting: list[Places] = []
        self._room = np.empty(0, dtype=np.int64)

    def room_for(self, most: int) -> Places:
        """Return an array (`most`,) or longer, into which a loop can write the places of bins that overflow."""
        if len(self._room) < most:
            self._room = np.empty(most, dtype=np.int64)
        return self._room

    def take(self, carried: int) -> None:
        """Count overflows, whose places are the first `carried` elements of the array from `room_for`."""
        if carried:
            self._waiting.append(self._room[:carried].copy())
            if sum(map(len, self._waiting)) > WAITING:
                self._settle()

    def join(self, other: "Carries", slot: NDArray[np.int32]) -> None:
        """Add the overflows of another tally of the same cells.

        slot : (S,) for each row of the other tally's bins, the row of the same cell in the bins of this tally
        """
        places, counts = other.counted()
        theirs, b = np.divmod(places, self.bins)
        self._add(slot[theirs].astype(np.int64) * self.bins + b, counts)

    def add_bins(self, bins: Bins, slot: NDArray[np.int32], more: Bins) -> None:
        """Add the counts `more` (N, B) to the rows `slot` (N,) of `bins`, and count the overflows.

        bins : (S, B), changed by this call; slot : no row may occur twice
        """
        for begin in range(0, len(slot), AT_ONCE):
            some = slot[begin : begin + AT_ONCE]
            total = bins[some].astype(np.uint16) + more[begin : begin + AT_ONCE]
            bins[some] = total.astype(np.uint8)
            row, b = np.nonzero(total >= FULL)
            self._add(some[row].astype(np.int64) * self.bins + b, np.ones(len(row), dtype=np.int64))

    def counted(self) -> tuple[Places, Places]:
        """Return the places (N,) of all bins that overflowed, ascending, and how often to add 256 at each (N,)."""
        self._settle()
        return self._places, self._counts

    def whole(self, bins: Bins, order: Places) -> NDArray[np.uint32]:
        """Return the true counts (N, B) of the bins in rows `order` (N,): one-byte numbers plus overflows."""
        wide = bins[order].astype(np.uint32)
        places, counts = self.counted()
        slot, b = np.divmod(places, self.bins)
        row = np.full(len(bins), -1, dtype=np.int64)
        row[order] = np.arange(len(order))
        asked = row[slot] >= 0
        wide[row[slot[asked]], b[asked]] += (FULL * counts[asked]).astype(np.uint32)
        return wide

    def _add(self, places: Places, counts: Places) -> None:
        self._settle()
        self._places, place = np.unique(np.concatenate([self._places, places]), return_inverse=True)
        both = np.concatenate([self._counts, counts])
        self._counts = np.bincount(place, weights=both, minlength=len(self._places)).astype(np.int64)

    def _settle(self) -> None:
        if self._waiting:
            waiting, self._waiting = np.concatenate(self._waiting), []
            self._add(waiting, np.ones(len(waiting), dtype=np.int64))


def in_pairs(bins: Bins, carries: Carries) -> tuple[Bins, Carries]:
    """Return bins (S, B) merged in pairs, (S, B / 2), with their overflows, to halve the memory.

    Each quantity has whole octaves, so both bins of a pair belong to the same quantity.
    """
    total = bins[:, 0::2].astype(np.uint16) + bins[:, 1::2]
    places, counts = carries.counted()
    slot, b = np.divmod(places, carries.bins)
    merged = Carries(carries.bins // 2)
    merged._add(slot * merged.bins + b // 2, counts)
    row, b = np.nonzero(total >= FULL)
    merged._add(row * merged.bins + b, np.ones(len(row), dtype=np.int64))
    return total.astype(np.uint8), merged
