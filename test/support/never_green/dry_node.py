"""Run a simulator node without a network and on simulated time, with its own threads for terrain, rocks and alerts.

All code is that of the node, with these exceptions. Subscriptions, publishers, clock and graph of rclpy are replaced.
Answers and diagnostics are not published. After each message, the campaign waits until all threads wait for work.
"""

import inspect
import itertools
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest.mock import patch

from rpf3d_ros.alerts import alert_desk, place_checks, region_evidence
from rpf3d_ros.engine import flyer, station, waiting_terrain
from rpf3d_ros.engine.clock_watch import ClockWatch
from rpf3d_ros.engine.configuration import StationConfiguration
from rpf3d_ros.engine.outlets import NoOutput, Outlets
from rpf3d_ros.interface import alert_publishers
from rpf3d_ros.interface.alert_publishers import AlertPublishers
from rpf3d_ros.nodes import inputs, publisher_reports, simulator
from rpf3d_ros.nodes.inputs import Inputs
from rpf3d_ros.nodes.simulator import SimulatorNode

WITH_TIME: tuple[ModuleType, ...] = (
    alert_publishers, flyer, inputs, place_checks, publisher_reports, region_evidence, simulator, station,
    waiting_terrain,
)  # fmt: skip
"""Modules in which the steady clock is replaced by a simulated clock."""

IDLE_WITHIN = 300.0
"""Time (s) after which a thread that is still busy is an error; it is long, because the first answer compiles code."""


class WatchedQueue:
    """A queue like `queue.SimpleQueue`; its condition `changed` has a waiter while a thread waits for an item."""

    def __init__(self) -> None:
        self._items: deque[Any] = deque()
        self.changed = threading.Condition()

    def put(self, item: Any) -> None:
        with self.changed:
            self._items.append(item)
            self.changed.notify()

    def get(self, timeout: float | None = None) -> Any:
        with self.changed:
            if not self.changed.wait_for(lambda: self._items, timeout):
                raise alert_desk.queue.Empty
            return self._items.popleft()

    def empty(self) -> bool:
        return not self._items


def wait_until_idle(conditions: Sequence[threading.Condition]) -> None:
    """Wait until a thread waits at each of the conditions; they are checked one after the other.

    conditions : in the order in which their threads pass work to each other. Raises RuntimeError after IDLE_WITHIN
        seconds
    """
    until = time.monotonic() + IDLE_WITHIN
    for condition in conditions:
        while True:
            with condition:
                if condition._waiters:
                    break
            if time.monotonic() > until:
                raise RuntimeError("a thread of the station does not become idle")
            time.sleep(0.0002)


class Received:
    """A publisher that appends (topic, message) to a list, which several publishers share."""

    is_activated = True

    def __init__(self, topic: str, published: list[tuple[str, Any]]) -> None:
        self._topic, self._published = topic, published

    def publish(self, message: Any) -> None:
        self._published.append((self._topic, message))


class DryRosNode:
    """A replacement for rclpy's node, with the methods that `Inputs` and `AlertPublishers` call.

    now_ns : returns the time of the node's clock (ns); publishers_of : returns the publishers of a topic in the graph
    take : topic -> callback that receives a message; published : (topic, message) of all published messages, in order
    """

    def __init__(self, now_ns: Callable[[], int], publishers_of: Callable[[str], list[Any]]) -> None:
        self._now_ns, self.get_publishers_info_by_topic = now_ns, publishers_of
        self.take: dict[str, Callable[..., None]] = {}
        self.published: list[tuple[str, Any]] = []
        self.context = SimpleNamespace(ok=lambda: True)

    def create_subscription(self, kind: Any, topic: str, callback: Callable[..., None], qos: Any, **_: Any) -> Any:
        counts = len(inspect.signature(callback).parameters) > 1  # the callback also takes the message information
        numbers, now_ns = itertools.count(1), self._now_ns

        def take(message: Any) -> None:
            callback(message, {"publication_sequence_number": next(numbers), "received_timestamp": now_ns()})

        self.take[topic] = take if counts else callback
        return SimpleNamespace(qos_profile=qos)

    def destroy_subscription(self, subscription: Any) -> None:
        """Do nothing."""

    def create_lifecycle_publisher(self, kind: Any, topic: str, qos: Any, **_: Any) -> Received:
        return Received(topic, self.published)

    def get_namespace(self) -> str:
        return "/"

    def get_name(self) -> str:
        return "rpf3d_simulator"

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        return []

    def resolve_topic_name(self, topic: str) -> str:
        return f"/{topic}"

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=self._now_ns()))


