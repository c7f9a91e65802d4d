"""Tests that messages that arrive while the queues are read are passed on in the order of their publication."""

import itertools
from collections import deque
from functools import partial

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from suite.property_budget import examples

from rpf3d_ros.engine.in_order import InOrder

QUEUES = 3


class Stream:
    """Messages that arrive while queues are read.

    queues : queue of each message, in the order of publication
    paces : number of messages published after each reading of a queue; 1 after the last entry
    """

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


def test_a_message_that_waits_for_the_next_call_is_announced():
    stream = Stream([0, 0], [0, 1, 1])
    stream.publish(1)
    order = InOrder([partial(stream.take, 0)])
    assert [each.content for each in order.ready()] == ["message 0"] and order.keeps_some
    assert [each.content for each in order.ready()] == ["message 1"] and not order.keeps_some


@examples(300)
@given(
    st.lists(st.integers(0, QUEUES - 1), max_size=40),
    st.lists(st.integers(0, 4), max_size=60),
)
@example([0, 2], [0, 0, 2])  # both messages arrive after the first queue was read and before the last queue is read
def test_what_comes_during_a_look_is_handed_on_in_order_and_once(queues, paces):
    stream = Stream(queues, paces)
    order = InOrder([lambda queue=queue: stream.take(queue) for queue in range(QUEUES)])
    handed = []
    for _ in range(2 * len(queues) + len(paces) + 2):
        handed += order.ready()
    assert [(each.at_ns, each.queue, each.content) for each in handed] == [
        (at, queue, f"message {at}") for at, queue in enumerate(queues)
    ]


def test_a_message_is_not_kept_back_where_nothing_follows():
    stream = Stream([1], [1])
    stream.publish(1)
    order = InOrder([lambda queue=queue: stream.take(queue) for queue in range(QUEUES)])
    assert [each.content for each in order.ready()] == ["message 0"]


@pytest.mark.parametrize("calls", [{0}, {1}, {0, 1}, range(100)])
def test_what_a_queue_raises_is_told_and_keeps_nothing_of_another_back(calls):
    """The error may come in any call, or in every call."""
    stream, count = Stream([0, 2] * 5, [0] * 12 + [1] * 100), itertools.count()
    stream.publish(2)

    def take():
        if next(count) in calls:
            raise RuntimeError("cannot be looked at")
        return stream.take(1)

    order = InOrder([lambda: stream.take(0), take, lambda: stream.take(2)])
    handed, told = [], 0
    for _ in range(40):
        handed += [each.at_ns for each in order.ready()]
        told += len(order.errors)
    assert handed == list(range(10))
    assert told == min(len(calls), next(count))


def test_messages_of_one_time_keep_the_order_in_which_they_came():
    queues = [deque([(5, "a"), (5, "b")]), deque([(5, "c")])]
    order = InOrder([lambda queue=queue: queue.popleft() if queue else None for queue in queues])
    assert [each.content for each in order.ready()] == ["a", "b", "c"]
