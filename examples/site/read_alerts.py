"""A reader of the alerts of one pit, for docs/tutorial/first-site.md: prints each change of the level.

python examples/site/read_alerts.py [--ros-args -r __ns:=/pit_a]

The level is `fault` unless fresh, valid alerts of one simulator arrive, but a level `evacuate` stays. These are the
rules of docs/reference/topics.md for every program that acts on the level.
"""

import contextlib
import re
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile
from std_msgs.msg import Bool

ALERTS = QoSProfile(
    depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, deadline=Duration(seconds=2.5),
    liveliness=LivelinessPolicy.AUTOMATIC, liveliness_lease_duration=Duration(seconds=3.0),
)  # fmt: skip
OFFSET = 1.0  # s, allowed difference of the clocks of both machines
SETTLING = 3.0  # s for which `run` must be the same and `sequence` must rise


class Reader(Node):
    """Keeps the last alert of the site, and decides whether it still counts."""

    def __init__(self) -> None:
        super().__init__("read_alerts")
        self.site: dict[str, str] = {}
        self.alarm = True
        self.until = self.in_order_since = 0.0  # by the steady clock
        self.shown = ("", "")
        lost = SubscriptionEventCallbacks(deadline=self.note_lost, liveliness=self.note_lost)
        self.create_subscription(DiagnosticArray, "alerts", self.note_alert, ALERTS, event_callbacks=lost)
        self.create_subscription(Bool, "alarm", self.note_alarm, ALERTS, event_callbacks=lost)
        self.create_timer(0.2, self.show)

    def note_alarm(self, message: Bool) -> None:
        """Keep whether the alarm is on."""
        self.alarm = message.data

    def note_lost(self, _event: object) -> None:
        """Forget how long the last alert is valid: the simulator was killed, or it hangs."""
        self.until = 0.0

    def note_alert(self, message: DiagnosticArray) -> None:
        """Keep the alert of the site: the first status of the message."""
        site, now = {each.key: each.value for each in message.status[0].values}, time.monotonic()
        is_next = site["run"] == self.site.get("run") and int(site["sequence"]) > int(self.site["sequence"])
        self.in_order_since = self.in_order_since if is_next else now
        self.until = now + float(site["valid_until"]) - float(site["stamp"])
        self.site = site

    def level(self) -> tuple[str, str]:
        """Return the level on which people may act, and the reason."""
        wrong = self.why_unknown()
        if not wrong:
            reasons = (value for key, value in self.site.items() if key.startswith("reason."))
            return self.site["level"], "; ".join(reasons)
        return ("evacuate" if self.shown[0] == "evacuate" else "fault"), wrong

    def why_unknown(self) -> str:
        """Return why the last alert does not count; "" if it counts."""
        now, clock = time.monotonic(), time.time()
        nodes = [
            [f"{each.node_namespace}/{each.node_name}" for each in self.get_publishers_info_by_topic(topic)]
            for topic in (self.resolve_topic_name("alerts"), self.resolve_topic_name("alarm"))
        ]
        if len(nodes[0]) != 1 or nodes[0] != nodes[1]:  # two simulators may have the same name
            return f"alerts and alarm must each have one publisher, the same node, but have {nodes[0]} and {nodes[1]}"
        if now > self.until or clock > float(self.site["valid_until"]) + OFFSET:
            return "there is no valid alert"
        if clock < float(self.site["stamp"]) - OFFSET:
            return "the alert is from the future: check the clocks"
        if now < self.in_order_since + SETTLING:
            return "the simulator has just started, or two simulators publish alerts"
        return "the alarm is on without an alert" if self.alarm and self.site["alarm"] == "false" else ""

    def show(self) -> None:
        """Print the level and its reasons if the level has changed, or if a fault has other reasons."""
        shown = self.level()
        words, before = (re.sub(r"[\d.]+", "", reasons) for _, reasons in (shown, self.shown))
        if shown[0] != self.shown[0] or (shown[0] == "fault" and words != before):
            print(f"{time.strftime('%H:%M:%S')} {shown[0].upper()}: {shown[1]}", flush=True)
        self.shown = shown


if __name__ == "__main__":
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):  # Ctrl-C
        rclpy.spin(Reader())
