"""Heavy work off the executor: one thread, and of the requests that wait only the latest is served."""

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

R = TypeVar("R")


class LatestRequest(Generic[R]):
    """A worker thread that calls `serve(request)`; a request that has not begun is replaced by a newer one.

    merge : (replaced, newer) -> what is served in their place; the newer one as it is where None.
    `serve` must deal with its own errors. The thread is a daemon: it never keeps a process from ending.
    """

    def __init__(self, serve: Callable[[R], None], merge: Callable[[R, R], R] | None = None) -> None:
        self._serve, self._merge = serve, merge
        self._waiting: list[R] = []
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="rpf3d simulation", daemon=True)
        self._thread.start()

    def submit(self, request: R) -> bool:
        """Put a request in line; True where it replaced one that was never served."""
        with self._changed:
            replaced = bool(self._waiting)
            self._waiting = [self._merge(self._waiting[0], request) if replaced and self._merge else request]
            self._changed.notify()
        return replaced

    def close(self, timeout: float) -> bool:
        """Serve nothing further; wait at most timeout (s) for the running request. True where the thread has ended."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (request := self._next()) is not None:
            self._serve(request)

    def _next(self) -> R | None:
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed)
            return None if self._closed else self._waiting.pop()
