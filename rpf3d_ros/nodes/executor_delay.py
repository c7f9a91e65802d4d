"""Report for how long the node's executor was busy with callbacks and could not receive messages."""

import time

from rclpy.node import Node

from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.messages.health import OK, WARN
from rpf3d_ros.nodes.timed_executor import TimedExecutor

PERIOD = 1.0
"""Time (s) between two reports."""

LONGEST = 0.05
"""Longest time (s) that a callback should take; a longer time is reported as a warning."""


class ExecutorDelay:
    """Reports in /diagnostics, every PERIOD (s), how long the executor was busy at most since the last report.

    The reported time is the duration of the longest round of callbacks (`TimedExecutor`), or the delay of the report
    itself if that is longer, for example because another thread holds the interpreter's lock. With another executor,
    the reported time is the delay of the report alone.
    """

    def __init__(self, node: Node, health: HealthReport) -> None:
        """Start to measure; the node must call `report` every PERIOD (s)."""
        self._node, self._health = node, health
        self._last = time.monotonic()
        self.longest = 0.0

    def reset(self) -> None:
        """Ignore earlier delays, which were expected, for example because of compiling."""
        self._last, self.longest = time.monotonic(), 0.0
        self._busiest_round()

    def report(self) -> None:
        """Report for how long (ms) the executor was busy at most since the last report."""
        now = time.monotonic()
        gap = max(now - self._last - PERIOD, self._busiest_round())
        self._last, self.longest = now, max(self.longest, gap)
        level = WARN if gap > LONGEST else OK
        values = {"gap_ms": f"{1e3 * gap:.1f}", "longest_gap_ms": f"{1e3 * self.longest:.1f}"}
        self._health.set(
            "executor", level, "a callback took longer than 50 ms" if level == WARN else "callbacks run on time", values
        )

    def _busiest_round(self) -> float:
        executor = self._node.executor
        return executor.longest_round() if isinstance(executor, TimedExecutor) else 0.0
