"""A clock for nodes with `use_sim_time`: as fast as asked, and able to jump."""

import threading
import time
from typing import Self

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from rpf3d_ros.messages.stamps import SECOND, stamp_of

TICKS = 100.0
"""Messages on /clock a second of the machine's time."""


class SimulatedClock:
    """A context manager that publishes /clock on a thread of its own."""

    def __init__(self, node: Node, begin_ns: int, speed: float = 1.0) -> None:
        """begin_ns : time that it starts at; speed : seconds of it in a second of the machine's."""
        self._publisher = node.create_publisher(Clock, "/clock", 10)
        self._lock = threading.Lock()
        self._base_ns, self._since, self._speed = begin_ns, time.monotonic_ns(), speed
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulated clock", daemon=True)

    def now_ns(self) -> int:
        """The time (ns)."""
        with self._lock:
            return self._now_ns()

    def now(self) -> Time:
        """The time as a stamp."""
        return stamp_of(self.now_ns())

    def jump(self, seconds: float) -> None:
        """Go forward, or back where seconds < 0, at once."""
        with self._lock:
            self._base_ns += round(seconds * SECOND)

    def skip_to(self, ns: int) -> None:
        """Go on at a later time (ns); nothing where it is that late already."""
        with self._lock:
            self._base_ns += max(ns - self._now_ns(), 0)

    def run_at(self, speed: float) -> None:
        """Go on at another speed; 0 stands still."""
        with self._lock:
            self._base_ns, self._since = self._now_ns(), time.monotonic_ns()
            self._speed = speed

    def tell(self) -> None:
        """Publish the time at once, before what has its stamp: at a high rate the last tick is long ago."""
        with self._lock:  # so that no time overtakes a later one
            self._publisher.publish(Clock(clock=stamp_of(self._now_ns())))

    def _now_ns(self) -> int:
        return self._base_ns + round((time.monotonic_ns() - self._since) * self._speed)

    def _run(self) -> None:
        while not self._ended.wait(1.0 / TICKS):
            self.tell()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        self._thread.join()
