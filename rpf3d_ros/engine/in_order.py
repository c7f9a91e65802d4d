"""Merge the messages of several topics in the order in which they were published."""

from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

T = TypeVar("T")


class Published(NamedTuple, Generic[T]):
    """A received message with the time of its publication.

    at_ns : time of publication (ns); queue : index of the queue that contained the message
    """

    at_ns: int
    queue: int
    content: T


class InOrder(Generic[T]):
    """Takes messages from several queues, and returns them in the order of their publication.

    Messages also arrive while the queues are read. A queue that is read last may then contain a message that is younger
    than a message that has just arrived in the first queue. Therefore all queues are read twice before messages are
    returned. The second pass finds each message that arrived earlier than some message of the first pass. A message of
    the second pass waits for the next call if it is younger than all messages of the first pass.

    Only messages that have arrived can be sorted: a late message is returned after younger messages that arrived
    earlier. The times of publication are times of the publishers' clocks. If these clocks differ, messages that arrive
    together may be in the wrong order.

    takes : for each queue, a function that returns the time of publication (ns) and the content of the next message, or
        None if no message waits
    errors : errors raised by queues in the last call of `ready`; an error in one queue does not delay the other queues
    """

    def __init__(self, takes: Sequence[Callable[[], tuple[int, T] | None]]) -> None:
        self._takes = takes
        self._waiting: list[Published[T]] = []
        self.errors: list[Exception] = []

    @property
    def keeps_some(self) -> bool:
        """True if messages that have arrived wait for the next call of `ready`."""
        return bool(self._waiting)

    def ready(self) -> list[Published[T]]:
        """Read all queues, and return the messages that need not wait for earlier messages, in order of publication."""
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
