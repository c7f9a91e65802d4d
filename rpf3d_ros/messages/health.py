"""The state of a node's parts, and how to read such states from diagnostic_msgs.

The messages may be objects of rclpy or, if read from a bag, of rosbags.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticArray

OK, WARN, ERROR, STALE = range(4)
"""Levels of a state in diagnostics (diagnostic_msgs/DiagnosticStatus.msg).

A message carries a level as one byte.
"""


@dataclass(frozen=True)
class Health:
    """The state of one part of a node.

    name : name of the node and of the part, such as "rpf3d_simulator: terrain"
    level : OK, WARN, ERROR or STALE
    message : one sentence
    values : further figures, by name
    """

    name: str
    level: int
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


def healths_of(array: "DiagnosticArray") -> list[Health]:
    """Return the states of a node's parts from a diagnostics message."""
    return [
        Health(
            name=status.name,
            level=_level(status.level),
            message=status.message,
            values={pair.key: pair.value for pair in status.values},
        )
        for status in array.status
    ]


def _level(level: bytes | int) -> int:
    """Return the level of a state as a number: rclpy has it as bytes, rosbags as a number."""
    return level[0] if isinstance(level, bytes) else int(level)
