"""Decide whether an alarm bridge may close its contact to a PLC: only while recent, valid alerts sound no alarm."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from rpf3d_ros.messages.alert_reading import ReceivedLevel
from rpf3d_ros.messages.stamps import SECOND, nanoseconds_of_text

NOTHING_YET = "no alert has been received yet; the bridge must be in the namespace of the simulator"

CLOCK_OFFSET = 1.0
"""Default time (s) by which the clocks of simulator and bridge may differ."""


class HeardAlert(NamedTuple):
    """The alert of the site in one message of `alerts`.

    sequence : number of the publication; stamp_ns, until_ns : time of the publication, and end of validity (ns, by the
        simulator's clock)
    is_alarm : True if the alert sounds the alarm; level : level as a word
    run : identifier of the run of the simulator, "" if the message has none, as in older versions of the simulator
    """

    sequence: int
    stamp_ns: int
    until_ns: int
    is_alarm: bool
    level: str
    run: str = ""

    @property
    def left_s(self) -> float:
        """Time (s) for which the alert was valid when it was published."""
        return (self.until_ns - self.stamp_ns) / SECOND


class AlarmState:
    """The last messages of `alarm` and `alerts`, and whether the relay contact of the alarm bridge may be closed.

    stale_s : age (s) above which a message is stale; ages are measured by a steady clock
    offset_s : time (s) by which the clocks of simulator and bridge may differ

    The contact may be closed only while all of these conditions hold:

    - no topic is known to have two publishers, and the known publishers of both topics belong to the same node
    - at least two alerts have arrived since the start, and since the publisher was last lost; a publisher is lost if
      it misses a deadline, if it dies, or if an alert cannot be read
    - the last messages of both topics are not stale
    - the last alert is still valid, judged both by the time since its arrival and by the clock of the bridge
    - for the last `stale_s`, all alerts came from one run of the simulator, with rising sequence numbers
    - the alarm is off in the last messages of both topics, and the level is not `fault`
    """

    def __init__(self, stale_s: float, offset_s: float = CLOCK_OFFSET) -> None:
        self._stale, self._offset_ns = stale_s, int(offset_s * SECOND)
        self._alarm: tuple[bool, float] | None = None
        self._alert: tuple[HeardAlert, float] | None = None
        self._newest: HeardAlert | None = None
        self._is_second = False
        self._disorder_at: float | None = None
        self._lost = self._several = ""

    def note_alarm(self, sounds: bool, at: float) -> None:
        """Note a message of `alarm`; sounds : True if the alarm is on; at : time of its arrival (s, steady clock)."""
        self._alarm = sounds, at

    def note_alert(self, alert: HeardAlert, at: float) -> None:
        """Note a message of `alerts`; at : time of arrival (s, steady clock)."""
        newest = self._newest
        if newest is not None and (alert.run != newest.run or alert.sequence <= newest.sequence):
            self._disorder_at = at
        self._is_second = self._alert is not None
        self._alert, self._newest, self._lost = (alert, at), alert, ""

    def note_lost(self, why: str) -> None:
        """Record that the publisher is lost; the contact stays open until two more alerts have arrived.

        why : the reason, such as a missed deadline
        """
        self._lost, self._alert, self._is_second = why, None, False

    def note_publishers(self, nodes: Mapping[str, Sequence[str]]) -> None:
        """Note the current publishers; nodes : names of the nodes that publish `alarm` and `alerts`, by topic."""
        for topic, names in nodes.items():
            if len(names) > 1:
                self._several = f"{len(names)} programs publish {topic} ({', '.join(sorted(names))}): stop all but one"
                return
        different = sorted({name for names in nodes.values() for name in names})
        self._several = f"alarm and alerts come from different nodes: {', '.join(different)}" if different[1:] else ""

    def why_open(self, now: float, clock_ns: int) -> str:
        """Return why the alarm contact must be open; "" if it may be closed.

        now : current time (s, steady clock)
        clock_ns : current time (ns) of the bridge's clock, which may differ from the simulator's clock by `offset_s`
        """
        if self._several or self._lost:
            return self._several or self._lost
        if self._alarm is None or self._alert is None:
            return NOTHING_YET
        (sounds, alarm_at), (alert, at) = self._alarm, self._alert
        age = now - min(alarm_at, at)
        if age > self._stale:
            return f"nothing has been received for {age:.1f} s, at most {self._stale:g} s are allowed"
        if wrong := self._not_valid(alert, now - at, clock_ns) or self._disorder(now):
            return wrong
        if alert.is_alarm:
            return f"the alarm sounds, the level is {alert.level}"
        if sounds:
            return "the alarm sounds"
        return f"the level is {alert.level}" if alert.level == "fault" else ""

    def _not_valid(self, alert: HeardAlert, since_s: float, clock_ns: int) -> str:
        """Return why the last alert is not valid now, "" if it is valid.

        since_s : time (s) since the arrival of the alert; clock_ns : as in `why_open`
        """
        if since_s > alert.left_s:
            return "the last alert is no longer valid"
        past, ahead = clock_ns - alert.until_ns, alert.stamp_ns - clock_ns
        if past > self._offset_ns:
            return f"by the clock of this bridge, the last alert expired {past / SECOND:.1f} s ago"
        if ahead > self._offset_ns:
            return f"by the clock of this bridge, the last alert was published {ahead / SECOND:.1f} s in the future"
        return ""

    def _disorder(self, now: float) -> str:
        if not self._is_second:
            return "two alerts in a row have not been received yet"
        if self._disorder_at is not None and now - self._disorder_at < self._stale:
            return "alerts are repeated, two programs publish alerts, or the simulator was restarted"
        return ""


def heard_alert(alerts: list[ReceivedLevel]) -> HeardAlert | None:
    """Return the alert of the site from the levels in a message of `alerts`; None if a value is missing or wrong.

    alerts : levels as `alerts_of` returns them, so that the level of the site is among them
    """
    site = next(each for each in alerts if each.area is None)
    values = site.health.values
    stamp, until = (nanoseconds_of_text(values.get(key, "")) for key in ("stamp", "valid_until"))
    sequence, alarm = values.get("sequence", ""), values.get("alarm", "")
    if stamp is None or until is None or alarm not in ("true", "false"):
        return None
    if not (sequence.isascii() and sequence.isdigit() and len(sequence) <= 18):
        return None
    return HeardAlert(
        sequence=int(sequence), stamp_ns=stamp, until_ns=until, is_alarm=alarm == "true", level=site.state,
        run=values.get("run", ""),
    )  # fmt: skip
