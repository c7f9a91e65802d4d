"""Publish from any thread at any time, even while a signal shuts the context down; publishers for simulator inputs."""

from collections.abc import Iterable
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher

from rpf3d_ros.interface.qos import given_qos
from rpf3d_ros.interface.recorded_topics import TOPICS


def publishers_of(node: Node, topics: Iterable[str]) -> dict[str, Publisher]:
    """Return a publisher for each given input topic of the simulator, by name, for a program that replaces a sensor."""
    return {
        name: node.create_publisher(TOPICS[name].message_class, name, given_qos(TOPICS[name].offered))
        for name in topics
    }


def publish(node: Node, publisher: Any, message: Any) -> None:
    """Publish a message, or the bytes of a message; do nothing if the node's context has been shut down."""
    if not node.context.ok():
        return
    try:
        publisher.publish(message)
    except Exception:
        if node.context.ok():  # a failure is no error if a signal has just shut the context down
            raise
