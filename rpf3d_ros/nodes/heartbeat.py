"""Measure how long the node's executor was busy and could not handle messages: a timer measures its own delay."""

import time

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.messages.health import OK, WARN

BEAT = 0.01
"""Time (s) between two calls of the timer."""

LONGEST = 0.05
"""Longest time (s) that a callback should take; a longer delay is reported as a warning."""


class ExecutorHeartbeat:
    """A timer that measures how long the executor was busy, and reports the longest delay in /diagnostics.

    Each report has the longest delay of the last second.
    """

    def __init__(self, node: Node, health: HealthReport) -> None:
        self._health = health
        self._last = time.monotonic()
        self._reported_at = self._last
        self._gap = 0.0
        self.longest = 0.0
        node.create_timer(BEAT, self.beat, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def reset(self) -> None:
        """Ignore earlier delays, which were expected, for example because of compiling."""
        self._last = self._reported_at = time.monotonic()
        self._gap = self.longest = 0.0

    def beat(self) -> None:
        """Measure the delay of this call; the timer calls it."""
        now = time.monotonic()
        self._gap = max(self._gap, now - self._last - BEAT)
        self._last = now
        if now - self._reported_at >= 1.0:
            self._report(now)

    def _report(self, now: float) -> None:
        self.longest = max(self.longest, self._gap)
        level = WARN if self._gap > LONGEST else OK
        values = {"gap_ms": f"{1e3 * self._gap:.1f}", "longest_gap_ms": f"{1e3 * self.longest:.1f}"}
        sentence = "busy for longer than 50 ms" if level == WARN else "in time"
        self._health.set("executor", level, sentence, values)
        self._reported_at, self._gap = now, 0.0
