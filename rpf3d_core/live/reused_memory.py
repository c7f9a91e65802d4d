"""Provide memory for the terrains of a live simulator; a new terrain reuses the memory of an unused terrain."""

import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.memory import Kept

SETS = 2
"""Largest number of unused memory sets that are kept: usually one terrain is in use while the next terrain is built."""


class Room:
    """The memory for all arrays of one terrain (a memory set), with a list of the objects that use this memory.

    claimed : True while a terrain is being built in this memory
    patches : number of patches of the terrain since it was built from a whole survey
    free_rows : (U,) unused rows of the arrays of facets; free_vertices : (W,) unused rows of the array of vertices
    """

    def __init__(self) -> None:
        self.memory = Kept()
        self._users: list[weakref.ref[Any]] = []
        self._lock = Lock()
        self.claimed = False
        self.begin()

    def begin(self) -> None:
        """Reset the memory set for a new terrain from a whole survey: no patches, no unused rows."""
        self.patches = 0
        self.free_rows = np.empty(0, np.int32)
        self.free_vertices = np.empty(0, np.int64)

    def patched(self, free_rows: NDArray[np.int32]) -> None:
        """Record one more patch; free_rows : (U,) rows without a facet after the patch."""
        self.patches += 1
        self.free_rows = free_rows

    def used_by(self, *users: Any) -> None:
        """Register objects that use this memory; the memory stays occupied as long as one of these objects exists."""
        with self._lock:  # another thread may be searching for a free room
            self._users += [weakref.ref(user) for user in users]

    @property
    def free(self) -> bool:
        """True if this memory is available for a terrain: no object uses it, and no terrain is being built in it."""
        with self._lock:
            self._users = [user for user in self._users if user() is not None]
            return not (self._users or self.claimed)


class Rooms:
    """All memory sets of a `Workshop`: one for each terrain in use or being built, and a few unused sets.

    Each call of `free_one` keeps at most SETS unused sets, and releases the memory of the others.
    """

    def __init__(self) -> None:
        self._rooms: list[Room] = []
        self._lock = Lock()

    @contextmanager
    def free_one(self) -> Iterator[Room]:
        """Provide an unused memory set in a `with` statement, to build a terrain in; a new set if all are in use."""
        with self._lock:
            free = [room for room in self._rooms if room.free]
            self._rooms = [room for room in self._rooms if room not in free[SETS:]]
            if not free:
                free = [Room()]
                self._rooms += free
            free[0].claimed = True
        try:
            yield free[0]
        finally:
            free[0].claimed = False

    @property
    def size(self) -> int:
        """Total size (bytes) of all memory sets."""
        return sum(room.memory.size for room in self._rooms)
