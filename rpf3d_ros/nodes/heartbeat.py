"""How long the executor was busy with something else: a timer that notes how late it comes."""

import time

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.messages.health import OK, WARN

BEAT = 0.01
"""Seconds between beats."""

LONGEST = 0.05
"""Seconds that no callback may take; a longer gap is told as a warning."""


class Heartbeat:
    """Beats on the executor and tells the longest time between two beats, beyond the beat itself, in /diagnostics.

    Each second tells the longest gap of that second, so a report can be made of all that were published.
    """

    def __init__(self, node: Node, health: HealthReport) -> None:
        self._health = health
        self._last = time.monotonic()
        self._told = self._last
        self._gap = 0.0
        self.longest = 0.0
        node.create_timer(BEAT, self.beat, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def reset(self) -> None:
        """Begin anew: what came before, such as compiling, was meant to take long."""
        self._last = self._told = time.monotonic()
        self._gap = self.longest = 0.0

    def beat(self) -> None:
        """Note how late this beat is."""
        now = time.monotonic()
        self._gap = max(self._gap, now - self._last - BEAT)
        self._last = now
        if now - self._told >= 1.0:
            self._tell(now)

    def _tell(self, now: float) -> None:
        self.longest = max(self.longest, self._gap)
        level = WARN if self._gap > LONGEST else OK
        values = {"gap_ms": f"{1e3 * self._gap:.1f}", "longest_gap_ms": f"{1e3 * self.longest:.1f}"}
        sentence = "busy for longer than 50 ms" if level == WARN else "in time"
        self._health.set("executor", level, sentence, values)
        self._told, self._gap = now, 0.0
