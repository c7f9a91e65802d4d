"""End a program that is not a node on a signal: run every `finally`, and return the exit code that a shell expects."""

import contextlib
import signal
import sys
import time
from collections.abc import Callable, Iterator

CLEANING_UP = 5.0
"""Time (s) after a signal for which further signals are ignored, so that the program can end in order."""

AGAIN = 0.01
"""Time (s) after which the exception of a signal is raised again if Python has dropped it."""


class _Signals:
    """Handler of SIGINT and SIGTERM: raises SystemExit in the main thread, and raises it again if Python drops it."""

    def __init__(self) -> None:
        self.ended_by: int | None = None
        self.until = 0.0

    def leave(self, number: int, frame: object) -> None:
        if time.monotonic() < self.until:
            return
        self._raise(number)

    def leave_again(self, number: int, frame: object) -> None:
        assert self.ended_by is not None
        self._raise(self.ended_by)

    def dropped(self, unraisable: "sys.UnraisableHookArgs") -> None:
        """Handle an exception that Python drops; if it is the SystemExit of a signal, raise it again soon.

        Python drops an exception that is raised in a finalizer or in a callback of C, and continues with the work.
        """
        if self.ended_by is not None and unraisable.exc_type is SystemExit:
            signal.setitimer(signal.ITIMER_REAL, AGAIN)
        else:
            sys.__unraisablehook__(unraisable)

    def _raise(self, number: int) -> None:
        self.until = time.monotonic() + CLEANING_UP
        self.ended_by = number
        sys.exit(128 + number)


def unless_signalled(work: Callable[[], int]) -> int:
    """Do the work of a program, and return its exit code; after SIGINT or SIGTERM, 128 + the signal's number.

    A second signal within CLEANING_UP seconds is ignored, so that it does not interrupt the cleaning up. rclpy must not
    handle signals: after rclpy has shut a context down, the next call in this context fails for no clear reason.
    """
    signals = _Signals()
    with _handled_by(signals):
        try:
            code = work()
        except BaseException:
            if signals.ended_by is None:
                raise
            # Not only SystemExit: a signal during the import of a C++ module raises ImportError
    return code if signals.ended_by is None else 128 + signals.ended_by


@contextlib.contextmanager
def _handled_by(signals: _Signals) -> Iterator[None]:
    """Context manager: set signal handlers, and restore the former handlers at the end; main thread only."""
    handlers = {signal.SIGINT: signals.leave, signal.SIGTERM: signals.leave, signal.SIGALRM: signals.leave_again}
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    hook, sys.unraisablehook = sys.unraisablehook, signals.dropped
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)
