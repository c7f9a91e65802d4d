"""End a program that is not a node on a signal: run every `finally`, and return the exit code that a shell expects."""

import signal
import sys
import time
from collections.abc import Callable

CLEANING_UP = 5.0
"""Time (s) for which further signals are ignored while the program ends; a later signal is handled again."""


def unless_signalled(work: Callable[[], int]) -> int:
    """Do the work of a program, and return its exit code; after SIGINT or SIGTERM, 128 + the signal's number.

    A second signal does not interrupt the cleaning up. rclpy must not handle signals: after rclpy has shut a context
    down, the next call in this context fails for no clear reason.
    """
    ended_by: list[int] = []
    until = 0.0

    def leave(number: int, frame: object) -> None:
        nonlocal until
        if time.monotonic() < until:
            return
        until = time.monotonic() + CLEANING_UP
        ended_by.append(number)
        sys.exit(128 + number)

    before = {number: signal.signal(number, leave) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        code = work()
        return 128 + ended_by[0] if ended_by else code  # Python drops an exception raised in a finalizer
    except BaseException:
        if ended_by:  # a signal during the import of a C++ module raises ImportError
            return 128 + ended_by[0]
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
