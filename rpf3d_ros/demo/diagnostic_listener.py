"""Receive the diagnostics of nodes; for programs that are not nodes, such as the demo and the tests."""

from typing import Self

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from rpf3d_ros.interface.qos import EVENTS
from rpf3d_ros.messages.health import Health, healths_of

PATIENCE = 0.1
"""Time that `spin_once` waits for a message (s)."""


class DiagnosticListener:
    """Receives /diagnostics from all nodes, for programs that are not nodes.

    A context manager with its own rclpy context.
    """

    def __init__(self) -> None:
        self.healths: dict[str, Health] = {}
        self._context = Context()
        self._context.init()
        self._node = Node("rpf3d_diagnostic_listener", context=self._context)
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._receive, EVENTS)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def spin_once(self) -> dict[str, Health]:
        """Wait at most PATIENCE (s) for a message; return the last state of each node's parts, by `Health.name`."""
        self._executor.spin_once(timeout_sec=PATIENCE)
        return self.healths

    def _receive(self, array: DiagnosticArray) -> None:
        self.healths.update({health.name: health for health in healths_of(array)})

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
