"""A second pit of a soak test, in another namespace of the same ROS domain: nothing of the first pit may reach it."""

import time
from typing import Self

from diagnostic_msgs.msg import DiagnosticArray
from live_messages import poses
from live_stack import Stack
from rclpy.serialization import deserialize_message, serialize_message
from soak_ledger import Ledger
from soak_mine import RADAR, SIMULATION, SIMULATOR
from soak_world import World, places_of

from rpf3d_core.alerts.levels import Level
from rpf3d_ros.demo.stand_in import StandIn
from rpf3d_ros.interface.simulated_clock import SimulatedClock
from rpf3d_ros.messages.alert_reading import ALERT
from rpf3d_ros.messages.health import healths_of

PIT = "/pit_b"
"""Namespace of the second pit."""
PROCESS = "neighbour"
"""Name of the process of its simulator."""
STARTED = 120.0
"""Longest time (s) until this simulator subscribes to its topics."""
HARMLESS = "catch bench"
"""Place from which the rocks of the second pit fall; its level is normal."""


class Neighbour:
    """The second pit: its simulator, and its radar, which sees harmless sources only; a context manager.

    Its level is normal, or a fault for a short time after a jump of the clock. Every higher level is a failure.

    level : the level of the last alert, None before the first one
    """

    def __init__(self, stack: Stack, clock: SimulatedClock, world: World, ledger: Ledger) -> None:
        """Start the simulator, and publish the terrain as soon as the clock of the simulator runs.

        A terrain that arrives before this has no time, and is a fault until it is published again.

        ledger : receives counts and failures. Raises TimeoutError if the simulator does not subscribe or decide.
        """
        if world.demands[HARMLESS] != Level.NORMAL:
            raise ValueError(f"rocks from {HARMLESS} are not harmless: {world.demands[HARMLESS].word}")
        self._clock, self._ledger, self._spoken = clock, ledger, 0.0
        self._places = places_of(HARMLESS, world.heights)
        self.level: Level | None = None
        self._stack = stack
        own = {"use_sim_time": True, "decision_log": stack.folder / PROCESS / "decisions"}
        stack.start(SIMULATOR, {**SIMULATION, **own}, PIT, PROCESS)
        self._stand_in = StandIn(("terrain/mesh", "sources"), "rpf3d_soak_neighbour", PIT)
        self._stand_in.subscribe("alerts", self._note_alert)
        if not self._stand_in.wait_for_subscribers(STARTED, alive=lambda: stack.alive(PROCESS)):
            raise TimeoutError(f"the simulator of the neighbour does not listen\n{stack.tails()}")
        if not self._stand_in.wait(lambda: self.level is not None, STARTED):  # an alert shows that the clock runs
            raise TimeoutError(f"the simulator of the neighbour makes no decision\n{stack.tails()}")
        self._stand_in.publish("terrain/mesh", world.content.mesh)

    def live(self, now: float) -> None:
        """Receive the alerts that have arrived, and publish the sources if it is time; now : s, monotonic."""
        if now - self._spoken >= RADAR:
            self._spoken = now
            self._stand_in.publish("sources", bytes(serialize_message(poses(self._places, self._clock.now_ns()))))
        self._stand_in.spin_once(0.0)

    def settled(self, seconds: float) -> bool:
        """Let time pass until the level is normal, or for some seconds; return True if it is normal."""
        until = time.monotonic() + seconds
        while self.level != Level.NORMAL and time.monotonic() < until:
            self.live(time.monotonic())
        return self.level == Level.NORMAL

    def end(self, seconds: float) -> None:
        """End the simulator; record a failure if the level does not become normal within some seconds before."""
        if not self.settled(seconds):
            self._ledger.fail(f"the neighbour ends with {self.level}, not with normal", self._stack.tails())
        if code := self._stack.end(PROCESS):
            self._ledger.fail(f"the simulator of the neighbour ended with {code} after SIGINT", self._stack.tails())

    def _note_alert(self, data: bytes, at_ns: int) -> None:
        for health in healths_of(deserialize_message(data, DiagnosticArray)):
            if health.name == ALERT:
                self.level = Level[health.values["level"].upper()]
                self._ledger.counts[f"alerts of the neighbour: {self.level.word}"] += 1
                if self.level not in (Level.NORMAL, Level.FAULT):
                    self._ledger.fail(f"the neighbour shows {self.level.word}, but its rocks are harmless")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._stand_in.__exit__()
