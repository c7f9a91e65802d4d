"""Count how many rocks reached each facet, and nothing else: all that live answers show of facets.

A terrain has far more facets than map cells, so counts of energies, speeds and heights on facets would be the largest
part of the counting.
"""

import threading
from typing import Any

import numpy as np

from rpf3d_core.hazard.maps import ReachCounts
from rpf3d_core.hazard.walks.visits import USED, Visits
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.jit.memory import longer

GROWTH = 2
"""Factor by which the list of reached cells grows when it is full."""


class ReachTally:
    """The number of distinct rocks that reached each of C cells, added while rocks fly, from any thread.

    The order in which visits are added changes nothing.

    rocks : (C,) number of rocks; compiled : False for so few rocks that plain Python finishes before the loop is
        compiled
    """

    def __init__(self, cells: int, compiled: bool = True) -> None:
        """Count no rock yet; cells : C."""
        self.rocks = np.zeros(cells, dtype=np.int32)
        self.compiled = compiled
        self._reached, self._used = np.empty(0, dtype=np.int32), 0
        self._lock = threading.Lock()

    def emptied(self) -> "ReachTally":
        """Return an empty tally of the same cells, in the memory of this tally: do not use this tally afterwards.

        The cost depends on the number of cells that rocks reached, not on the number of all cells.
        """
        fresh = ReachTally(0, self.compiled)
        self.rocks[self._reached[: self._used]] = 0
        fresh.rocks = self.rocks
        return fresh

    def widened(self, cells: int) -> None:
        """Enlarge the memory so that at least `cells` cells can be counted."""
        self.rocks = longer(self.rocks, cells, 0)

    def fold(self, visits: Visits) -> None:
        """Add the visits of some rocks to the counts, and empty `visits`."""
        used = int(visits.state[USED])
        with self._lock:
            self._make_room(used)
            count = count_rocks if self.compiled else count_rocks.py_func  # type: ignore[attr-defined]
            self._used = int(count(self.rocks, visits.cell, used, self._reached, self._used))
        visits.state[:] = 0

    def add(self, other: "ReachTally") -> None:
        """Add the counts of another tally of the same cells."""
        cells = other._reached[: other._used]
        with self._lock:
            self._make_room(len(cells))
            new = cells[self.rocks[cells] == 0]
            self._reached[self._used : self._used + len(new)] = new
            self._used += len(new)
            self.rocks[cells] += other.rocks[cells]

    def reached(self) -> ReachCounts:
        """Return the cells that rocks reached, in order of cell."""
        cell = np.sort(self._reached[: self._used])
        rocks = self.rocks[cell].astype(np.int64)
        return ReachCounts(all_cells=len(self.rocks), cell=cell.astype(np.int64), rocks=rocks)

    def _make_room(self, more: int) -> None:
        """Enlarge the list of reached cells, if `more` cells might not fit."""
        room = min(self._used + more, len(self.rocks))
        if room > len(self._reached):
            self._reached = longer(self._reached, min(GROWTH * room, len(self.rocks)), 0)


@loop
def count_rocks(rocks: Any, cells: Any, visits: int, reached: Any, used: int) -> int:
    """Add one rock for each visit to the count of its cell, and list the cells that no rock had reached before.

    Return the number of listed cells.

    rocks : (C,) number of rocks in each cell; cells : (N,) cell of each visit; visits : number of visits to add
    reached : the list, of which `used` entries are in use
    """
    for k in range(visits):
        cell = cells[k]
        if rocks[cell] == 0:
            reached[used] = cell
            used += 1
        rocks[cell] += 1
    return used
