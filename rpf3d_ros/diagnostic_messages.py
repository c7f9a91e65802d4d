"""diagnostic_msgs <-> the state of a node's parts."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

OK, WARN, ERROR = (level[0] for level in (DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR))
"""Levels as integers; the message carries one byte (diagnostic_msgs/DiagnosticStatus.msg)."""


@dataclass(frozen=True)
class Health:
    """name : "node: part"; level : OK, WARN or ERROR; message : one sentence; values : further figures."""

    name: str
    level: int
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


def diagnostics_of(stamp: Time, healths: Iterable[Health]) -> DiagnosticArray:
    """The array that goes to /diagnostics."""
    return DiagnosticArray(header=Header(stamp=stamp), status=[_status(health) for health in healths])


def healths_of(array: DiagnosticArray) -> list[Health]:
    """The states in a received array."""
    return [
        Health(status.name, status.level[0], status.message, {pair.key: pair.value for pair in status.values})
        for status in array.status
    ]


def _status(health: Health) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=bytes((health.level,)),
        name=health.name,
        message=health.message,
        hardware_id="rpf3d",
        values=[KeyValue(key=key, value=value) for key, value in health.values.items()],
    )
