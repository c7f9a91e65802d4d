"""Convert alerts, the alarm and diagnostics to recording entries; only changes are recorded."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from rpf3d_ros.messages.alert_reading import ReceivedLevel, alerts_of, decided_at_ns
from rpf3d_ros.messages.health import healths_of
from rpf3d_ros.recording.entries import EntryMaker, EntryTimes, LoggedStates, RecordingEntry, nanoseconds
from rpf3d_ros.recording.stream import Recording

COUNT_OF_RECORDED = "rpf3d_recorder: recording"
"""Name of the status that counts recorded messages; it is not recorded, because each recording would change it."""

LEVELS_OF_AREA = ("held", "evident")
"""Levels of an area that are compared, in addition to the shown level, to notice a change."""


class AlertEntries:
    """Converts messages of alerts, the alarm and diagnostics to entries of a recording."""

    def __init__(self, times: EntryTimes) -> None:
        """Start with no alerts; attribute `changes` counts the messages that changed a level of the site or an area."""
        self._times, self._logged = times, LoggedStates()
        self._areas_with_alerts: set[str] = set()
        self._levels: object = None
        self.changes = 0

    def makers(self) -> Mapping[str, EntryMaker]:
        """Return the methods that convert messages to entries, by the topic of the messages."""
        return {"alerts": self.alerts, "alarm": self.alarm, "/diagnostics": self.diagnostics}

    def alerts(self, array: Any) -> Iterator[RecordingEntry]:
        """Yield entries for the alert level of the site, and for the changed states and texts of site and areas.

        A lane is a coloured bar over time that shows the states of one area, or of the site. The level of the site is
        recorded with every decision, because it is drawn as a curve over time; a heartbeat that repeats a decision is
        not recorded. The text and the lane of the site are recorded if the site's level or the sentence in its status
        changes. The text and the lane of an area are recorded if a level of the area changes. The lane of an area ends
        if the message does not contain the area, for example because a machine has left.

        The entries have the time of the decision or, if the message lacks this time, the stamp of the message. This
        is the stamp of the sources, so several decisions on the same sources have the same stamp.
        """
        alerts = alerts_of(array)
        stamp_ns = decided_at_ns(alerts) or nanoseconds(array.header.stamp)
        levels = [(alert.area, alert.level, _levels_of(alert)) for alert in alerts]
        if levels != self._levels:
            self._levels, self.changes = levels, self.changes + 1
        for alert in alerts:
            if alert.area is None and self._logged.is_new("alert/level", (stamp_ns, alert.level)):
                yield self._times.at(stamp_ns, lambda r, a=alert: r.alert(a.level), "alert/level")
            lane = _lane_of(alert.area)
            if self._logged.is_new(f"alert/{lane}", (alert.level, _shown_content(alert))):
                yield self._times.at(stamp_ns, lambda r, a=alert: _draw_alert(r, a), f"alert/{lane}")
        areas = {alert.area for alert in alerts if alert.area is not None}
        for lane in map(_lane_of, sorted(self._areas_with_alerts - areas)):
            self._logged.forget(f"alert/{lane}")
            yield self._times.at(stamp_ns, lambda r, at=lane: r.alert_state(at, None), f"alert/{lane}")
        self._areas_with_alerts = areas

    def alarm(self, alarm: Any) -> Iterator[RecordingEntry]:
        """Yield an entry for the state of the alarm ("on" or "off"), if it has changed."""
        state = "on" if alarm.data else "off"
        if self._logged.is_new("alarm", state):
            yield self._times.at(self._times.now(), lambda r: r.alert_state("alarm", state), "alarm")

    def diagnostics(self, array: Any) -> Iterator[RecordingEntry]:
        """Yield an entry for the state of each part of a node, if the state has changed.

        A node publishes all its states every second. The count of recorded messages (COUNT_OF_RECORDED) is left out.
        """
        stamp_ns = nanoseconds(array.header.stamp)
        for health in healths_of(array):
            if health.name != COUNT_OF_RECORDED and self._logged.is_new(f"health/{health.name}", health):
                yield self._times.at(stamp_ns, lambda r, h=health: r.text("diagnostics", h))


def _shown_content(alert: ReceivedLevel) -> object:
    """Return the content that is compared to notice a change of an alert: the site's sentence, or the area's levels."""
    if alert.area is None:
        return alert.health.message
    return _levels_of(alert)


def _levels_of(alert: ReceivedLevel) -> list[str | None]:
    return [alert.health.values.get(name) for name in LEVELS_OF_AREA]


def _draw_alert(recording: Recording, alert: ReceivedLevel) -> None:
    recording.alert_state(_lane_of(alert.area), alert.state)
    recording.text("alerts", replace(alert.health, name=alert.area or "site"))


def _lane_of(area: str | None) -> str:
    """Return the name of the lane (bar of states over time) of an area, or of the site for None.

    The prefix of area lanes gives an area named "site" or "alarm" a separate lane.
    """
    return "site" if area is None else f"area/{area}"
