"""Simulate the mine of a soak test: publish the sources of two radars, receive the nodes' messages, let time pass."""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from live_messages import poses, stamp_of
from live_stack import Stack
from rclpy.serialization import deserialize_message, serialize_message
from soak_ledger import Demand, Ledger
from soak_world import SCENE, SITE, SPEED, SPREAD_V, SPREAD_X
from std_msgs.msg import Bool

from rpf3d_core.alerts.levels import Level
from rpf3d_ros.demo.stand_in import StandIn
from rpf3d_ros.interface.publishing import publishers_of
from rpf3d_ros.interface.recorded_topics import TOPICS
from rpf3d_ros.interface.simulated_clock import SimulatedClock
from rpf3d_ros.messages.alert_reading import ALERT
from rpf3d_ros.messages.health import healths_of

PIT = "/pit_a"
"""Namespace of the nodes that the test disturbs."""
RADARS = ("sources", "radar_b/sources")
"""Topics of the two radars. Each burst is seen by one of them, while the other reports that it sees nothing."""
RADAR, SAMPLING, SAYING = 2.0, 1.0, 60.0
"""Times (s): between two messages of a radar, between samples of memory, between progress reports."""
REMEMBERED = 100
"""Number of the last radar messages for which delays of answers are measured."""
SIMULATOR, RECORDER, LISTENER = "simulator_node", "recorder_node", "soak_listener"
SOURCES = {"use_sim_time": True, "source_topics": f"[{', '.join(RADARS)}]"}
"""Parameters of simulator and recorder: the topics of both radars."""
SIMULATION = {
    "scene": SCENE, "site_file": SITE, "above_ground": 0.5, "release_speed": SPEED, "position_spread": SPREAD_X,
    "velocity_spread": SPREAD_V,
}  # fmt: skip
"""Parameters of the simulators of both pits."""


@dataclass
class Told:
    """The last alert that the simulator has published: levels and alarm.

    held, shown : held level, and level of the alert; None if unknown
    alarm : True if the alarm sounds, None if unknown; alarm_since : time of its last change (s, monotonic)
    """

    held: Level | None = None
    shown: Level | None = None
    alarm: bool | None = None
    alarm_since: float = 0.0


