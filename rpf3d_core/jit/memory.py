"""Memory that is used again, and work that is shared out among threads.

The first touch of fresh memory costs more than what is then written there: a survey of millions of facets that comes
again and again is laid out where the last but one lay.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

Memory = Callable[[str, int, Any], NDArray[Any]]
"""Gives an array of a name, a length and a type, whose content is left open."""
Share = Callable[[Sequence[Callable[[], Any]]], list[Any]]
"""Does pieces of work, in any order or at the same time, and returns their results in order."""

SPARE = 8
"""An array that is too short is made longer by one part in so many than asked for: surveys grow slowly."""


def fresh(name: str, length: int, dtype: Any) -> NDArray[Any]:
    """A new array (N,) of a length N, as `Memory`."""
    return np.empty(length, dtype)


def one_by_one(work: Sequence[Callable[[], Any]]) -> list[Any]:
    """Do the work on this thread, as `Share`."""
    return [piece() for piece in work]


def longer(array: NDArray[Any], length: int, rest: int) -> NDArray[Any]:
    """The same array (N,) where it has a length, or one with room to spare that goes on with `rest`."""
    if len(array) >= length:
        return array
    return np.concatenate([array, np.full(length + length // SPARE - len(array), rest, dtype=array.dtype)])


class Kept:
    """Arrays that are given out again under the same name: a `Memory`. One user at a time."""

    def __init__(self) -> None:
        self._arrays: dict[str, NDArray[Any]] = {}

    def __call__(self, name: str, length: int, dtype: Any) -> NDArray[Any]:
        """The first `length` places of the array of this name; grown, its content lost, where it is too short."""
        if name not in self._arrays or len(self._arrays[name]) < length:
            self._arrays.pop(name, None)  # before the new one is made: never both
            self._arrays[name] = np.empty(length + length // SPARE, dtype)
        return self._arrays[name][:length]

    def longer(self, name: str, length: int) -> NDArray[Any]:
        """The array (N,) of a length N, as a call gives it, with the content kept."""
        array = self._arrays[name]
        if len(array) < length:
            self._arrays[name] = np.empty(length + length // SPARE, array.dtype)
            self._arrays[name][: len(array)] = array
        return self._arrays[name][:length]

    @property
    def size(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self._arrays.values())


class Threads:
    """Some threads that are kept: a `Share`."""

    def __init__(self, count: int) -> None:
        self._pool = ThreadPoolExecutor(count, thread_name_prefix="ground")

    def __call__(self, work: Sequence[Callable[[], Any]]) -> list[Any]:
        """Do the work on the threads; the first error is raised when all have ended."""
        tasks = [self._pool.submit(piece) for piece in work]
        errors = [task.exception() for task in tasks]
        for error in errors:
            if error is not None:
                raise error
        return [task.result() for task in tasks]


def halves(count: int) -> list[tuple[int, int]]:
    """Begin and end of the two halves of so many."""
    return [(0, count // 2), (count // 2, count)]
