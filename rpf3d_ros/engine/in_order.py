"""Messages of several queues, in the order in which they were published."""

from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

T = TypeVar("T")


class Published(NamedTuple, Generic[T]):
    """at_ns : when; queue : which of the queues it came from; content : what is in it."""

    at_ns: int
    queue: int
    content: T


class InOrder(Generic[T]):
    """Looks at one queue after the other and brings what it found into order.

    While it looks, messages go on to come: one that is found at the end of a look may be younger than one that came
    into a queue already left behind. So what was found is handed on after a second look, which finds all that came
    before any of it; what the second look finds beyond that waits for the next.

    The order is that of what comes: a message that was published before others and comes after them is handed on after
    them. Times are those of the publishers' clocks: where these differ, so does the order of what comes at once.

    takes : of each queue, the next message's time of publication (ns) and content, or None where there is none
    errors : what was raised by queues when they were last looked at; it keeps back nothing of other queues
    """

    def __init__(self, takes: Sequence[Callable[[], tuple[int, T] | None]]) -> None:
        self._takes = takes
        self._waiting: list[Published[T]] = []
        self.errors: list[Exception] = []

    def come(self) -> list[Published[T]]:
        """What can be handed on, in order."""
        self.errors = []
        self._look()
        if not self._waiting:
            return []
        last = max(each.at_ns for each in self._waiting)
        self._look()
        come = [each for each in self._waiting if each.at_ns <= last]
        self._waiting = [each for each in self._waiting if each.at_ns > last]
        return sorted(come, key=lambda each: each.at_ns)

    def _look(self) -> None:
        for queue, take in enumerate(self._takes):
            try:
                while (found := take()) is not None:
                    self._waiting.append(Published(found[0], queue, found[1]))
            except Exception as error:
                self.errors.append(error)
