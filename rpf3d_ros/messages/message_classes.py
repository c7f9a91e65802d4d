"""Find rclpy's message classes by the names of their types."""

from importlib import import_module
from typing import Any


def message_class(kind: str) -> Any:
    """Return the class of a message type such as "std_msgs/msg/Bool"."""
    module, _, name = kind.rpartition("/")
    return getattr(import_module(module.replace("/", ".")), name)
