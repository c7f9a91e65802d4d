"""The state of a node's parts, and diagnostic_msgs -> states, whoever made the message."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticArray

OK, WARN, ERROR, STALE = range(4)
"""Levels (diagnostic_msgs/DiagnosticStatus.msg); the message carries one byte."""


@dataclass(frozen=True)
class Health:
    """name : "node: part"; level : OK, WARN or ERROR; message : one sentence; values : further figures."""

    name: str
    level: int
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


def healths_of(array: "DiagnosticArray") -> list[Health]:
    """The states in a received array."""
    return [
        Health(status.name, _level(status.level), status.message, {pair.key: pair.value for pair in status.values})
        for status in array.status
    ]


def _level(level: bytes | int) -> int:
    """rclpy gives a byte as bytes, rosbags as a number."""
    return level[0] if isinstance(level, bytes) else int(level)
