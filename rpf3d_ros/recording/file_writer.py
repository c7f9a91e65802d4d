"""Flush and close rerun's files without waiting for ever if rerun's writing thread has ended.

rerun writes each file in a separate thread. The thread ends if writing fails, for example on a full disk. rerun (0.41)
then still waits for the thread: a flush waits until its timeout, and the release of the stream waits for ever. This
module detects that the thread has ended, and stops waiting.
"""

import threading
import time
from pathlib import Path
from typing import Any

NAME = "file_writer"
"""Name that rerun gives to its writer thread."""

STEP = 0.2
"""Time between checks whether the writer thread still runs, during a flush (s)."""

OWN_THREADS = Path("/proc/self/task")

_left: list[threading.Thread] = []


def flush(stream: Any, seconds: float) -> None:
    """Wait until all rows of a stream are in its file.

    Raises RuntimeError if this takes more than `seconds` (s), or if the writer thread has ended.
    """
    until = time.monotonic() + seconds
    while True:
        try:
            stream.flush(timeout_sec=STEP)
            return
        except RuntimeError:
            if not is_alive() or time.monotonic() >= until:
                raise


def close(stream: Any, seconds: float) -> None:
    """Write the waiting rows and the footer of a stream's file, and release the stream.

    Raises RuntimeError in the same cases as `flush`, with the time limit `seconds` (s). After an error, a separate
    thread releases the stream, because the release may never end.
    """
    try:
        flush(stream, seconds)
    except RuntimeError:
        _left.append(threading.Thread(target=stream.disconnect, name="rpf3d abandoned file", daemon=True))
        _left[-1].start()
        raise
    stream.disconnect()


def any_left() -> bool:
    """True if a stream is not released yet after an error; rerun would wait for this stream when the process ends."""
    return any(thread.is_alive() for thread in _left)


def is_alive() -> bool:
    """True if this process has a writer thread, or if threads cannot be listed, as outside Linux."""
    if not OWN_THREADS.is_dir():
        return True
    return any(_name(task) == NAME for task in OWN_THREADS.iterdir())


def _name(task: Path) -> str:
    try:
        return (task / "comm").read_text().strip()
    except OSError:  # the thread has ended meanwhile
        return ""
