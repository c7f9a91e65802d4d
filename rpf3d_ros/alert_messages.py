"""An alert -> diagnostic_msgs/DiagnosticArray on `alerts` and std_msgs/Bool on `alarm`."""

from collections.abc import Sequence
from typing import Protocol

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Bool, Header

from rpf3d_ros.diagnostic_messages import diagnostics_of
from rpf3d_ros.health import ERROR, OK, WARN, Health

NAME = "rpf3d: alert"

STALE = DiagnosticStatus.STALE[0]
LEVELS = {"normal": OK, "watch": WARN, "restrict": ERROR, "evacuate": ERROR, "fault": STALE}
"""Level -> that of the status. A fault is above an error, so who looks for errors and worse misses none."""


class Word(Protocol):
    """A level of an alert (`alerts.levels.Level`)."""

    @property
    def word(self) -> str:
        """In lower case."""


class Decided(Protocol):
    """What is asked of an alert (`alerts.levels.Alert`)."""

    @property
    def level(self) -> Word:
        """What is shown."""

    @property
    def held(self) -> Word:
        """The highest since the last step down."""

    @property
    def reasons(self) -> Sequence[str]:
        """Sentences."""

    @property
    def at_ns(self) -> int:
        """When it was decided."""

    @property
    def valid_until_ns(self) -> int:
        """From then on it is a fault."""

    @property
    def alarm(self) -> bool:
        """Whether the alarm sounds."""


def alerts_message(header: Header, alert: Decided, result: int | None) -> DiagnosticArray:
    """The alert as one status: its reasons as the message, and what a bridge must know as values.

    header : stamped as what triggered the decision; result : of the answer decided on, None where there is none
    """
    reasons = {f"reason.{number}": reason for number, reason in enumerate(alert.reasons)}
    values = {
        "level": alert.level.word,
        "held": alert.held.word,
        "alarm": str(alert.alarm).lower(),
        "result": "" if result is None else str(result),
        "decided_at_ns": str(alert.at_ns),
        "valid_until_ns": str(alert.valid_until_ns),
        **reasons,
    }
    sentence = f"{alert.level.word}: {'; '.join(alert.reasons)}"
    message = diagnostics_of(header.stamp, [Health(NAME, LEVELS[alert.level.word], sentence, values)])
    message.header.frame_id = header.frame_id
    return message


def alarm_message(alert: Decided) -> Bool:
    """Whether the alarm sounds, for a PLC."""
    return Bool(data=alert.alarm)
