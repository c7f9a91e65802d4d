"""How a program that is no node ends on a signal: through every `finally`, and with the exit code a shell expects."""

import signal
import sys
import time
from collections.abc import Callable

CLEANING_UP = 5.0
"""Seconds in which further signals do not disturb what ends; one that comes later is heard again."""


def unless_signalled(work: Callable[[], int]) -> int:
    """Do something: its exit code, or 128 + its number after SIGINT or SIGTERM; a second one does not disturb that.

    rclpy must leave signals alone: in a context that it has shut down the next call fails for no clear reason.
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
        return 128 + ended_by[0] if ended_by else code  # where it strikes in a finalizer, the exception is dropped
    except BaseException:
        if ended_by:  # one that strikes inside the import of a C++ module comes out of it as an ImportError
            return 128 + ended_by[0]
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
