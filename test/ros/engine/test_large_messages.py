"""Tests that large messages arrive byte for byte on a separate thread, and that their memory is freed."""

import os
import threading
import time

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import resident
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from shape_msgs.msg import Mesh

from rpf3d_core.live.survey import MeshSurvey
from rpf3d_ros.engine import large_messages
from rpf3d_ros.engine.large_messages import LargeMessages, LargeTopic
from rpf3d_ros.interface.qos import LATCHED
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh, same_bytes

MANY = 40
"""Number of messages of 7 MB each: 280 MB if their memory were not freed."""
DEEP = QoSProfile(depth=1000)
PATIENCE = 60.0
"""Time limit (s) of a wait for something that takes milliseconds."""
ARRIVES = 1.0
"""Time (s) within which small messages arrive; if they take longer, fewer of them are overwritten."""
STAYS = 60.0
"""Memory (MB) that may remain in use after the messages: history and buffers of the middleware."""


def mesh(count, seed=0):
    """Return the CDR bytes of a random mesh with `count` triangles."""
    random = np.random.default_rng(seed)
    return cdr_of_mesh(MeshSurvey(random.random((count, 3)), random.integers(0, count, (count, 3)).astype(np.int32)))


def wait(condition, turn=lambda: time.sleep(0.01)):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        turn()


@pytest.fixture
def subscriber(node):
    """Yield a node with a large-message subscription; `received` and `threads` list the messages and their threads."""
    received, threads = [], []

    def take(data, published_ns):
        received.append(data)
        threads.append(threading.current_thread())

    node.received, node.threads = received, threads
    node.subscription = subscribed(node, take)
    node.publisher = node.create_publisher(Mesh, "mesh", LATCHED)
    yield node
    node.subscription.close()


def fail(*told):
    pytest.fail(f"{told}")


def subscribed(node, take, topic="mesh", failed=fail, refused=fail):
    return LargeMessages(node, [LargeTopic(Mesh, topic, take, LATCHED)], failed, refused)


def publish(node, data):
    before = len(node.received)
    wait(lambda: node.publisher.get_subscription_count() > 0)
    node.publisher.publish(data)
    return before


def test_the_bytes_are_those_that_were_published_and_no_executor_was_needed(subscriber):
    sent = mesh(100_000)
    publish(subscriber, sent)
    wait(lambda: subscriber.received)
    assert isinstance(subscriber.received[0], memoryview) and same_bytes(subscriber.received[0], sent)
    assert subscriber.threads[0] is not threading.main_thread()


def test_what_came_stays_as_it_is_while_others_come(subscriber):
    for seed in range(3):
        before = publish(subscriber, mesh(50_000, seed))
        wait(lambda before=before: len(subscriber.received) > before)
    assert all(same_bytes(data, mesh(50_000, seed)) for seed, data in enumerate(subscriber.received))


def test_the_middleware_wakes_the_thread_for_each_message(node, monkeypatch):
    """A thread that only looked from time to time would look after ten minutes here."""
    monkeypatch.setattr(large_messages, "AT_LEAST_EVERY", 10 * PATIENCE)
    received = node.received = []
    some = subscribed(node, lambda data, published_ns: received.append(data))
    node.publisher = node.create_publisher(Mesh, "mesh", LATCHED)
    for count in (10, 20, 100_000):
        before = publish(node, mesh(count))
        wait(lambda before=before: len(received) > before)
    began = time.monotonic()
    some.close()
    assert time.monotonic() - began < PATIENCE
    assert [len(data) for data in received] == [len(mesh(count)) for count in (10, 20, 100_000)]


def test_a_message_that_came_before_the_thread_slept_wakes_it(node, monkeypatch):
    """The second message is published during the callback of the first, so nothing arrives while the thread sleeps."""
    monkeypatch.setattr(large_messages, "AT_LEAST_EVERY", 10 * PATIENCE)
    received = node.received = []

    def take(data, published_ns):
        received.append(data)
        if len(received) == 1:
            node.publisher.publish(mesh(20))
            time.sleep(ARRIVES)

    some = subscribed(node, take)
    node.publisher = node.create_publisher(Mesh, "mesh", LATCHED)
    publish(node, mesh(10))
    wait(lambda: len(received) == 2)
    some.close()


