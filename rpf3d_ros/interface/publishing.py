"""Publishing from any thread, at any moment, also while a signal shuts the context down; and in the place of a mine."""

from collections.abc import Iterable
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher

from rpf3d_ros.interface.qos import given_qos
from rpf3d_ros.interface.recorded_topics import TOPICS
from rpf3d_ros.messages.message_classes import message_class


def publishers_of(node: Node, topics: Iterable[str]) -> dict[str, Publisher]:
    """A publisher for each of some inputs of the simulator, as a mine's own would offer them."""
    return {
        name: node.create_publisher(message_class(TOPICS[name].kind), name, given_qos(TOPICS[name].offered))
        for name in topics
    }


def publish(node: Node, publisher: Any, message: Any) -> None:
    """Publish a message, or bytes that are one; nothing where the node's context has been shut down."""
    if not node.context.ok():
        return
    try:
        publisher.publish(message)
    except Exception:
        if node.context.ok():  # what a call into a context that a signal has just shut down raises is no error
            raise