class Mine:
    """Publishes in place of both radars, receives the messages of the nodes, and records the course of the test.

    open : the demand that must be met now, None without a demand
    reached : True as soon as the level of the present burst was shown; from then on, a lower level is a false green
    seen : (S, 3) m, sources that one radar sees; seen_by : topic of this radar
    neighbour : called regularly with the time (s, monotonic), for the second pit
    disturb : called regularly with the time (s, monotonic), to disturb the test
    """

    def __init__(self, stack: Stack, stand_in: StandIn, clock: SimulatedClock) -> None:
        self.stack, self.stand_in, self.clock = stack, stand_in, clock
        self.ledger, self.told = Ledger(), Told()
        self.open: Demand | None = None
        self.reached = False
        self.seen, self.seen_by = np.empty((0, 3)), RADARS[0]
        self.disturb: Callable[[float], None] = lambda now: None
        self.neighbour: Callable[[float], None] = lambda now: None
        self._radars = publishers_of(stand_in.node, RADARS, dict.fromkeys(RADARS, TOPICS["sources"]))
        self._spoken, self._sampled, self._said = 0.0, 0.0, time.monotonic()
        self._waiting: dict[int, tuple[int, set[str]]] = {}
        stand_in.subscribe("alerts", self._note_alert)
        stand_in.subscribe("alarm", self._note_alarm)
        stand_in.subscribe("results", self._note_result)
        stand_in.subscribe("hazard/grid", lambda data, at: self._delay("sources to hazard/grid", data, at))

    def live(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Run the test until a condition is true or time (s) is up; return True if the condition is true.

        Meanwhile the radars publish, messages are received, memory is sampled, and the test is disturbed.
        """
        deadline = time.monotonic() + seconds
        while not condition():
            now = time.monotonic()
            if now >= deadline:
                return False
            if now - self._spoken >= RADAR:
                self.speak()
            if now - self._sampled >= SAMPLING:
                self._sample(now)
            self.disturb(now)
            self.neighbour(now)
            self.stand_in.spin_once()
        return True

    def speak(self) -> None:
        """Publish a message of each radar: one has the sources that it sees now, the other has none."""
        self._spoken, now = time.monotonic(), self.clock.now_ns()
        self._waiting = dict(list(self._waiting.items())[-REMEMBERED:])
        for stamp, topic in enumerate(RADARS, start=now):  # different stamps, so that answers can be distinguished
            seen = self.seen if topic == self.seen_by else np.empty((0, 3))
            self._waiting[stamp] = (time.monotonic_ns(), set())
            self._radars[topic].publish(bytes(serialize_message(poses(seen, stamp))))

    def demand_again(self, within: float) -> None:
        """Demand the current alert level again within a time (s), because the simulator was killed.

        A demand that is not met yet gets more time. For a demand that was met, a new one with the same level is added.
        """
        if self.open is not None and self.open.met is None:
            self.ledger.disturb(self.open, within)
        elif self.open is not None:
            self.open = self.ledger.demand(f"{self.open.what}, again after a kill", self.open.level, within)
            self.open.disturbed = 1

    def jump(self, seconds: float) -> None:
        """Let the simulated clock jump by some seconds; answers to earlier messages are no longer expected."""
        self.clock.jump(seconds)
        self._waiting.clear()

    def _note_alert(self, data: bytes, at_ns: int) -> None:
        for health in healths_of(deserialize_message(data, DiagnosticArray)):
            if health.name == ALERT:
                self.told.held = Level[health.values["held"].upper()]
                self.told.shown = Level[health.values["level"].upper()]
                self.ledger.counts[f"alerts told: {health.values['level']}"] += 1
        if self.open is not None:
            self._check_level(self.open)

    def _check_level(self, demand: Demand) -> None:
        """Note whether the held level meets the present demand; record a failure if the shown level is a false green.

        After a kill or a jump of the clock, the level may be a fault until the node knows the sources again, but not a
        level below the demand: the decision log keeps the held level.
        """
        if self.reached and self.told.shown is not None:
            self.ledger.counts["alerts checked after the level of their burst was shown"] += 1
            if self.told.shown < demand.level:
                shown = self.told.shown.word
                self.ledger.fail(f"green by mistake: {demand.what}, shown is {shown}", self.stack.tails())
        self.reached = self.ledger.settle(demand, self.told.held) or self.reached

    def _note_alarm(self, data: bytes, at_ns: int) -> None:
        alarm = bool(deserialize_message(data, Bool).data)
        if alarm != self.told.alarm:
            self.told.alarm, self.told.alarm_since = alarm, time.monotonic()

    def _note_result(self, data: bytes, at_ns: int) -> None:
        self.ledger.counts["results"] += 1
        self._delay("sources to all of an answer", data, at_ns)

    def _delay(self, what: str, data: bytes, at_ns: int) -> None:
        """Record the delay from the publication of sources to the first message of a kind that answers the sources.

        what : name of the delay, one for each kind; data : CDR bytes of the message
        at_ns : time of its arrival (ns, monotonic)
        """
        began, came = self._waiting.get(stamp_of(data), (0, {what}))
        if what not in came:
            came.add(what)
            self.ledger.delays[what].append((at_ns - began) / 1e9)

    def _sample(self, now: float) -> None:
        self._sampled = now
        for name in (SIMULATOR, RECORDER):
            if self.stack.alive(name):
                size = self.stack.memory(name)[0]
                self.ledger.memory.append((name, self.stack.began[name], now - self.ledger.began, size))
        for name, process in self.stack.processes.items():
            if process.poll() is not None and name not in self.stack.killed:
                self.ledger.fail(f"{name} ended by itself with {process.returncode}", self.stack.tails())
                self.stack.killed.add(name)
        if now - self._said >= SAYING:
            self._said = now
            print(f"{(now - self.ledger.began) / 60:.0f} min: {self.ledger.summary}", file=sys.stderr, flush=True)


def start(stack: Stack, name: str) -> None:
    """Start a process of the soak test, for the first time or after a kill; name : SIMULATOR, RECORDER or LISTENER."""
    stack.killed.discard(name)
    if name == LISTENER:
        stack.start_script(Path(__file__).parent / f"{LISTENER}.py", PIT)
    elif name == RECORDER:
        number = stack.began.get(name, 0)
        stack.start(name, {**SOURCES, "file": stack.folder / f"soak_{number}.rrd"}, PIT)
    else:
        kept = {"decision_log": stack.folder / "decisions", "store": stack.folder / "store"}
        stack.start(name, {**SOURCES, **SIMULATION, **kept}, PIT)
