"""Subscribe to `alerts` and `alarm` in the campaign, and return the level and the state of an alarm bridge."""

from collections.abc import Callable
from typing import Any

from rpf3d_ros.alerts.alarm_state import AlarmState, heard_alert
from rpf3d_ros.messages.alert_reading import alerts_of
from rpf3d_ros.messages.stamps import nanoseconds_of_text

STALE = 3.0
"""Age (s) of the last message above which the alarm bridge opens its contact (alarm)."""


class Watcher:
    """Reads published messages as the documentation demands of a subscriber.

    An alert that has expired counts as a fault, unless its level is `evacuate`. A sounding alarm without a later alert,
    and the time before the first alert, count as a fault.
    """

    def __init__(self, published: list[tuple[str, Any]], now_ns: Callable[[], int]) -> None:
        """Begin without a message.

        published : list of (topic, message), in order; new messages are appended to this list
        now_ns : returns the time of the subscriber's clock (ns)
        """
        self._published, self._now_ns = published, now_ns
        self._read, self._site, self._is_sounding = 0, None, True
        self._bridge = AlarmState(STALE)

    def shown(self, at: float) -> str:
        """Return the level that a subscriber must assume for the site at a steady time (s), as a word."""
        return self._value("level", at)

    def evident(self, at: float) -> str:
        """Return the level of the newest evidence, as a word; as `shown` if the alert has expired or is a fault."""
        return self._value("evident", at)

    def is_closed(self, at: float) -> bool:
        """Return True if the alarm bridge keeps its contact closed (no alarm) at a steady time (s)."""
        self._read_on(at)
        return not self._bridge.why_open(at, self._now_ns())

    def _value(self, key: str, at: float) -> str:
        self._read_on(at)
        if self._site is None or self._is_sounding:
            return "fault"
        values = self._site.health.values
        until = nanoseconds_of_text(values["valid_until"])
        if until is None or self._now_ns() >= until or values["level"] == "fault":
            return values["level"] if values["level"] == "evacuate" else "fault"
        return str(values[key])

    def _read_on(self, at: float) -> None:
        for topic, message in self._published[self._read :]:
            if topic == "alarm":
                self._is_sounding = message.data
                self._bridge.note_alarm(message.data, at)
                continue
            levels = alerts_of(message)
            self._site, self._is_sounding = next(each for each in levels if each.area is None), False
            alert = heard_alert(levels)
            if alert is not None:
                self._bridge.note_alert(alert, at)
        self._read = len(self._published)
