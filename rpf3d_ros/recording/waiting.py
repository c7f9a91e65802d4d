"""Received messages that wait before they are recorded, so that most of them are never deserialized."""

from collections.abc import Callable
from typing import Any

Read = Callable[[], Any]
"""A function that deserializes a received message. Raises MessageRefused if this fails."""

SETTLED = 1_000_000_000
"""Time (ns) after which the line markers of an answer no longer wait for the points of this answer."""


class PacedMessages:
    """Passes the messages of a topic on at a limited rate: the first immediately, then the newest of each interval.

    While messages wait, an interval begins when the previous interval ends, even if `due` is called late.

    interval_ns : length of an interval (ns)
    """

    def __init__(self, interval_ns: int) -> None:
        self._interval, self._next = interval_ns, 0
        self._waiting: Read | None = None
        self._open = True

    def take(self, now_ns: int, read: Read) -> list[Read]:
        """Return the received message, in a list, if its record is due now; else keep it and return an empty list.

        A message that already waits is dropped in both cases.

        now_ns : time of reception (ns); read : deserializes the message
        """
        went_back = now_ns < self._next - self._interval
        if self._open or went_back or now_ns >= self._next:
            self._waiting, self._open, self._next = None, False, now_ns + self._interval
            return [read]
        self._waiting = read
        return []

    def due(self, now_ns: int) -> list[Read]:
        """Return the waiting message, in a list, if its interval has ended; else an empty list. now_ns : time (ns)."""
        if self._waiting is None or now_ns < self._next:
            return []
        self._next += self._interval
        return self.rest()

    def open(self) -> list[Read]:
        """End the interval, so that the next message need not wait; return the waiting message, if any, in a list."""
        self._open = True
        return self.rest()

    def rest(self) -> list[Read]:
        """Return the waiting message, if any, in a list; call this at the end, when no message follows."""
        waiting, self._waiting = self._waiting, None
        return [waiting] if waiting is not None else []


class HeldLines:
    """Keeps the line markers of an answer until the answer's points have arrived, or for at most SETTLED (ns).

    The points contain every rock, so the line markers are drawn only if no points arrive.
    """

    def __init__(self) -> None:
        self._waiting: Read | None = None
        self._since = 0

    def take(self, now_ns: int, read: Read) -> list[Read]:
        """Keep a message; return, in a list, the previous message if its points have not arrived, else an empty list.

        now_ns : time of reception (ns); read : deserializes the message
        """
        before = self.rest()
        self._waiting, self._since = read, now_ns
        return before

    def due(self, now_ns: int) -> list[Read]:
        """Return the waiting message, in a list, if its points are late or the clock went back; now_ns : time (ns)."""
        return self.rest() if not 0 <= now_ns - self._since < SETTLED else []

    def drop(self) -> None:
        """Forget the waiting message, because its points have been drawn."""
        self._waiting = None

    def rest(self) -> list[Read]:
        """Return the message that still waits, if any, in a list; call this at the end, when no message follows."""
        waiting, self._waiting = self._waiting, None
        return [waiting] if waiting is not None else []
