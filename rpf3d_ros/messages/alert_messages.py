"""An alert -> diagnostic_msgs/DiagnosticArray on `alerts` and std_msgs/Bool on `alarm`."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Bool, Header

from rpf3d_core.alerts.levels import Alert, AreaAlert
from rpf3d_ros.messages.alert_reading import ALERT
from rpf3d_ros.messages.diagnostic_messages import diagnostics_of
from rpf3d_ros.messages.health import ERROR, OK, WARN, Health

STALE = DiagnosticStatus.STALE[0]
LEVELS = {"normal": OK, "watch": WARN, "restrict": ERROR, "evacuate": ERROR, "fault": STALE}
"""Level -> that of the status. A fault is above an error, so who looks for errors and worse misses none."""


def alerts_message(header: Header, alert: Alert, result: int | None) -> DiagnosticArray:
    """The alert of the site as one status, its reasons as the message and what a bridge must know as values; then one
    of each area, named after it.

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
    site = Health(ALERT, LEVELS[alert.level.word], sentence, values)
    message = diagnostics_of(header.stamp, [site, *(_of_area(area, alert) for area in alert.areas)])
    message.header.frame_id = header.frame_id
    return message


def _of_area(area: AreaAlert, alert: Alert) -> Health:
    """What makes the level comes first, as in the reasons of the site."""
    held = f"{area.held.word} is held and needs an acknowledgement to step down"
    said = "; ".join((held, area.why) if area.held.word != area.evident.word else (area.why,))
    faults = "; ".join(alert.faults)
    if area.level.word == "fault":
        said = f"fault: {faults}; {said}"
    elif faults:
        said = f"{said}; {faults}"
    values = {
        "level": area.level.word,
        "held": area.held.word,
        "evident": area.evident.word,
        "valid_until_ns": str(alert.valid_until_ns),
    }
    return Health(f"{ALERT} {area.name}", LEVELS[area.level.word], said, values)


def alarm_message(alert: Alert) -> Bool:
    """Whether the alarm sounds, for a PLC."""
    return Bool(data=alert.alarm)
