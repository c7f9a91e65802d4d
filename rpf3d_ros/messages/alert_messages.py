"""Convert an alert to a diagnostic_msgs/DiagnosticArray for `alerts` and a std_msgs/Bool for `alarm`."""

from collections.abc import Mapping
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Bool, Header

from rpf3d_core.alerts.levels import Alert, AreaAlert
from rpf3d_ros.messages.alert_causes import causes_of_area, causes_of_site
from rpf3d_ros.messages.alert_reading import ALERT
from rpf3d_ros.messages.diagnostic_messages import diagnostics_of
from rpf3d_ros.messages.health import ERROR, OK, WARN, Health
from rpf3d_ros.messages.stamps import seconds_text

STALE = DiagnosticStatus.STALE[0]
LEVELS = {"normal": OK, "watch": WARN, "restrict": ERROR, "evacuate": ERROR, "fault": STALE}
"""The level of diagnostics (OK, WARN, ERROR, STALE) for each alert level.

A fault is STALE, which is above ERROR. A subscriber that looks for ERROR and above therefore misses no fault.
"""


class Publication(NamedTuple):
    """A publication of an alert: its number, which grows by 1 each time, and its time (ns) by the node's clock.

    run : identifier of the run of the node; the numbers begin again in each run
    """

    sequence: int
    at_ns: int
    run: str = ""


def alerts_message(
    header: Header, alert: Alert, result: int | None, publication: Publication | None = None
) -> DiagnosticArray:
    """Return the message of an alert: one status for the site, then one status for each area of interest.

    The message of the site's status contains the reasons; the values contain the figures that a bridge to a PLC needs.
    The status of an area is named after the area.

    header : frame and stamp of the message; the stamp must belong to the oldest sources of the decision, or be the time
        of the decision if there is no answer
    result : number of the result (stage of an answer) on which the decision is based; None if there is no answer
    publication : number and time of the publication, for a subscriber that must notice a repeated or an old message;
        None to leave these values out
    """
    reasons = {f"reason.{number}": reason for number, reason in enumerate(alert.reasons)}
    common = {
        "result": "" if result is None else str(result),
        "decided_at_ns": str(alert.at_ns),
        "valid_until_ns": str(alert.valid_until_ns),
        **_waiting_values(alert),
        **_publication_values(alert, publication),
    }
    values = {
        **_level_values(alert), "alarm": str(alert.alarm).lower(), **causes_of_site(alert), **common, **reasons,
    }  # fmt: skip
    sentence = f"{alert.level.word}: {'; '.join(alert.reasons)}"
    site = Health(name=ALERT, level=LEVELS[alert.level.word], message=sentence, values=values)
    message = diagnostics_of(header.stamp, [site, *(_of_area(area, alert, common) for area in alert.areas)])
    message.header.frame_id = header.frame_id
    return message


def _waiting_values(alert: Alert) -> dict[str, str]:
    """Return names and reasons of the acknowledgements that wait for another person, and until when (ns) they wait.

    The result has one text for each key of the message. All texts are "" if no acknowledgement waits.
    """
    until_ns = alert.waiting_until_ns
    return {
        "waiting_by": "; ".join(one.by for one in alert.waiting),
        "waiting_why": "; ".join(one.why for one in alert.waiting),
        "waiting_until_ns": "" if until_ns is None else str(until_ns),
    }


def _publication_values(alert: Alert, publication: Publication | None) -> dict[str, str]:
    if publication is None:
        return {}
    return {
        "sequence": str(publication.sequence),
        "run": publication.run,
        "stamp": seconds_text(publication.at_ns),
        "valid_until": seconds_text(alert.valid_until_ns),
    }


def _level_values(alert: Alert | AreaAlert) -> dict[str, str]:
    """Return the levels of the site or of an area: as words, and the shown level as the number of `Level`."""
    return {
        "level": alert.level.word,
        "level_number": str(int(alert.level)),
        "held": alert.held.word,
        "evident": alert.evident.word,
    }


def _of_area(area: AreaAlert, alert: Alert, common: Mapping[str, str]) -> Health:
    """Return the diagnostic status of an area; its message contains the reason for the alert level.

    common : values that are the same for the site and all areas
    """
    held = f"{area.held.word} is held and falls only after an acknowledgement"
    sentence = "; ".join((held, area.why) if area.held.word != area.evident.word else (area.why,))
    faults = "; ".join(alert.faults)
    if area.level.word == "fault":
        sentence = f"fault: {faults}; {sentence}"
    elif faults:
        sentence = f"{sentence}; {faults}"
    values = {**_level_values(area), **causes_of_area(area, alert), **common}
    return Health(name=f"{ALERT} {area.name}", level=LEVELS[area.level.word], message=sentence, values=values)


def alarm_message(alert: Alert) -> Bool:
    """Return the state of the alarm as a message for a PLC: true means that the alarm sounds."""
    return Bool(data=alert.alarm)