class DryLargeMessages:
    """A replacement for `LargeMessages` that passes terrain messages to their callbacks in the caller's thread."""

    def __init__(self, node: DryRosNode, topics: Sequence[Any], failed: Any, refused: Any, events: Any = None) -> None:
        self.qos = {topic.name: topic.qos for topic in topics}
        node.take |= {topic.name: partial(self._hand_on, topic, refused) for topic in topics}

    def _hand_on(self, topic: Any, refused: Any, content: Any, published_ns: int) -> None:
        try:
            topic.take(content, published_ns)
        except Exception as error:  # LargeMessages does the same in its thread
            refused(topic.name, published_ns, error)

    def close(self) -> None:
        """Do nothing."""


class DryNode:
    """A simulator node without a network."""

    _tick, _check_clock = SimulatorNode._tick, SimulatorNode._check_clock
    _notice_jump, _clock_went_back = SimulatorNode._notice_jump, SimulatorNode._clock_went_back

    def __init__(
        self, configuration: StationConfiguration, now_ns: Callable[[], int], steady: Callable[[], float],
        publishers_of: Callable[[str], list[Any]],
    ) -> None:  # fmt: skip
        """Start the threads and subscribe.

        now_ns : returns the time of the node's clock (ns); steady : returns the time of a steady clock (s)
        publishers_of : returns the publishers of a topic in the graph
        """
        self._patches = ExitStack()
        clock = SimpleNamespace(monotonic=steady, sleep=time.sleep, time_ns=now_ns)
        for module in WITH_TIME:
            if hasattr(module, "time"):
                self._patches.enter_context(patch.object(module, "time", clock))
        self._patches.enter_context(patch.object(inputs, "LargeMessages", DryLargeMessages))
        queues = SimpleNamespace(SimpleQueue=WatchedQueue, Empty=alert_desk.queue.Empty)
        self._patches.enter_context(patch.object(alert_desk, "queue", queues))
        self._now, self.ros = now_ns, DryRosNode(now_ns, publishers_of)
        self.health: Any = NoOutput()
        outlets = Outlets(
            answers=self.health, alerts=AlertPublishers(self.ros), health=self.health, logger=self.health, now=now_ns
        )
        parameters = configuration.parameters
        self._ticked, self._clock_stands, self.transforms = 0, False, None
        self._clock_watch = ClockWatch(parameters.clock_patience)
        self.station = station.Station(configuration, outlets)
        self.inputs = Inputs(self.ros, parameters, self.station, self.health, self._notice_jump)
        self.station.activate()
        self.settle()

    def settle(self) -> None:
        """Wait until all threads of the node wait for work."""
        one = self.station
        assert one.desk is not None
        wait_until_idle((one.terrain._changed, one.flyer._changed, one.desk._requests.changed))

    def receive(self, topic: str, *message: Any) -> None:
        """Pass a message to the callback of its topic, and wait until the message is processed.

        message : a message, or for terrain its CDR bytes and time of publication (ns)
        """
        self.ros.take[topic](*message)
        self.settle()

    def tick(self) -> None:
        """Do the regular work of the node's timer, and wait until it is done."""
        self._tick()
        self.settle()

    def close(self) -> None:
        """End all threads."""
        self.inputs.close()
        self.station.close()
        self._patches.close()


def numbered() -> Callable[[], int]:
    """Return a function that returns 1, 2, 3 and so on."""
    numbers = itertools.count(1)
    return lambda: next(numbers)
