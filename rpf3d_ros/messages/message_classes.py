"""Names of message types -> rclpy's classes."""

from importlib import import_module
from typing import Any


def message_class(kind: str) -> Any:
    """The class of a type such as "std_msgs/msg/Bool"."""
    module, _, name = kind.rpartition("/")
    return getattr(import_module(module.replace("/", ".")), name)