@pytest.mark.parametrize("missing", ["eventfd", "callback"])
def test_where_messages_are_not_announced_the_thread_looks_for_them(node, monkeypatch, missing):
    monkeypatch.setattr(large_messages, "AT_LEAST_EVERY", 10 * PATIENCE)
    if missing == "eventfd":
        monkeypatch.delattr(os, "eventfd")
    else:
        monkeypatch.setattr(large_messages._rcl(), "call_on_arrival", lambda *_: 3)  # RCL_RET_UNSUPPORTED
    received = node.received = []
    some = subscribed(node, lambda data, published_ns: received.append(data))
    node.publisher = node.create_publisher(Mesh, "mesh", LATCHED)
    publish(node, mesh(10))
    wait(lambda: received)
    some.close()


def test_an_executor_that_spins_takes_none_of_it(subscriber):
    executor = SingleThreadedExecutor(context=subscriber.context)
    executor.add_node(subscriber)
    publish(subscriber, mesh(10))
    wait(lambda: subscriber.received, lambda: executor.spin_once(timeout_sec=0.01))
    assert subscriber.threads[0] is not threading.main_thread()
    executor.shutdown()


def test_messages_leave_no_memory_behind(subscriber):
    def send():
        before = publish(subscriber, mesh(200_000))
        wait(lambda: len(subscriber.received) > before)
        subscriber.received[:] = [b""]

    for _ in range(3):
        send()
    began = resident(os.getpid())
    for _ in range(MANY):
        send()
    assert resident(os.getpid()) < began + STAYS


@pytest.mark.parametrize("takes", ["rcl", "the executor"])
def test_each_message_whose_callback_raises_is_refused_and_the_next_message_comes(node, monkeypatch, takes):
    received, times, told = [], [], []
    if takes == "the executor":
        monkeypatch.setattr(large_messages, "_rcl", lambda: None)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def take(data, published_ns):
        received.append(len(data))
        times.append(published_ns)
        if len(received) <= 2:
            raise ValueError("the first two are not wanted")

    node.received = received
    some = subscribed(node, take, refused=lambda topic, at_ns, error: told.append((topic, at_ns, str(error))))
    node.publisher = node.create_publisher(Mesh, "mesh", LATCHED)
    for count in (10, 10, 20):
        before = publish(node, mesh(count))
        wait(lambda before=before: len(received) > before, lambda: executor.spin_once(timeout_sec=0.01))
    some.close()
    executor.shutdown()
    assert received == [len(mesh(10)), len(mesh(10)), len(mesh(20))]
    assert told == [("mesh", published_ns, "the first two are not wanted") for published_ns in times[:2]]


def test_what_a_callback_raises_costs_no_message_that_came_with_it(node):
    received = []

    def take(data, published_ns):
        received.append(published_ns)
        time.sleep(0.2)  # so that the other messages are all waiting afterwards
        raise ValueError("none is wanted")

    node.received = received
    topics = [LargeTopic(Mesh, "mesh", take, QoSProfile(depth=10))]
    some = LargeMessages(node, topics, fail, lambda *told: None)
    node.publisher = node.create_publisher(Mesh, "mesh", QoSProfile(depth=10))
    for _ in range(4):
        publish(node, mesh(10))
    wait(lambda: len(received) == 4)
    some.close()
    assert received == sorted(received)


def test_nothing_comes_after_it_has_been_closed(subscriber):
    publish(subscriber, mesh(10))
    wait(lambda: subscriber.received)
    subscriber.subscription.close()
    subscriber.publisher.publish(mesh(20))
    time.sleep(0.2)
    assert len(subscriber.received) == 1
    subscriber.subscription.close()


def test_where_rcl_is_not_to_be_had_the_executor_hands_on_the_bytes(node, monkeypatch):
    monkeypatch.setattr(large_messages, "_rcl", lambda: None)
    received = node.received = []
    some = subscribed(node, lambda data, published_ns: received.append((data, published_ns)))
    node.publisher = node.create_publisher(Mesh, "mesh", LATCHED)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    before = time.time_ns()
    publish(node, mesh(10))
    wait(lambda: received, lambda: executor.spin_once(timeout_sec=0.01))
    data, published_ns = received[0]
    assert data == mesh(10) and before <= published_ns <= time.time_ns()
    executor.shutdown()
    some.close()


