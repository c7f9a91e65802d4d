"""Forbid compilation in a part of a program: all compiled code must already be loaded or in the disk cache.

numba holds one lock while it compiles a function, and every first call in the process waits for this lock, even if the
code of the call is in the disk cache. So a program that must always answer quickly lets another process compile.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

event: Any
try:
    from numba.core import event
except ImportError:
    event = None


class NotCached(Exception):
    """The compiled code of a function is neither loaded nor in the disk cache."""


@contextmanager
def only_from_cache() -> Iterator[None]:
    """Raise NotCached in the `with` block if this thread would compile a function; other threads may compile."""
    if event is None:
        yield
        return
    with event.install_listener("numba:compile", _Refusing(threading.get_ident())):
        yield


class _Refusing(event.Listener if event is not None else object):  # type: ignore[misc]
    """Raises NotCached as soon as the compiler starts in one thread."""

    def __init__(self, thread: int) -> None:
        self._thread = thread

    def on_start(self, event: Any) -> None:
        if threading.get_ident() == self._thread:
            raise NotCached

    def on_end(self, event: Any) -> None:
        """Do nothing."""
