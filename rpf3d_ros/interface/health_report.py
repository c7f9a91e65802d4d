"""Publish the states of a node's parts on /diagnostics: immediately after a change, and every second."""

import re
import threading
import time
from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from rpf3d_ros.interface.publishing import publish
from rpf3d_ros.interface.qos import EVENTS, OVERRIDABLE
from rpf3d_ros.messages.diagnostic_messages import diagnostics_of, of_unit
from rpf3d_ros.messages.health import ERROR, OK, Health

PERIOD = 1.0
"""Wall-clock time between repetitions (s), as diagnostic_aggregator expects (REP 107)."""

SPACING = 0.005
"""Shortest time (s) between publications after changes, so that a burst of changes does not flood /diagnostics."""

QUIET = 5.0
"""Time (s) that must pass without a report of a state before the node logs this state again.

States whose texts differ only in numbers count as the same state. /diagnostics contains every state.
"""

NUMBER = re.compile(r"\d+(\.\d+)?")
"""Pattern of the numbers in a warning, which are ignored when warnings are compared."""


class HealthReport:
    """The last state of each part of a node, published together on /diagnostics. Any thread may call."""

    def __init__(self, node: Node, timer: bool = True) -> None:
        """Create a report that has no states of parts yet.

        timer : False if the node itself calls `publish` every PERIOD (s), from a timer that it needs anyway
        """
        self._node = node
        self._parts: dict[str, Health] = {}
        self._logged: dict[tuple[str, str], float] = {}
        self._lock = threading.Lock()
        self._publisher = node.create_publisher(
            DiagnosticArray, "/diagnostics", EVENTS, qos_overriding_options=OVERRIDABLE
        )
        if timer:
            node.create_timer(PERIOD, self.publish, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._published = -SPACING
        self.closed = False

    def set(self, part: str, level: int, message: str, values: Mapping[str, str] | None = None) -> None:
        """Set the state of a part of the node, for example "terrain".

        A changed level or sentence is published immediately, or within PERIOD (s) if the last publication was less
        than SPACING (s) ago. The state is also written to the ROS log if it is not OK, and when it is OK again; a state
        that was reported in the last QUIET (s) is not logged again.

        level : OK, WARN, ERROR or STALE; message : a sentence; values : further figures, by name
        """
        if self.closed:
            return
        name = self._node.get_fully_qualified_name().lstrip("/")
        health = Health(name=f"{name}: {part}", level=level, message=message, values=values or {})
        with self._lock:
            before = self._parts.get(part)
            self._parts = {**self._parts, part: health}
            if level != OK or (before is not None and before.level != OK):
                self._log(part, level, message)
            if before is None or (before.level, before.message) != (level, message):
                self._publish_soon()

    def clear(self, *parts: str) -> None:
        """Remove the states of these parts of the node, so that they are no longer published."""
        with self._lock:
            self._parts = {part: health for part, health in self._parts.items() if part not in parts}

    def publish(self) -> None:
        """Publish the states of all parts, unless the report is closed."""
        with self._lock:
            self._publish()

    def _publish_soon(self) -> None:
        """Publish now; if the last publication was less than SPACING (s) ago, the timer publishes later."""
        if time.monotonic() - self._published >= SPACING:
            self._publish()

    def _publish(self) -> None:
        self._published = time.monotonic()
        if not self.closed:
            now = self._node.get_clock().now().to_msg()
            message = of_unit(diagnostics_of(now, self._parts.values()), self._node.get_namespace())
            publish(self._node, self._publisher, message)

    def _log(self, part: str, level: int, message: str) -> None:
        now = time.monotonic()
        self._logged = {key: at for key, at in self._logged.items() if now - at < QUIET}
        kind = part, NUMBER.sub("#", message)
        was_logged = kind in self._logged
        self._logged[kind] = now  # a sentence that stays true is logged again only after it was absent for QUIET
        if was_logged:
            return
        logger = self._node.get_logger().get_child(part)
        if level == OK:  # separate calls: in rclpy, one line of code cannot change its severity
            logger.info(message)
        elif level == ERROR:
            logger.error(message)
        else:
            logger.warning(message)
