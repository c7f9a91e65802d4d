"""Publish the decisions on alerts, and report problems with them; without a decision the alarm sounds."""

import traceback

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Alert, Level
from rpf3d_ros.alerts.alert_desk import LONGEST_WRITE
from rpf3d_ros.engine.outlets import Outlets
from rpf3d_ros.messages.health import ERROR, OK, WARN


class DecisionReports:
    """Publishes each decision of the alert desk, and reports problems: the `DecisionListener` of a station."""

    def __init__(self, outlets: Outlets, map_frame: str) -> None:
        """Publish to `outlets`; map_frame : frame of the alerts."""
        self._outlets, self._map_frame = outlets, map_frame
        self._level: Level | None = None
        self._is_silent = False
        self._before, self._missing = "", False
        self._not_logged = self._not_remembered = ""

    def begin(self, problems: str) -> None:
        """Report problems of the log that were found at the start; problems : sentences."""
        self._before = problems
        self._outlets.health.set("decision log", ERROR, problems)

    def resume(self) -> None:
        """Publish decisions again after `end_with_alarm`."""
        self._is_silent = False

    def end_with_alarm(self) -> None:
        """Publish no further decision, and sound the alarm as the last message."""
        self._is_silent = True
        self._outlets.alerts.sound_alarm()

    def close(self) -> None:
        """End all outputs: later calls publish and report nothing."""
        self._outlets = self._outlets.silenced()

    def decided(self, alert: Alert, evidence: Evidence | None) -> None:
        """Publish an alert; if the level has changed, also print it to the node's ROS log.

        After `end_with_alarm`, do nothing until `resume` is called.
        """
        if self._is_silent:
            return
        is_published = self._outlets.alerts.publish(alert, evidence, self._map_frame)
        if is_published and self._level != alert.level:
            self._level = alert.level
            self._outlets.logger.info(f"alert: {alert.level.word}: {alert.reasons[0]}")

    def held_up(self, why: str) -> None:
        """Report why no decision can be made, and sound the alarm, because a missing alert does not mean safety.

        why : the reason; "" as soon as decisions can be made again, which sounds no alarm
        """
        self._outlets.health.set("clock", ERROR if why else OK, why or "the clock runs")
        if why:
            self._outlets.alerts.sound_alarm()

    def unwritten(self) -> None:
        """Report that a decision is not published yet because it waits, probably for the disk; and sound the alarm."""
        why = f"the disk does not respond: a decision has waited for {LONGEST_WRITE:g} s and is not published yet"
        self._outlets.health.set("decision log", ERROR, why)
        self._outlets.alerts.sound_alarm()

    def undecided(self, error: BaseException) -> None:
        """Report that a decision failed with an unforeseen error."""
        self._outlets.logger.error("".join(traceback.format_exception(error)))
        self._outlets.health.set("run", ERROR, f"no decision: {type(error).__name__}: {error}")

    def logged(self, fault: str) -> None:
        """Report whether the last decision, or refused acknowledgement, is on disk; fault : why not, "" if it is."""
        self._not_logged, self._missing = fault, self._missing or bool(fault)
        self._report_log()

    def remembered(self, fault: str) -> None:
        """Report whether the state for the next start was saved; fault : why it was not saved, "" if it was."""
        if fault != self._not_remembered:
            self._not_remembered = fault
            self._report_log()

    def _report_log(self) -> None:
        """Report the state of the log; earlier problems stay in the report, because an audit finds them."""
        faults = "; ".join(filter(None, (self._not_logged, self._not_remembered)))
        if faults:
            self._outlets.health.set("decision log", ERROR, faults)
        elif self._before or self._missing:
            lacking = "decisions since the start are missing from the log" if self._missing else ""
            earlier = "; ".join(filter(None, (self._before, lacking)))
            self._outlets.health.set("decision log", WARN, f"decisions are on disk now; earlier: {earlier}")
        else:
            self._outlets.health.set("decision log", OK, "every decision is on disk")
