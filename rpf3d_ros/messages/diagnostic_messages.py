"""Convert the states of a node's parts to diagnostic_msgs; `health` does the reverse."""

from collections.abc import Iterable

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from rpf3d_ros.messages.health import Health

UNIT = "rpf3d"
"""Beginning of the hardware id of all states; the namespace of the node is appended, if it has one."""


def diagnostics_of(stamp: Time, healths: Iterable[Health]) -> DiagnosticArray:
    """Return the states of a node's parts as the message for /diagnostics."""
    return DiagnosticArray(header=Header(stamp=stamp), status=[_status(health) for health in healths])


def of_unit(message: DiagnosticArray, namespace: str) -> DiagnosticArray:
    """Set the hardware id in a node's message: `rpf3d` and the node's namespace; return the message.

    Two pits in one ROS domain can then be distinguished.

    >>> of_unit(diagnostics_of(Time(), [Health("a: b", 0, "well")]), "/pit_a").status[0].hardware_id
    'rpf3d/pit_a'
    """
    for status in message.status:
        status.hardware_id = UNIT + namespace.rstrip("/")
    return message


def _status(health: Health) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=bytes((health.level,)),
        name=health.name,
        message=health.message,
        hardware_id=UNIT,
        values=[KeyValue(key=key, value=value) for key, value in health.values.items()],
    )
