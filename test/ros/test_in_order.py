"""Messages that come while the queues are looked at are handed on in the order in which they were published."""

from collections import deque

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rpf3d_ros.in_order import InOrder

QUEUES = 3


class Stream:
    """Messages that are published in turn, some of them each time that a queue is looked at."""

    def __init__(self, queues, paces):
        self.queues = [deque() for _ in range(QUEUES)]
        self.coming = deque(enumerate(queues))
        self.paces = deque(paces)

    def publish(self, count):
        for at, queue in [self.coming.popleft() for _ in range(min(count, len(self.coming)))]:
            self.queues[queue].append((at, f"message {at}"))

    def take(self, queue):
        found = self.queues[queue].popleft() if self.queues[queue] else None
        self.publish(self.paces.popleft() if self.paces else 1)
        return found


@given(
    st.lists(st.integers(0, QUEUES - 1), max_size=40),
    st.lists(st.integers(0, 4), max_size=60),
)
@example([0, 2], [0, 0, 2])  # both come after the first queue was looked at and before the last
def test_what_comes_during_a_look_is_handed_on_in_order_and_once(queues, paces):
    stream = Stream(queues, paces)
    order = InOrder([lambda queue=queue: stream.take(queue) for queue in range(QUEUES)])
    handed = []
    for _ in range(2 * len(queues) + len(paces) + 2):
        handed += order.come()
    assert [(each.at_ns, each.queue, each.content) for each in handed] == [
        (at, queue, f"message {at}") for at, queue in enumerate(queues)
    ]


def test_a_message_is_not_kept_back_where_nothing_follows():
    stream = Stream([1], [1])
    stream.publish(1)
    order = InOrder([lambda queue=queue: stream.take(queue) for queue in range(QUEUES)])
    assert [each.content for each in order.come()] == ["message 0"]


def test_what_is_raised_by_one_queue_costs_no_message_of_another():
    stream = Stream([0, 1], [])
    stream.publish(2)
    broken = [True]

    def take():
        if broken:
            broken.clear()
            raise RuntimeError("once")
        return stream.take(2)

    order = InOrder([lambda: stream.take(0), lambda: stream.take(1), take])
    with pytest.raises(RuntimeError):
        order.come()
    assert [each.content for each in order.come()] == ["message 0", "message 1"]
