"""An rclpy executor that measures how long it is busy with callbacks and receives no messages."""

import time
from collections.abc import Iterator
from typing import Any

from rclpy.executors import SingleThreadedExecutor


class TimedExecutor(SingleThreadedExecutor):
    """A single-threaded executor that keeps the duration of its longest round of callbacks.

    A round is all callbacks that were ready at the same time. A message that arrives during a round waits until the
    round ends. The duration of each round is measured directly. A timer that measures its own delay would have to wake
    the executor often, and each waking costs rclpy most of a millisecond.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._longest = 0.0

    def longest_round(self) -> float:
        """Return the duration (s) of the longest round that has ended since the last call; 0.0 if none has ended."""
        longest, self._longest = self._longest, 0.0
        return longest

    def _wait_for_ready_callbacks(self, *args: Any, **kwargs: Any) -> Iterator[Any]:
        """Yield the ready callbacks of one round, as rclpy's method does, and measure the time until the round ends.

        rclpy has no public function to run code before and after a round.
        """
        began = None
        try:
            for ready in super()._wait_for_ready_callbacks(*args, **kwargs):
                began = time.monotonic() if began is None else began
                yield ready
        finally:  # rclpy drops an unfinished round if the next wait has another time limit
            if began is not None:
                self._longest = max(self._longest, time.monotonic() - began)
