"""Convert the states of a node's parts to diagnostic_msgs; `health` does the reverse."""

from collections.abc import Iterable

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from rpf3d_ros.messages.health import Health


def diagnostics_of(stamp: Time, healths: Iterable[Health]) -> DiagnosticArray:
    """Return the states of a node's parts as the message for /diagnostics."""
    return DiagnosticArray(header=Header(stamp=stamp), status=[_status(health) for health in healths])


def _status(health: Health) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=bytes((health.level,)),
        name=health.name,
        message=health.message,
        hardware_id="rpf3d",
        values=[KeyValue(key=key, value=value) for key, value in health.values.items()],
    )
