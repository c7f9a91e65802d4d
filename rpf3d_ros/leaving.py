"""How a program that is no node ends on a signal: through every `finally`, and with the exit code a shell expects."""

import signal
import sys
from collections.abc import Callable


def unless_signalled(work: Callable[[], int]) -> int:
    """Do something: its exit code, or 128 + its number after SIGINT or SIGTERM; a second one does not disturb that.

    rclpy must leave signals alone: in a context that it has shut down the next call fails for no clear reason.
    """
    ended_by: list[int] = []

    def leave(number: int, frame: object) -> None:
        ended_by.append(number)
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, signal.SIG_IGN)
        sys.exit(128 + number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, leave)
    try:
        return work()
    except BaseException:
        if ended_by:  # one that strikes inside the import of a C++ module comes out of it as an ImportError
            return 128 + ended_by[0]
        raise
