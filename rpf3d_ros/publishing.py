"""Publishing from any thread, at any moment: also while a signal shuts the context down."""

from typing import Any

from rclpy.node import Node


def publish(node: Node, publisher: Any, message: Any) -> None:
    """Publish a message, or bytes that are one; nothing where the node's context has been shut down."""
    if not node.context.ok():
        return
    try:
        publisher.publish(message)
    except Exception:
        if node.context.ok():  # what a call into a context that a signal has just shut down raises is no error
            raise
