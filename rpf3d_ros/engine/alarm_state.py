"""Decide whether the contact of an alarm bridge may be closed: only on fresh, valid and agreeing alerts."""

from typing import NamedTuple

from rpf3d_ros.messages.alert_reading import ReceivedLevel
from rpf3d_ros.messages.stamps import SECOND, nanoseconds_of_text

NOTHING_YET = "no alert has been received yet"


class HeardAlert(NamedTuple):
    """The alert of the site in one message of `alerts`.

    sequence : number of the publication; left_s : time (s) for which the alert was valid when it was published
    is_alarm : True if the alert sounds the alarm; level : level as a word
    """

    sequence: int
    left_s: float
    is_alarm: bool
    level: str


class AlarmState:
    """The last messages of `alarm` and `alerts`, and whether the relay contact of the alarm bridge may be closed.

    stale_s : age (s) above which a message is stale. All times of arrival are of a steady clock.

    The contact may be closed only while all of these conditions hold:

    - at least two alerts have arrived since the start, and since the publisher was last lost: since its last missed
      deadline, its death, or an alert that was not understood
    - the last messages of both topics are not stale, and the last alert is still valid
    - the last alert has a higher sequence number than the alert before
    - neither topic has the alarm on, and the level is not `fault`
    """

    def __init__(self, stale_s: float) -> None:
        self._stale = stale_s
        self._alarm: tuple[bool, float] | None = None
        self._alert: tuple[HeardAlert, float] | None = None
        self._before: int | None = None
        self._lost = ""

    def note_alarm(self, sounds: bool, at: float) -> None:
        """Note a message of `alarm` that arrived at a time (s)."""
        self._alarm = sounds, at

    def note_alert(self, alert: HeardAlert, at: float) -> None:
        """Note a message of `alerts` that arrived at a time (s)."""
        self._before = None if self._alert is None else self._alert[0].sequence
        self._alert, self._lost = (alert, at), ""

    def note_lost(self, why: str) -> None:
        """Note that the publisher is lost; the contact stays open until two more alerts have arrived.

        why : the reason, such as a missed deadline
        """
        self._lost, self._alert, self._before = why, None, None

    def why_open(self, now: float) -> str:
        """Return why the contact must be open at a time (s); "" if it may be closed."""
        if self._lost:
            return self._lost
        if self._alarm is None or self._alert is None:
            return NOTHING_YET
        (sounds, alarm_at), (alert, at) = self._alarm, self._alert
        age = now - min(alarm_at, at)
        if age > self._stale:
            return f"nothing has been received for {age:.1f} s, at most {self._stale:g} s are allowed"
        if now - at > alert.left_s:
            return "the last alert is no longer valid"
        if self._before is None or alert.sequence <= self._before:
            return "two publications in a row have not been received, or they are repeated, or of two programs"
        if sounds or alert.is_alarm:
            return f"the alarm sounds, the level is {alert.level}"
        return f"the level is {alert.level}" if alert.level == "fault" else ""


def heard_alert(alerts: list[ReceivedLevel]) -> HeardAlert | None:
    """Return the alert of the site from the levels in a message of `alerts`; None if a value is missing or wrong."""
    site = next(each for each in alerts if each.area is None)
    values = site.health.values
    stamp, until = (nanoseconds_of_text(values.get(key, "")) for key in ("stamp", "valid_until"))
    sequence, alarm = values.get("sequence", ""), values.get("alarm", "")
    if stamp is None or until is None or alarm not in ("true", "false"):
        return None
    if not (sequence.isascii() and sequence.isdigit() and len(sequence) <= 18):
        return None
    left = (until - stamp) / SECOND
    return HeardAlert(sequence=int(sequence), left_s=left, is_alarm=alarm == "true", level=site.state)
