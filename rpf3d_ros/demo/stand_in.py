"""What stands at the other end of the topics in a demo, a benchmark or a soak: survey, radar, dispatch and operator.

It is light, so that it measures the nodes and not itself: what it publishes may be bytes that were laid out before,
and what it hears stays bytes, with the time at which they came.
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
from rpf3d_ros.messages.message_classes import message_class
from rpf3d_ros.nodes.acknowledge import who_acknowledges

NEWS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)
"""How results are heard: those from now on, none of them left out."""

SIMULATOR = "rpf3d_simulator"
SPIN = 0.02
"""Seconds that one spin waits for a message."""

Note = Callable[[bytes, int], None]
"""Told of each message: its CDR bytes, and when it came (ns, monotonic)."""


class StandIn:
    """A context manager: a node in a context of its own. One thread at a time may spin it; any may publish."""

    def __init__(self, speaks: tuple[str, ...] = (), name: str = "rpf3d_stand_in") -> None:
        """speaks : the topics that it will publish on, offered at once, because to be discovered takes time."""
        self._context = Context()
        self._context.init()
        self.node = Node(name, context=self._context)
        self._publishers = publishers_of(self.node, speaks)
        self._acknowledge = self.node.create_client(Trigger, f"{SIMULATOR}/acknowledge")
        self._set = self.node.create_client(SetParameters, f"{SIMULATOR}/set_parameters")
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def publish(self, topic: str, message: Any) -> int:
        """Publish a message, or bytes laid out as one; when that began (ns, monotonic)."""
        began = time.monotonic_ns()
        self._publishers[topic].publish(message)
        return began

    def hear(self, topic: str, note: Note, qos: QoSProfile = NEWS) -> None:
        """Tell `note` of each message of a topic, undecoded."""
        arrived = time.monotonic_ns
        kind = message_class(TOPICS[topic].kind)
        self.node.create_subscription(kind, topic, lambda data: note(data, arrived()), qos, raw=True)

    def spin_once(self, seconds: float = SPIN) -> None:
        """Take one of what has come."""
        self._executor.spin_once(timeout_sec=seconds)

    def wait(self, condition: Callable[[], Any], seconds: float) -> Any:
        """Spin until the condition gives something true, or time is up; what it gave."""
        deadline = time.monotonic() + seconds
        while not (answer := condition()) and time.monotonic() < deadline:
            self.spin_once()
        return answer

    def wait_for_listeners(self, seconds: float, count: int = 1, alive: Callable[[], bool] = lambda: True) -> bool:
        """Spin until every topic that is published on has so many subscribers, or they are dead; whether that came."""
        offered = self._publishers.values()

        def heard() -> bool:
            return all(publisher.get_subscription_count() >= count for publisher in offered)

        self.wait(lambda: heard() or not alive(), seconds)
        return heard()

    def acknowledge(self, by: str, seconds: float) -> tuple[bool, str]:
        """Acknowledge as an operator would: who and why as a parameter, then the service; whether it was taken."""
        done = self._call(self._set, who_acknowledges(by), seconds)
        if done is None or not done.results[0].successful:
            return False, "no answer" if done is None else str(done.results[0].reason)
        answer = self._call(self._acknowledge, Trigger.Request(), seconds)
        return (False, "no answer") if answer is None else (bool(answer.success), str(answer.message))

    def _call(self, client: Any, request: Any, seconds: float) -> Any:
        """The answer of a service, or None where there is none in time."""
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
