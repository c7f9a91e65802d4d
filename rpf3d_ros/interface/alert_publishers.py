"""Publish alerts: `alerts` has levels and reasons, the latched `alarm` is for bridges to a PLC."""

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.lifecycle import LifecycleNode
from std_msgs.msg import Bool, Header

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Alert
from rpf3d_ros.interface.publishing import publish
from rpf3d_ros.interface.qos import LATCHED, OVERRIDABLE
from rpf3d_ros.messages.alert_messages import alarm_message, alerts_message
from rpf3d_ros.messages.stamps import stamp_of


class AlertPublishers:
    """Publishers of `alerts` and `alarm`, which publish only while the node is active."""

    def __init__(self, node: LifecycleNode) -> None:
        self._node = node
        options = {"qos_overriding_options": OVERRIDABLE}
        self._alerts = node.create_lifecycle_publisher(DiagnosticArray, "alerts", LATCHED, **options)
        self._alarm = node.create_lifecycle_publisher(Bool, "alarm", LATCHED, **options)
        self.closed = False

    def publish(self, alert: Alert, evidence: Evidence | None, frame: str) -> bool:
        """Publish the alert of a decision: `alarm` and `alerts`.

        The message has the stamp of the decision's sources, or the time of the decision if there is no answer.

        Returns False if the node is not active and nothing was published.
        """
        if self.closed or not self._alerts.is_activated:
            return False
        stamp = alert.at_ns if evidence is None else evidence.trigger_stamp_ns
        header = Header(frame_id=frame, stamp=stamp_of(stamp))
        publish(self._node, self._alarm, alarm_message(alert))
        message = alerts_message(header, alert, None if evidence is None else evidence.result)
        publish(self._node, self._alerts, message)
        return True

    def sound_alarm(self) -> None:
        """Publish that the alarm sounds although no decision can be made."""
        if not self.closed and self._alarm.is_activated:
            publish(self._node, self._alarm, Bool(data=True))
