"""Keep a program alive while the reader of its output hangs: what cannot be printed at once is dropped.

rclpy's logger holds Python's global lock while it writes. If standard error is a full pipe, it stops all threads of the
process.
"""

import contextlib
import os
import sys
import threading
from collections.abc import Iterator

FLUSHED = 0.5
"""Time (s) for which the end of the program waits until the rest of the output is printed."""


@contextlib.contextmanager
def free_output() -> Iterator[None]:
    """Print standard output and standard error from threads; a write to either never blocks.

    About 64 KiB wait for a reader that hangs, and later output is dropped.
    """
    pumps = [_Pump(descriptor) for descriptor in (1, 2)]
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        for pump in pumps:
            pump.close()


class _Pump:
    """Replaces a file descriptor by a pipe, and writes on a thread what comes through the pipe."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor, self._real = descriptor, os.dup(descriptor)
        self._reading, writing = os.pipe()
        os.set_blocking(writing, False)
        os.dup2(writing, descriptor)
        os.close(writing)
        self._thread = threading.Thread(target=self._run, name="output", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Restore the descriptor, which ends the pipe, and wait a moment for the rest."""
        os.dup2(self._real, self._descriptor)
        self._thread.join(FLUSHED)

    def _run(self) -> None:
        with contextlib.suppress(OSError):  # the reader has gone
            while data := os.read(self._reading, 65_536):
                while data:
                    data = data[os.write(self._real, data) :]
