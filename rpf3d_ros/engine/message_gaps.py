"""Notice messages of a topic that were published, but lost before they could be read.

The middleware keeps the newest messages of a topic until they are read (`depth`). If more arrive, it deletes the
oldest, and neither counts nor reports them. A network can lose messages, too. But each publisher numbers its messages.
"""

from collections.abc import Callable, Hashable
from typing import NamedTuple

PUBLISHERS = 1000
"""Number of publishers of a topic whose last message is remembered."""


class Numbered(NamedTuple):
    """What the middleware states about a message.

    number : number that the publisher gave the message, counted from 1; None if the middleware has no numbers
    received_ns : when the message was received, before it waited to be read (ns since the epoch)
    publisher : identifies the publisher; the same for all if the publishers cannot be distinguished
    """

    number: int | None
    received_ns: int
    publisher: Hashable = ""


class _FirstMessage(NamedTuple):
    """The first message of a publisher; messages before it may have been lost.

    taken_ns : when the message was read (ns since the epoch); queued : number of messages that waited at that time,
        including the message itself, as far as they have been read
    """

    taken_ns: int
    queued: int = 0


class MessageGaps:
    """Finds gaps in the numbers of the messages of one topic. Only one thread may call."""

    def __init__(self, depth: int) -> None:
        """Begin; depth : number of messages that wait to be read before the middleware deletes the oldest, 0: all."""
        self._depth = depth
        self._last: dict[Hashable, list[int]] = {}
        self._first: list[_FirstMessage] = []

    def lost_before(self, message: Numbered, now_ns: int, publishers: Callable[[], int] = lambda: 1) -> int:
        """Return how many messages were lost before this message, as far as they were not counted earlier.

        A number that does not rise is the first of a new publisher, because a publisher never counts back. The messages
        before the first may have been published before the node subscribed. They count as lost, as one message, if the
        queue was full when the first message was read. This is known only when the other messages have been read.

        now_ns : present time (ns since the epoch), by the clock of `received_ns`
        publishers : returns how many publishers may have sent the message, if they cannot be distinguished
        """
        if message.number is None:
            return 0
        last = self._number_before(message.publisher, message.number, publishers)
        if last is None and message.number > 1:
            self._first.append(_FirstMessage(taken_ns=now_ns))
        return self._overwritten(message.received_ns) + (0 if last is None else message.number - last - 1)

    def _number_before(self, publisher: Hashable, number: int, publishers: Callable[[], int]) -> int | None:
        """Note the number of a message, and return the previous number of its publisher; None for its first message.

        Each of several publishers that cannot be distinguished counts by itself. A message belongs to the publisher
        whose number it continues, otherwise to the one with the nearest lower number: then messages are missing. Only
        the last numbers of as many publishers as there are now count, so that no message continues the number of a
        publisher that has gone: otherwise a loss could remain unnoticed. Therefore messages count as lost that were not
        if a publisher ends before its last messages are read, and another has published, or if the node begins to
        listen to several publishers.
        """
        known = self._last.pop(publisher, [])
        if known[-1:] != [number - 1]:
            known = known[-max(publishers(), 1) :]
        lower = [each for each in known if each < number]
        last = max(lower, default=None)
        if last is not None:
            known.remove(last)
        self._last[publisher] = [*known, number]
        if len(self._last) > PUBLISHERS:
            del self._last[next(iter(self._last))]
        return last

    def _overwritten(self, received_ns: int) -> int:
        """Count a message that was received at a time (ns); return the number of first messages behind a full queue."""
        waiting = [each._replace(queued=each.queued + 1) for each in self._first if received_ns <= each.taken_ns]
        self._first = [each for each in waiting if not 0 < self._depth <= each.queued]
        return len(waiting) - len(self._first)
