"""A simulated clock for nodes with `use_sim_time`: it can run at any speed, and jump."""

import threading
import time
from typing import Self

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from rpf3d_ros.messages.stamps import SECOND, stamp_of

TICKS = 100.0
"""Messages on /clock per second of wall-clock time."""


class SimulatedClock:
    """Publishes the simulated time on /clock from a separate thread; a context manager."""

    def __init__(self, node: Node, begin_ns: int, speed: float = 1.0) -> None:
        """Set the clock, which runs from now on; inside the `with` statement, its time is published regularly.

        begin_ns : current time of the clock (ns)
        speed : seconds of the clock per second of wall-clock time
        """
        self._publisher = node.create_publisher(Clock, "/clock", 10)
        self._lock = threading.Lock()
        self._base_ns, self._since, self._speed = begin_ns, time.monotonic_ns(), speed
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulated clock", daemon=True)

    def now_ns(self) -> int:
        """Return the current simulated time (ns)."""
        with self._lock:
            return self._now_ns()

    def now(self) -> Time:
        """Return the current simulated time as a stamp."""
        return stamp_of(self.now_ns())

    def jump(self, seconds: float) -> None:
        """Set the clock forward by `seconds`, or back if `seconds` is negative."""
        with self._lock:
            self._base_ns += round(seconds * SECOND)

    def skip_to(self, ns: int) -> None:
        """Set the clock forward to a time (ns); do nothing if the clock is already later."""
        with self._lock:
            self._base_ns += max(ns - self._now_ns(), 0)

    def run_at(self, speed: float) -> None:
        """Set the speed of the clock (seconds of the clock per second of wall-clock time); 0 stops the clock."""
        with self._lock:
            self._base_ns, self._since = self._now_ns(), time.monotonic_ns()
            self._speed = speed

    def publish(self) -> None:
        """Publish the simulated time now; call this before you publish a message with this time as its stamp."""
        with self._lock:  # publishes the times in order
            self._publisher.publish(Clock(clock=stamp_of(self._now_ns())))

    def _now_ns(self) -> int:
        return self._base_ns + round((time.monotonic_ns() - self._since) * self._speed)

    def _run(self) -> None:
        while not self._ended.wait(1.0 / TICKS):
            self.publish()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        self._thread.join()
