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
    into a queue already left behind. So what was found is handed on after a second look, which finds all that was
    published before any of it; what the second look finds beyond that waits for the next.

    takes : of each queue, the next message's time of publication (ns) and content, or None where there is none. A
        message may come late into its queue, but not later than another one that was published after it.
    """

    def __init__(self, takes: Sequence[Callable[[], tuple[int, T] | None]]) -> None:
        self._takes = takes
        self._waiting: list[Published[T]] = []

    def come(self) -> list[Published[T]]:
        """What can be handed on, in order; what is raised while a queue is looked at costs no message found before."""
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
            while (found := take()) is not None:
                self._waiting.append(Published(found[0], queue, found[1]))
