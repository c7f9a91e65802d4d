"""Merge messages of several queues in the order in which they were published."""

from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

T = TypeVar("T")


class Published(NamedTuple, Generic[T]):
    """A published message.

    at_ns : time of publication; queue : number of the queue it came from; content : its content
    """

    at_ns: int
    queue: int
    content: T


class InOrder(Generic[T]):
    """Takes messages from one queue after the other and puts them in order.

    Messages keep arriving during a look at the queues: a message found late in a look may be younger than a message
    that arrived in a queue already passed. So messages are handed on after a second look, which finds all messages that
    arrived before any of them. Later messages found by the second look wait for the next call.

    Only messages that have arrived are put in order: a message that was published before others and arrives after they
    were handed on comes after them. Times are by the publishers' clocks: if the clocks differ, so does the order of
    messages that arrive together.

    takes : for each queue, a function that returns the next message's time of publication (ns) and content, or None
    errors : errors raised by queues in the last look; an error in one queue does not delay the others
    """

    def __init__(self, takes: Sequence[Callable[[], tuple[int, T] | None]]) -> None:
        self._takes = takes
        self._waiting: list[Published[T]] = []
        self.errors: list[Exception] = []

    def ready(self) -> list[Published[T]]:
        """Return the messages that can be handed on, in order."""
        self.errors = []
        self._look()
        if not self._waiting:
            return []
        last = max(each.at_ns for each in self._waiting)
        self._look()
        ready = [each for each in self._waiting if each.at_ns <= last]
        self._waiting = [each for each in self._waiting if each.at_ns > last]
        return sorted(ready, key=lambda each: each.at_ns)

    def _look(self) -> None:
        for queue, take in enumerate(self._takes):
            try:
                while (found := take()) is not None:
                    self._waiting.append(Published(at_ns=found[0], queue=queue, content=found[1]))
            except Exception as error:
                self.errors.append(error)
