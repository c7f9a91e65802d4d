"""Detect messages of a topic that were published, but lost before they could be read.

The middleware keeps the newest messages of a topic until they are read; `depth` is their largest number. If more
messages arrive, the middleware deletes the oldest, and neither counts nor reports them. A network can lose messages,
too. Because each publisher numbers its messages, a loss is a gap in the numbers.
"""

from collections.abc import Callable, Hashable
from typing import NamedTuple

PUBLISHERS = 1000
"""Largest number of publishers of a topic whose last numbers are kept."""


class Numbered(NamedTuple):
    """The number, time of reception and publisher of a message, as the middleware states them.

    number : number that the publisher gave the message, counted from 1; None if the middleware has no numbers
    received_ns : when the message was received, before it waited to be read (ns since the epoch)
    publisher : identifies the publisher; the same for all if the publishers cannot be distinguished
    """

    number: int | None
    received_ns: int
    publisher: Hashable = ""


class _FirstMessage(NamedTuple):
    """The first message of a publisher; messages before it may have been lost.

    taken_ns : when the message was read (ns since the epoch)
    queued : number of messages read so far that waited in the queue at that time, this message included
    """

    taken_ns: int
    queued: int = 0


class MessageGaps:
    """Finds gaps in the numbers of the messages of one topic, that is lost messages. Only one thread may call."""

    def __init__(self, depth: int) -> None:
        """Begin without messages.

        depth : number of messages that may wait to be read before the middleware deletes the oldest; 0 for no limit
        """
        self._depth = depth
        self._last: dict[Hashable, list[int]] = {}
        self._first: list[_FirstMessage] = []

    def lost_before(self, message: Numbered, now_ns: int, publishers: Callable[[], int] = lambda: 1) -> int:
        """Return the number of messages that were lost before this message, and were not counted earlier.

        Return 0 if the middleware does not number messages.

        A number that does not rise belongs to a new publisher, because a publisher's numbers only rise. Messages before
        the first message of a publisher may have been published before the node subscribed. They count as one lost
        message if the queue was full when the first message was read. This is known only after the rest of the queue
        has been read.

        now_ns : current time (ns since the epoch), by the clock of `received_ns`
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

        Several publishers that cannot be distinguished share one identity, but each has its own numbers. A message then
        belongs to the publisher whose last number it continues, or else to the publisher with the nearest lower number;
        messages are then missing. If there are n publishers now, the last numbers are kept only of the n publishers
        that published most recently. Otherwise a message could continue the number of a publisher that has ended, and a
        loss would remain unnoticed.

        Too many messages may count as lost in two cases: if a publisher ends before its last messages are read, while
        another publisher publishes; and if the node begins to subscribe while there are several publishers.

        publisher : identity of the publisher; number : of the message; publishers : as in `lost_before`
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
        """Return the number of publishers whose queue is now known to have been full at their first message.

        A message that was received before the first message of a publisher was read waited in the queue together with
        this first message. The queue was full if `depth` messages waited. Each publisher is counted once.

        received_ns : when a message was received (ns since the epoch)
        """
        waiting = [each._replace(queued=each.queued + 1) for each in self._first if received_ns <= each.taken_ns]
        self._first = [each for each in waiting if not 0 < self._depth <= each.queued]
        return len(waiting) - len(self._first)
