"""Publish from any thread, even while a signal shuts the context down; make publishers for the simulator's inputs."""

from collections.abc import Iterable, Mapping
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher

from rpf3d_ros.interface.qos import given_qos
from rpf3d_ros.interface.recorded_topics import TOPICS, RecordedTopic


def publishers_of(
    node: Node, topics: Iterable[str], known: Mapping[str, RecordedTopic] = TOPICS
) -> dict[str, Publisher]:
    """Return a publisher for each given input topic of the simulator, by the topic's name.

    This is for programs that publish in place of a sensor.

    topics : keys of `known`; known : message type and quality of service of each topic, by name
    """
    return {
        name: node.create_publisher(known[name].message_class, name, given_qos(known[name].offered))
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
