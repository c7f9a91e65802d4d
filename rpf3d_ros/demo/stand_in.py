"""A replacement for survey, radar, dispatch and operator in a demo, a benchmark or a soak test.

The replacement needs little computing time, so that measurements show the nodes. It can publish messages that are
already serialized. Received messages stay serialized, and each is passed on with its time of arrival.
"""

import time
from collections.abc import Callable
from typing import Any, Self

from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger

from rpf3d_ros.interface.publishing import publishers_of
from rpf3d_ros.interface.recorded_topics import TOPICS
from rpf3d_ros.nodes.acknowledge import acknowledged_by_request

NEWS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)
"""Quality of service for results: only new messages, of which 100 may wait."""

SIMULATOR = "rpf3d_simulator"
SPIN = 0.02
"""Time that one spin waits for a message (s)."""

Receive = Callable[[bytes, int], None]
"""A function that is called for each received message, with its CDR bytes and its time of arrival (ns, monotonic)."""


class StandIn:
    """Publishes and subscribes in place of survey, radar and operator; a context manager with a separate node.

    One thread at a time may spin; any thread may publish.
    """

    def __init__(self, publishes: tuple[str, ...] = (), name: str = "rpf3d_stand_in", namespace: str = "") -> None:
        """Create the node.

        publishes : topics whose publishers are created immediately, because discovery takes time
        namespace : of the node, its topics and the simulator; "" for the root namespace
        """
        self._context = Context()
        self._context.init()
        self.node = Node(name, context=self._context, namespace=namespace)
        self._publishers = publishers_of(self.node, publishes)
        self._acknowledge = self.node.create_client(Trigger, f"{SIMULATOR}/acknowledge")
        self._set = self.node.create_client(SetParameters, f"{SIMULATOR}/set_parameters")
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def publish(self, topic: str, message: Any) -> int:
        """Publish a message, or the bytes of a message; return the time just before publishing (ns, monotonic)."""
        began = time.monotonic_ns()
        self._publishers[topic].publish(message)
        return began

    def subscribe(self, topic: str, receive: Receive, qos: QoSProfile = NEWS) -> None:
        """Call `receive` for each message of a topic, with its CDR bytes and its time of arrival (ns, monotonic)."""
        arrived = time.monotonic_ns
        kind = TOPICS[topic].message_class
        self.node.create_subscription(kind, topic, lambda data: receive(data, arrived()), qos, raw=True)

    def spin_once(self, seconds: float = SPIN) -> None:
        """Wait for a received message for at most `seconds`, and handle it."""
        self._executor.spin_once(timeout_sec=seconds)

    def wait(self, condition: Callable[[], Any], seconds: float) -> Any:
        """Handle messages until a condition is true, for at most `seconds` (s); return the condition's last value."""
        deadline = time.monotonic() + seconds
        while not (answer := condition()) and time.monotonic() < deadline:
            self.spin_once()
        return answer

    def wait_for_subscribers(self, seconds: float, count: int = 1, alive: Callable[[], bool] = lambda: True) -> bool:
        """Handle messages until every published topic has `count` subscribers, or `alive` returns False.

        Return True if every topic has enough subscribers.

        seconds : longest time to wait (s); alive : returns False if it is useless to wait longer
        """
        offered = self._publishers.values()

        def all_subscribed() -> bool:
            return all(publisher.get_subscription_count() >= count for publisher in offered)

        self.wait(lambda: all_subscribed() or not alive(), seconds)
        return all_subscribed()

    def acknowledge(self, by: str, seconds: float) -> tuple[bool, str]:
        """Acknowledge as an operator would; return True if the simulator reports success, and the reply as text.

        Success means that the level was lowered, or that the fault of an unknown level has ended.

        Name and reason are set as a parameter of the simulator, then its service is called.

        by : "NAME: REASON"; seconds : longest time to wait for each answer (s)
        """
        done = self._call(self._set, acknowledged_by_request(by), seconds)
        if done is None or not done.results[0].successful:
            return False, "no answer" if done is None else str(done.results[0].reason)
        answer = self._call(self._acknowledge, Trigger.Request(), seconds)
        return (False, "no answer") if answer is None else (bool(answer.success), str(answer.message))

    def _call(self, client: Any, request: Any, seconds: float) -> Any:
        """Return the reply of a service; None if no reply arrives within `seconds` (s)."""
        if not self.wait(client.service_is_ready, seconds):
            return None
        future = client.call_async(request)
        self.wait(future.done, seconds)
        return future.result() if future.done() else None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
