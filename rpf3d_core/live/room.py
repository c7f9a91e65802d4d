"""Sets of memory for grounds: one is given out again only when nothing uses the ground that lay in it any more."""

import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.memory import Kept

SETS = 2
"""Sets that are kept while nobody uses them: the running ground's and the one that the next is made in."""


class Room:
    """A set of memory, and who uses it.

    claimed : a ground is being made here
    patches : sewn into the ground here; free_rows, free_vertices : of facets and vertices that are there no more
    """

    def __init__(self) -> None:
        self.memory = Kept()
        self._users: list[weakref.ref[Any]] = []
        self._lock = Lock()
        self.claimed = False
        self.begin()

    def begin(self) -> None:
        """A ground has been laid out whole: every row is taken."""
        self.patches = 0
        self.free_rows = np.empty(0, np.int32)
        self.free_vertices = np.empty(0, np.int64)

    def patched(self, free_rows: NDArray[np.int32]) -> None:
        """Another patch has been sewn in; some rows of facets hold none now."""
        self.patches += 1
        self.free_rows = free_rows

    def used_by(self, *users: Any) -> None:
        """Tell of objects whose arrays lie here."""
        with self._lock:  # another thread may be looking for a free room just now
            self._users += [weakref.ref(user) for user in users]

    @property
    def free(self) -> bool:
        """Whether all of them are gone, and no ground is being made here."""
        with self._lock:
            self._users = [user for user in self._users if user() is not None]
            return not (self._users or self.claimed)


class Rooms:
    """The sets of a workshop: as many as grounds are in use, and no more than SETS of them idle."""

    def __init__(self) -> None:
        self._rooms: list[Room] = []
        self._lock = Lock()

    @contextmanager
    def free_one(self) -> Iterator[Room]:
        """A set that nobody uses, to make a ground in; a new one where all are in use."""
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
