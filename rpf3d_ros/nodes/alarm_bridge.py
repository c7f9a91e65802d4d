"""The node rpf3d_alarm_bridge: closes a contact only while fresh alerts of one simulator say that no alarm sounds.

The node is an example for programs that read `alerts` and `alarm`: it requires their deadline and their liveliness.
"""

import contextlib
import queue
import threading
import time
from functools import partial
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.subscription import Subscription
from std_msgs.msg import Bool

from rpf3d_core.errors import InputError
from rpf3d_ros.alerts.alarm_state import AlarmState, heard_alert
from rpf3d_ros.interface.declared_parameters import declare
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.interface.parameters import AlarmBridgeParameters
from rpf3d_ros.interface.qos import ALERTS, OVERRIDABLE
from rpf3d_ros.messages.alert_reading import alerts_of
from rpf3d_ros.messages.health import ERROR, OK
from rpf3d_ros.nodes.alarm_contacts import FileContact, TcpContact

NAME = "rpf3d_alarm_bridge"

LOOK = 0.1
"""Time (s) between two checks of the age of the last alert."""

WAITING_REPORTS = 100
"""Number of changes that may wait to be reported; if more wait, the oldest are not reported."""


def put_newest(reports: "queue.Queue[str]", report: str) -> None:
    """Put a report in a queue without waiting; a full queue drops its oldest reports."""
    while True:
        try:
            reports.put_nowait(report)
        except queue.Full:
            with contextlib.suppress(queue.Empty):
                reports.get_nowait()
        else:
            return


class AlarmBridgeNode(Node):
    """Receives `alerts` and `alarm`, and keeps the contacts closed while all conditions of `AlarmState` hold.

    For example, the contacts are open while an alarm sounds, while the last messages are too old, and while more than
    one program publishes one of the topics.
    """

    def __init__(self) -> None:
        super().__init__(NAME)
        parameters = declare(self, AlarmBridgeParameters)
        self.state, self.why = AlarmState(parameters.stale_after, parameters.clock_offset_s), "not looked yet"
        self.contacts = _contacts(parameters)
        self.health = HealthReport(self)
        self._alive: dict[str, int] = {}
        self._reports: queue.Queue[str] = queue.Queue(WAITING_REPORTS)
        threading.Thread(target=self._report, name="reports", daemon=True).start()
        self._subscriptions_of = {
            "alarm": self._subscribe(Bool, "alarm", self._alarm),
            "alerts": self._subscribe(DiagnosticArray, "alerts", self._alerts),
        }
        self.create_timer(LOOK, self.look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def look(self) -> None:
        """Open or close the contacts according to the last messages and their age; report a change in the diagnostics.

        The change is reported on another thread, because a log that hangs must not delay the next call.
        """
        self.state.note_publishers({topic: self._publishers_of(topic) for topic in self._subscriptions_of})
        why = self.state.why_open(time.monotonic(), self.get_clock().now().nanoseconds)
        for contact in self.contacts:
            contact.set(not why)
        if why != self.why:
            self.why = why
            put_newest(self._reports, why)

    def _subscribe(self, kind: Any, topic: str, callback: Any) -> Subscription:
        events = SubscriptionEventCallbacks(
            deadline=self._deadline_missed, liveliness=partial(self._liveliness_changed, topic)
        )
        return self.create_subscription(
            kind, topic, callback, ALERTS, event_callbacks=events, qos_overriding_options=OVERRIDABLE
        )

    def _publishers_of(self, topic: str) -> list[str]:
        """Return the full names of the nodes that publish a topic; empty if the ROS graph shows no publisher.

        If the graph shows some publishers, but fewer than the liveliness events of DDS report, the name "unknown" is
        added for each publisher that the graph does not show.
        """
        seen = self.get_publishers_info_by_topic(self._subscriptions_of[topic].topic_name)
        names = [f"{one.node_namespace.rstrip('/')}/{one.node_name}" for one in seen]
        return names + ["unknown"] * (self._alive.get(topic, 0) - len(names)) if len(names) else names

    def _report(self) -> None:
        """Report changes of the contact in the diagnostics; this runs on a separate thread."""
        while True:
            why = self._reports.get()
            self.health.set("contact", ERROR if why else OK, f"open: {why}" if why else "closed")

    def _alarm(self, alarm: Bool) -> None:
        self.state.note_alarm(bool(alarm.data), time.monotonic())
        self.look()

    def _alerts(self, array: DiagnosticArray) -> None:
        try:
            alert = heard_alert(alerts_of(array))
        except InputError as refusal:
            self.state.note_lost(f"an alert cannot be read: {refusal}")
        else:
            if alert is None:
                self.state.note_lost("an alert has no stamp, valid_until or sequence")
            else:
                self.state.note_alert(alert, time.monotonic())
        self.look()

    def _deadline_missed(self, info: Any) -> None:
        self.state.note_lost("the simulator has missed its deadline")
        self.look()

    def _liveliness_changed(self, topic: str, info: Any) -> None:
        self._alive[topic] = info.alive_count
        if info.alive_count == 0 and info.not_alive_count_change > 0:
            self.state.note_lost("the simulator has ended or does not respond")
            self.look()

    def destroy_node(self) -> None:
        """Open all contacts, which every reader must treat as an alarm, then destroy the node."""
        for contact in self.contacts:
            contact.close()
        self.contacts = []
        self.health.closed = True
        super().destroy_node()


def _contacts(parameters: AlarmBridgeParameters) -> list[FileContact | TcpContact]:
    """Return the contacts that the parameters name, in the open state.

    Raises InputError if no contact is named, or if a contact is in use.
    """
    made: list[FileContact | TcpContact] = []
    try:
        if parameters.contact_file:
            made.append(FileContact(Path(parameters.contact_file)))
        if parameters.contact_port:
            made.append(TcpContact(parameters.contact_port))
    except FileNotFoundError as error:
        raise InputError(f"the contact cannot be set up: make the folder of contact_file first ({error})") from error
    except OSError as error:
        raise InputError(f"the contact cannot be set up: {error}") from error
    if not made:
        raise InputError("no contact is configured: set contact_file or contact_port")
    return made