def test_messages_of_several_topics_come_in_the_order_in_which_they_were_published(node):
    received = []
    topics = [LargeTopic(Mesh, name, lambda data, at, name=name: received.append(name), DEEP) for name in "abc"]
    some = LargeMessages(node, topics, fail, fail)
    publishers = {name: node.create_publisher(Mesh, name, DEEP) for name in "abc"}
    wait(lambda: all(each.get_subscription_count() for each in publishers.values()))
    for each in publishers.values():  # subscribers that discover their publishers late receive the first messages late
        each.publish(mesh(10))
    wait(lambda: sorted(received) == list("abc"))
    received.clear()
    sent = [str(name) for name in np.random.default_rng(1).choice(list("abc"), 120)]
    for number, name in enumerate(sent):
        publishers[name].publish(mesh(20_000 if name == "c" else 10))
        if number % 7 == 0:
            time.sleep(0.013)
    wait(lambda: len(received) == len(sent))
    some.close()
    assert received == sent


def test_an_error_of_rcl_is_told_once_with_its_sentence_and_its_end_too(node, monkeypatch):
    told = []
    rcl, begin = large_messages._rcl(), time.time_ns()
    take = rcl.take
    monkeypatch.setattr(rcl, "take", lambda *given: 1)
    monkeypatch.setattr(large_messages, "AFTER_ERROR", 0.01)
    some = subscribed(node, fail, failed=lambda *given: told.append(given))
    wait(lambda: told)
    time.sleep(0.3)
    assert len(told) == 1 and "rcl returned 1" in told[0][0]
    monkeypatch.setattr(rcl, "take", take)
    wait(lambda: len(told) == 2)
    time.sleep(0.1)
    some.close()
    assert len(told) == 2 and told[1][0] == "" and begin < told[0][1] < told[1][1]


def test_what_fails_while_an_error_is_reported_ends_no_thread(node, monkeypatch):
    rcl, take, received, told = large_messages._rcl(), large_messages._rcl().take, [], []
    monkeypatch.setattr(rcl, "take", lambda *given: 1)
    monkeypatch.setattr(large_messages, "AFTER_ERROR", 0.01)

    def failed(*given):
        told.append(given)
        raise ZeroDivisionError

    some = subscribed(node, lambda data, published_ns: received.append(data), failed=failed)
    wait(lambda: told)
    monkeypatch.setattr(rcl, "take", take)
    node.received, node.publisher = received, node.create_publisher(Mesh, "mesh", LATCHED)
    publish(node, mesh(10))
    wait(lambda: received)
    some.close()


def test_a_publisher_whose_durability_does_not_fit_is_warned_of(node, capfd):
    some = subscribed(node, fail)
    publisher = node.create_publisher(Mesh, "mesh", QoSProfile(depth=1))  # volatile, but latched is required
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    said = []

    def turn():
        executor.spin_once(timeout_sec=0.05)
        said.extend(capfd.readouterr())

    wait(lambda: "DURABILITY" in "".join(said), turn)
    executor.shutdown()
    node.destroy_publisher(publisher)
    some.close()


@pytest.mark.parametrize(("one", "other", "same"), [(b"ab", b"ab", True), (b"ab", b"ac", False), (b"ab", b"a", False)])
def test_messages_are_the_same_where_every_byte_is(one, other, same):
    assert same_bytes(memoryview(one), other) is same
    assert same_bytes(b"", b"")


def test_messages_that_were_overwritten_are_counted_for_each_publisher_also_its_first(node):
    read, lost, busy, free = [], [], threading.Event(), threading.Event()

    def take(data, published_ns):
        read.append(len(data))
        busy.set()
        free.wait(PATIENCE)

    topic = LargeTopic(Mesh, "patches", take, QoSProfile(depth=3), lambda count, at_ns: lost.append(count))
    some = LargeMessages(node, [topic], fail, fail)
    first, second = (node.create_publisher(Mesh, "patches", DEEP) for _ in range(2))
    wait(lambda: first.get_subscription_count() and second.get_subscription_count())
    first.publish(mesh(10))
    wait(busy.is_set)
    for _ in range(20):
        first.publish(mesh(20))
    time.sleep(ARRIVES)
    free.set()
    wait(lambda: sum(lost) + len(read) == 21)
    free.clear(), busy.clear()
    first.publish(mesh(10))
    wait(busy.is_set)
    for _ in range(20):
        second.publish(mesh(20))  # its first messages: the node does not know how many were published before
    time.sleep(ARRIVES)
    free.set()
    wait(lambda: len(lost) == 2)
    some.close()
    assert lost[1] == 1
