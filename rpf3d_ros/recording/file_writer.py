"""The thread that writes a rerun stream to its file. It ends where that fails, as on a full disk, and rerun (0.41) then
waits for it: a flush as long as it may, letting go of the stream for ever. Here that is noticed, and nobody waits.
"""

import threading
import time
from pathlib import Path
from typing import Any

NAME = "file_writer"
"""What rerun calls that thread."""

STEP = 0.2
"""Seconds after which a flush looks whether there is still somebody to wait for."""

OWN_THREADS = Path("/proc/self/task")

_left: list[threading.Thread] = []


def flush(stream: Any, seconds: float) -> None:
    """Wait until a stream is in its file. Raises RuntimeError where that is not so in time, or cannot be any more."""
    until = time.monotonic() + seconds
    while True:
        try:
            stream.flush(timeout_sec=STEP)
            return
        except RuntimeError:
            if not is_alive() or time.monotonic() >= until:
                raise


def close(stream: Any, seconds: float) -> None:
    """Write what waits and the file's footer. Raises as `flush`; the stream is then left to a thread of its own."""
    try:
        flush(stream, seconds)
    except RuntimeError:
        _left.append(threading.Thread(target=stream.disconnect, name="rpf3d abandoned file", daemon=True))
        _left[-1].start()
        raise
    stream.disconnect()


def any_left() -> bool:
    """Whether a stream could not be let go of: rerun would wait for it at the end of the process, too."""
    return any(thread.is_alive() for thread in _left)


def is_alive() -> bool:
    """Whether there is a thread of that name in this process; True where nobody can tell, as outside Linux."""
    if not OWN_THREADS.is_dir():
        return True
    return any(_name(task) == NAME for task in OWN_THREADS.iterdir())


def _name(task: Path) -> str:
    try:
        return (task / "comm").read_text().strip()
    except OSError:  # it has ended meanwhile
        return ""
