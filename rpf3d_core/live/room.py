"""Sets of memory for grounds: a set is used again only when no object uses the ground in the set any more."""

import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.memory import Kept

SETS = 2
"""Unused sets that are kept: one for the running ground and one in which the next ground is built."""


class Room:
    """A set of memory, and the objects that use it.

    claimed : True while a ground is being built here
    patches : number of patches sewn into the ground here
    free_rows, free_vertices : rows of facets and of vertices that are no longer used
    """

    def __init__(self) -> None:
        self.memory = Kept()
        self._users: list[weakref.ref[Any]] = []
        self._lock = Lock()
        self.claimed = False
        self.begin()

    def begin(self) -> None:
        """Reset the room for a ground that is laid out whole: every row is in use."""
        self.patches = 0
        self.free_rows = np.empty(0, np.int32)
        self.free_vertices = np.empty(0, np.int64)

    def patched(self, free_rows: NDArray[np.int32]) -> None:
        """Record that another patch was sewn in; `free_rows` (U,) are the rows without a facet."""
        self.patches += 1
        self.free_rows = free_rows

    def used_by(self, *users: Any) -> None:
        """Register objects that have arrays in this memory."""
        with self._lock:  # another thread may be searching for a free room
            self._users += [weakref.ref(user) for user in users]

    @property
    def free(self) -> bool:
        """True if no registered object exists any more and no ground is being built here."""
        with self._lock:
            self._users = [user for user in self._users if user() is not None]
            return not (self._users or self.claimed)


class Rooms:
    """The sets of a workshop: as many as there are grounds in use, and at most SETS unused ones."""

    def __init__(self) -> None:
        self._rooms: list[Room] = []
        self._lock = Lock()

    @contextmanager
    def free_one(self) -> Iterator[Room]:
        """Give an unused set to build a ground in; a new set if all are in use."""
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
        """Bytes of all sets."""
        return sum(room.memory.size for room in self._rooms)
