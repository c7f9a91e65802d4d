"""Keep a program running while the reader of its output hangs: output that would have to wait is dropped.

rclpy's logger holds Python's global lock while it writes. If standard error is a full pipe, the logger stops all
threads of the process.
"""

import contextlib
import os
import select
import sys
import threading
from collections.abc import Iterator

RETRY = 1.0
"""Longest time (s) between two attempts to write to a reader that has no room."""

FLUSHED = 0.5
"""Time (s) for which the end of the program waits until the rest of the output is printed."""


@contextlib.contextmanager
def free_output() -> Iterator[None]:
    """Context manager in which threads pass on standard output and error, so that a write of the program never blocks.

    If the reader hangs, about 64 KiB wait, and later output is dropped. All output is dropped if the reader has closed
    the pipe, or if the descriptor was closed when the program started.
    """
    for descriptor in (1, 2):
        _open_if_closed(descriptor)
    pumps = [_Pump(descriptor) for descriptor in (1, 2)]
    try:
        yield
    finally:
        flush_output()
        for pump in pumps:
            pump.close()


def flush_output() -> None:
    """Write the output that Python still buffers; do nothing for a stream that is closed or cannot be written to."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, OSError, ValueError):  # AttributeError: None, closed from the start
            stream.flush()


def _open_if_closed(descriptor: int) -> None:
    """Open /dev/null on a closed file descriptor; otherwise the next opened file would get its number."""
    try:
        os.fstat(descriptor)
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        if nowhere != descriptor:
            os.dup2(nowhere, descriptor)
            os.close(nowhere)


class _Pump:
    """Replaces a file descriptor by a pipe; a thread reads the pipe, and writes the data to the original file."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor, self._real = descriptor, os.dup(descriptor)
        self._reading, writing = os.pipe()
        os.set_blocking(writing, False)
        os.dup2(writing, descriptor)
        os.close(writing)
        self._thread = threading.Thread(target=self._run, name="output", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Restore the descriptor, which ends the pipe, and wait at most FLUSHED (s) for the rest to be written."""
        os.dup2(self._real, self._descriptor)
        self._thread.join(FLUSHED)

    def _run(self) -> None:
        while data := os.read(self._reading, 65_536):
            while data:
                data = data[self._passed_on(data) :]

    def _passed_on(self, data: bytes) -> int:
        """Write bytes to the original file; return the number of bytes written.

        Return the number of all bytes if the reader has closed the pipe: the bytes are then dropped. Return 0 if
        nothing can be written now; the caller then tries again.
        """
        try:
            return os.write(self._real, data)
        except BlockingIOError:  # the descriptor was made non-blocking by another program
            select.select((), (self._real,), (), RETRY)
            return 0
        except OSError:
            return len(data)
