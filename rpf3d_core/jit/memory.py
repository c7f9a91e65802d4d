"""Arrays whose memory is reused, and work that is shared among threads.

The first access to new memory takes longer than the writing of data. A live terrain of millions of facets is replaced
often, so each new survey reuses the memory of an earlier survey.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

Memory = Callable[[str, int, Any], NDArray[Any]]
"""A function that returns an array with undefined content, in new or reused memory, for a name, length and type."""
Share = Callable[[Sequence[Callable[[], Any]]], list[Any]]
"""A function that calls several functions, in any order or in parallel, and returns their results in order."""

SPARE = 8
"""A new array has 1 / SPARE more elements than requested, because the next survey may be a little larger."""


def fresh(name: str, length: int, dtype: Any) -> NDArray[Any]:
    """Return a new array (N,), N = `length`, with undefined content; `name` is not used.

    This is the `Memory` for callers that reuse no memory.
    """
    return np.empty(length, dtype)


def one_by_one(work: Sequence[Callable[[], Any]]) -> list[Any]:
    """Call functions one after another, and return their results in this order.

    This is the `Share` for callers that use no threads.
    """
    return [piece() for piece in work]


def longer(array: NDArray[Any], length: int, rest: int) -> NDArray[Any]:
    """Return the given array (N,) if it has at least `length` elements, else a longer copy with spare elements.

    rest : value of all elements of the copy after the copied elements
    """
    if len(array) >= length:
        return array
    return np.concatenate([array, np.full(length + length // SPARE - len(array), rest, dtype=array.dtype)])


class Kept:
    """A `Memory` that returns the same array again for the same name: a new survey reuses the memory of an old survey.

    Two users must not share one `Kept` at the same time.
    """

    def __init__(self) -> None:
        self._arrays: dict[str, NDArray[Any]] = {}

    def __call__(self, name: str, length: int, dtype: Any) -> NDArray[Any]:
        """Return the first `length` elements (N,) of the array `name`, with undefined content.

        A missing array is allocated; an array that is too short is replaced. `dtype` counts only for a new array, so
        all calls with the same name must have the same type.
        """
        if name not in self._arrays or len(self._arrays[name]) < length:
            self._arrays.pop(name, None)  # frees the old array before the new one is allocated
            self._arrays[name] = np.empty(length + length // SPARE, dtype)
        return self._arrays[name][:length]

    def longer(self, name: str, length: int) -> NDArray[Any]:
        """Return the first `length` elements (N,) of the array `name`, which must exist; its content is kept.

        If the array is too short, a longer copy replaces the array; the additional elements are undefined.
        """
        array = self._arrays[name]
        if len(array) < length:
            self._arrays[name] = np.empty(length + length // SPARE, array.dtype)
            self._arrays[name][: len(array)] = array
        return self._arrays[name][:length]

    @property
    def size(self) -> int:
        """Number of bytes of all arrays that are kept."""
        return sum(array.nbytes for array in self._arrays.values())


class Threads:
    """A `Share` that runs functions in parallel, on a pool of threads that is used again for each call."""

    def __init__(self, count: int) -> None:
        self._pool = ThreadPoolExecutor(count, thread_name_prefix="ground")

    def __call__(self, work: Sequence[Callable[[], Any]]) -> list[Any]:
        """Call the functions on the threads, wait for all of them, and return their results in the order of `work`.

        If functions failed, raise the error of the first failed function in the order of `work`.
        """
        tasks = [self._pool.submit(piece) for piece in work]
        errors = [task.exception() for task in tasks]
        for error in errors:
            if error is not None:
                raise error
        return [task.result() for task in tasks]


def halves(count: int) -> list[tuple[int, int]]:
    """Return (begin, end) of the two halves of `count` items, end exclusive, to share the items between two threads."""
    return [(0, count // 2), (count // 2, count)]
