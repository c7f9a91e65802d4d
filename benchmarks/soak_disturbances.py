"""Disturb a soak test: publish new terrain, kill nodes, let the clock jump, and add late subscribers."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from live_messages import raise_mesh
from rclpy.serialization import deserialize_message
from soak_mine import LISTENER, PIT, RECORDER, SIMULATOR, Mine, Told, start
from soak_world import PATCHED, World
from std_msgs.msg import Bool

from rpf3d_ros.demo.shift_content import patch_message
from rpf3d_ros.demo.stand_in import StandIn
from rpf3d_ros.interface.qos import LATCHED

CHOICES = {"patch": 6, "terrain": 2, "recorder": 2, "listener": 2, "late joiner": 3, "clock back": 1,
           "clock forward": 1, "simulator": 1, "simulator in an update": 1}  # fmt: skip
"""Kind of disturbance -> relative frequency."""
KILLS = ("recorder", "simulator", "simulator in an update")
"""The disturbances that kill the recorder or the simulator.

The second half of a test has no such disturbance, so that the memory of these nodes can be measured over a long time.
"""
BETWEEN = 6.0
"""Mean time between disturbances (s)."""
RECOVERY = 60.0
"""Longest time (s) from a kill of the simulator until it publishes the alert level again.

The level is that of the radar's current message. In this time, the simulator imports its modules, loads compiled code,
and reads its terrain from the store, on two busy cores.
"""
RELEARNING = 10.0
"""Longest time (s) until alerts are right again after a jump of the clock; the radar publishes every 2 s."""
JOINING, SETTLED = 5.0, 1.0
"""Times (s): until a late subscriber must have the alarm, and for which the alarm must not change before the check."""
DOWN, UPDATING = (0.5, 2.0), (0.0, 0.3)
"""Ranges of times (s): from a kill to the restart of the process, and from new terrain to a kill of the simulator."""
JUMP = (2.0, 20.0)
"""Range of the length of a jump of the clock (s)."""
HEAP, RADIUS, SPACING = 21, 8.0, 1.5
"""A patch of terrain with a heap: number of points on each side, radius of the heap in points, spacing (m)."""


class Disturbances:
    """Disturbs a soak test at random, after `begin` is called and until the time `calm` (s, monotonic)."""

    def __init__(self, mine: Mine, world: World, seed: int) -> None:
        self._mine, self._world = mine, world
        self.random = np.random.default_rng(seed)
        self._due: list[tuple[float, Callable[[], None]]] = []
        self._next = self._unkilled = self.calm = float("inf")
        self._surveyed = 0
        mine.disturb = self._disturb

    def begin(self, unkilled: float, calm: float) -> None:
        """Begin to disturb the test.

        unkilled : time (s, monotonic) after which neither simulator nor recorder is killed
        calm : time (s, monotonic) after which there are no disturbances
        """
        self._next, self._unkilled, self.calm = time.monotonic() + BETWEEN, unkilled, calm

    def _disturb(self, now: float) -> None:
        for each in [each for each in self._due if each[0] <= now]:
            self._due.remove(each)
            each[1]()
        if self._next <= now < self.calm:
            self._next = now + float(self.random.exponential(BETWEEN))
            weights = np.array(list(CHOICES.values()), dtype=float)
            if now >= self._unkilled:
                weights[[name in KILLS for name in CHOICES]] = 0.0
            self.do(str(self.random.choice(list(CHOICES), p=weights / weights.sum())))

    def do(self, what: str) -> None:
        """Do one disturbance; what : a kind of CHOICES."""
        self._mine.ledger.counts[what] += 1
        if what in ("patch", "terrain"):
            self._survey(whole=what == "terrain")
        elif what in ("recorder", "listener"):
            self._kill(RECORDER if what == "recorder" else LISTENER)
        elif what == "late joiner":
            self._join_late()
        elif what in ("clock back", "clock forward"):
            self._mine.jump(float(self.random.uniform(*JUMP)) * (-1.0 if what == "clock back" else 1.0))
            self._mine.ledger.disturb(self._mine.open, RELEARNING)
        else:
            if what == "simulator in an update":
                self._survey(whole=True)
                self._mine.stand_in.wait(lambda: False, float(self.random.uniform(*UPDATING)))
            self._kill(SIMULATOR)

    def _kill(self, name: str) -> None:
        """Kill a process by SIGKILL, and start it again after a time from DOWN; do nothing if it does not run."""
        mine = self._mine
        if not mine.stack.alive(name):
            return
        mine.stack.kill(name)
        down = float(self.random.uniform(*DOWN))
        if name == SIMULATOR:
            mine.told = Told()
            mine.demand_again(down + RECOVERY)
        self._due.append((time.monotonic() + down, lambda: start(mine.stack, name)))

    def _survey(self, whole: bool) -> None:
        """Publish new terrain: the whole pit with one point a little higher, or a patch with a heap."""
        self._surveyed += 1
        if whole:
            self._mine.stand_in.publish("terrain/mesh", raise_mesh(self._world.content.mesh, self._surveyed % 50))
        else:
            self._mine.stand_in.publish("terrain/update", self._heap())

    def _heap(self) -> Any:
        """Return a patch message of 30 by 30 m with a heap, at a random place below the ramp."""
        (west, east), (south, north) = PATCHED
        corner = self.random.uniform((west, south), (east, north))
        grid = self._world.heights.grid(*corner.tolist(), SPACING, HEAP, HEAP)
        i, j = np.ogrid[:HEAP, :HEAP]
        distance = np.hypot(i - HEAP // 2, j - HEAP // 2)
        grid[..., 2] += self.random.uniform(0.2, 2.0) * np.clip(1.0 - distance / RADIUS, 0.0, None)
        return patch_message(grid, self._mine.clock.now_ns())

    def _join_late(self) -> None:
        """Add a late subscriber, and check that it receives the current alarm within JOINING seconds.

        There is no check if the alarm has just changed, or changes during the check.
        """
        mine, began = self._mine, time.monotonic()
        expected, heard = mine.told.alarm, []  # type: ignore[var-annotated]
        if expected is None or began - mine.told.alarm_since < SETTLED:
            return
        with StandIn(name="rpf3d_late_joiner", namespace=PIT) as joiner:
            note = heard.append
            joiner.subscribe("alarm", lambda data, at: note(bool(deserialize_message(data, Bool).data)), LATCHED)
            joiner.wait(lambda: heard, JOINING)
        mine.ledger.counts["late joiners compared"] += 1
        if heard:
            mine.ledger.delays["late joiner to alarm"].append(time.monotonic() - began)
        mine.stand_in.wait(lambda: False, 0.1)  # receives the messages that have arrived in the meantime
        if mine.told.alarm == expected and heard[-1:] != [expected] and mine.stack.alive(SIMULATOR):
            mine.ledger.fail(f"a late joiner heard the alarm as {heard or 'nothing'}, but it was {expected}")
