"""Publish alerts on two latched topics: `alerts` has levels and reasons, `alarm` one true or false for a PLC.

Both messages are published again about every HEARTBEAT seconds, so that a subscriber can require a deadline.
"""

import secrets
import threading
import time
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.lifecycle import LifecycleNode
from std_msgs.msg import Bool, Header

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Alert
from rpf3d_ros.interface.publishing import publish
from rpf3d_ros.interface.qos import ALERTS, HEARTBEAT, OVERRIDABLE
from rpf3d_ros.messages.alert_messages import Publication, alarm_message, alerts_message
from rpf3d_ros.messages.diagnostic_messages import of_unit
from rpf3d_ros.messages.stamps import stamp_of

EARLY = 0.15
"""Time (s) by which a heartbeat may be early, because the node checks only from time to time whether one is due."""


class PublishedAlert(NamedTuple):
    """The last published alert, kept so that it can be published again.

    header : frame and stamp of the message on topic `alerts`; alert : the alert of the decision
    result : number of the live result on which the alert was decided; None if there was no result
    """

    header: Header
    alert: Alert
    result: int | None


class AlertPublishers:
    """The publishers of `alerts` and `alarm`. They publish only while the node is active. Any thread may call."""

    def __init__(self, node: LifecycleNode) -> None:
        self._node = node
        options = {"qos_overriding_options": OVERRIDABLE}
        self._alerts = node.create_lifecycle_publisher(DiagnosticArray, "alerts", ALERTS, **options)
        self._alarm = node.create_lifecycle_publisher(Bool, "alarm", ALERTS, **options)
        self._lock = threading.Lock()
        self._last: PublishedAlert | None = None
        self._is_sounding, self._sequence, self._published_at = False, 0, 0.0
        self._run = secrets.token_hex(8)
        self.closed = False

    def publish(self, alert: Alert, evidence: Evidence | None, frame: str) -> bool:
        """Publish the alert of a decision on `alarm` and `alerts`, and return True.

        If the node is inactive or is being destroyed, publish nothing and return False.

        `alerts` has the stamp of the oldest sources of the decision, or the time of the decision if there is no answer.

        evidence : the evidence of the decision, None if there is no answer
        frame : frame of the message on `alerts`
        """
        if self.closed or not self._alerts.is_activated:
            return False
        stamp = alert.at_ns if evidence is None else evidence.trigger_stamp_ns
        header = Header(frame_id=frame, stamp=stamp_of(stamp))
        with self._lock:
            self._is_sounding = False
            self._last = PublishedAlert(
                header=header, alert=alert, result=None if evidence is None else evidence.result
            )
            self._repeat(self._last)
        return True

    def sound_alarm(self) -> None:
        """Publish `alarm` as true, and repeat it until the next decision; call this if no decision can be published."""
        with self._lock:
            self._sound()

    def beat(self) -> None:
        """Publish the last alert again if a heartbeat is due; call this several times within HEARTBEAT (s).

        Only `alarm`, as true, is published if there is no decision yet, if `sound_alarm` was called after the last
        decision, or if the validity of the last decision has ended. In this last case, `alarm` follows one heartbeat
        later, because the next decision may be about to be published.
        """
        with self._lock:
            since = time.monotonic() - self._published_at
            if self.closed or since < HEARTBEAT - EARLY:
                return
            has_ended = self._last is not None and self._now() >= self._last.alert.valid_until_ns
            if self._last is None or self._is_sounding or (has_ended and since > 2.0 * HEARTBEAT):
                self._sound()
            elif self._alerts.is_activated and not has_ended:
                self._repeat(self._last)

    def forget(self) -> None:
        """Forget the last alert, so that it is not repeated; call this when the node is activated again."""
        with self._lock:
            self._last, self._is_sounding = None, False

    def _repeat(self, last: PublishedAlert) -> None:
        self._sequence += 1
        publication = Publication(sequence=self._sequence, at_ns=self._now(), run=self._run)
        publish(self._node, self._alarm, alarm_message(last.alert))
        alerts = alerts_message(last.header, last.alert, last.result, publication)
        publish(self._node, self._alerts, of_unit(alerts, self._node.get_namespace()))
        self._published_at = time.monotonic()

    def _sound(self) -> None:
        self._is_sounding = True
        if not self.closed and self._alarm.is_activated:
            publish(self._node, self._alarm, Bool(data=True))
            self._published_at = time.monotonic()

    def _now(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)
