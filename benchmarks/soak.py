"""A mine's day in the life of the nodes, with everything that goes wrong: rocks, new ground, kills, jumps of the clock.

    python benchmarks/soak.py [--minutes 20] [--seed 1] [--json soak.json]

Prints a report in markdown. Exit code 1 where an alert was lost, the log of decisions does not audit, a late joiner
was told a wrong alarm, or a node ended by itself. Wall time: the load is printed.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from live_messages import poses, raise_mesh, stamp_of
from live_stack import Stack, machine
from rclpy.serialization import deserialize_message, serialize_message
from soak_ledger import Demand, Ledger
from soak_report import print_report
from soak_world import PATCHED, PLACES, SCENE, SITE, SPEED, SPREAD_V, SPREAD_X, World, places_of, world_of
from std_msgs.msg import Bool

from rpf3d_core.alerts.levels import Level
from rpf3d_ros.health import healths_of
from rpf3d_ros.qos import LATCHED
from rpf3d_ros.shift_content import patch_message
from rpf3d_ros.simulated_clock import SimulatedClock
from rpf3d_ros.stand_in import StandIn

WITHIN = 5.0
"""Seconds from a burst until its level is told, while the simulator runs and the clock goes on."""
RECOVERY = 60.0
"""Seconds that a simulator may take after a kill until it tells what the radar still says: imports, its cache, its
terrain from the store; on two busy cores."""
RELEARNING = 10.0
"""Seconds after a jump of the clock: the radar speaks every 2 s."""
ACKNOWLEDGED = 30.0
"""Seconds that acknowledging may take, with all its reasons to be void."""
RADAR, CHAOS, SAMPLING = 2.0, 6.0, 1.0
"""Seconds between messages of the radar, between disturbances (on average), between looks at memory."""
JOINING, SETTLED = 5.0, 1.0
"""Seconds until a late joiner must have the alarm; that the alarm must have been the same for it to be compared."""
CALM = 60.0
"""Last seconds, in which nothing is disturbed."""
SIMULATOR, RECORDER, LISTENER = "simulator_node", "recorder_node", "soak_listener"
BEGINS_NS = 1_767_250_800_000_000_000
CHOICES = {"patch": 6, "terrain": 2, "recorder": 2, "listener": 2, "late joiner": 3, "clock back": 1,
           "clock forward": 1, "simulator": 1, "simulator in an update": 1}  # fmt: skip
"""What goes wrong, and how often against each other."""


@dataclass
class Told:
    """What the node says now: the level held, the one evident, whether the alarm sounds, and since when (s)."""

    held: Level | None = None
    shown: Level | None = None
    alarm: bool | None = None
    alarm_since: float = 0.0


class Soak:
    """The stand-in, the nodes, and what was promised."""

    def __init__(self, stack: Stack, world: World, stand_in: StandIn, clock: SimulatedClock, seed: int) -> None:
        self.stack, self.world, self.stand_in, self.clock = stack, world, stand_in, clock
        self.random = np.random.default_rng(seed)
        self.ledger, self.told = Ledger(), Told()
        self.seen = np.empty((0, 3))
        self.spoken, self.spoken_at, self.sampled = 0.0, {}, 0.0  # type: ignore[var-annotated]
        self.due: list[tuple[float, Callable[[], None]]] = []
        self.next_chaos, self.calm_from = float("inf"), float("inf")
        self.open: Demand | None = None
        self.surveyed = 0
        for topic, note in (("alerts", self._note_alert), ("results", self._note_result), ("alarm", self._note_alarm),
                            ("hazard/grid", self._note_grid)):  # fmt: skip
            stand_in.hear(topic, note)

    # --- what is heard

    def _note_alert(self, data: bytes, at_ns: int) -> None:
        for health in healths_of(deserialize_message(data, DiagnosticArray)):
            if "held" in health.values:
                self.told.held = Level[health.values["held"].upper()]
                self.told.shown = Level[health.values["level"].upper()]
                self.ledger.counts[f"alerts told: {health.values['level']}"] += 1
        if self.open is not None:
            self.ledger.settle(self.open, self.told.held)

    def _note_alarm(self, data: bytes, at_ns: int) -> None:
        alarm = bool(deserialize_message(data, Bool).data)
        if alarm != self.told.alarm:
            self.told.alarm, self.told.alarm_since = alarm, time.monotonic()

    def _note_result(self, data: bytes, at_ns: int) -> None:
        self.ledger.counts["results"] += 1
        self._delay("sources to all of an answer", data, at_ns)

    def _note_grid(self, data: bytes, at_ns: int) -> None:
        self._delay("sources to hazard/grid", data, at_ns)

    def _delay(self, what: str, data: bytes, at_ns: int) -> None:
        """Time from publishing sources to the first message stamped as they are."""
        spoken = self.spoken_at.get(stamp_of(data))
        if spoken is not None and what not in spoken[1]:
            spoken[1].add(what)
            self.ledger.delays[what].append((at_ns - spoken[0]) / 1e9)

    # --- what goes on all the while

    def live(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Let the world go on until the condition holds or time is up; whether it holds."""
        deadline = time.monotonic() + seconds
        while not condition():
            now = time.monotonic()
            if now >= deadline:
                return False
            if now - self.spoken >= RADAR:
                self.speak()
            if now - self.sampled >= SAMPLING:
                self._sample(now)
            self._do_what_is_due(now)
            self.stand_in.spin_once()
        return True

    def rest(self, seconds: float) -> None:
        """Let the world go on for a time (s)."""
        self.live(lambda: False, seconds)

    def speak(self) -> None:
        """What the radar sees now."""
        self.spoken, stamp = time.monotonic(), self.clock.now_ns()
        data = bytes(serialize_message(poses(self.seen, stamp)))
        self.spoken_at = dict(list(self.spoken_at.items())[-50:])
        self.spoken_at[stamp] = (self.stand_in.publish("sources", data), set())

    def _sample(self, now: float) -> None:
        self.sampled = now
        for name in (SIMULATOR, RECORDER):
            if self.stack.alive(name):
                size = self.stack.memory(name)[0]
                self.ledger.memory.append((name, self.stack.began[name], now - self.ledger.began, size))
        for name, process in self.stack.processes.items():
            if process.poll() is not None and name not in self.stack.killed:
                self.ledger.fail(f"{name} ended by itself with {process.returncode}", self.stack.tails())
                self.stack.killed.add(name)

    def _do_what_is_due(self, now: float) -> None:
        for each in [each for each in self.due if each[0] <= now]:
            self.due.remove(each)
            each[1]()
        if now >= self.next_chaos and now < self.calm_from:
            self.next_chaos = now + float(self.random.exponential(CHAOS))
            weights = np.array(list(CHOICES.values()), dtype=float)
            self.disturb(str(self.random.choice(list(CHOICES), p=weights / weights.sum())))

    # --- what goes wrong

    def disturb(self, what: str) -> None:
        """Do one of CHOICES."""
        self.ledger.counts[what] += 1
        if what in ("patch", "terrain"):
            self.survey(whole=what == "terrain")
        elif what in ("recorder", "listener"):
            self._kill(RECORDER if what == "recorder" else LISTENER)
        elif what == "late joiner":
            self.join_late()
        elif what.startswith("clock"):
            seconds = float(self.random.uniform(2.0, 20.0))
            self.clock.jump(-seconds if what == "clock back" else seconds)
            self.spoken_at.clear()
            self.ledger.disturb(self.open, RELEARNING)
        else:
            if what == "simulator in an update":
                self.survey(whole=True)
                self.rest_without_disturbance(float(self.random.uniform(0.0, 0.3)))
            self._kill(SIMULATOR)

    def rest_without_disturbance(self, seconds: float) -> None:
        """Only listen for a time (s)."""
        self.stand_in.wait(lambda: False, seconds)

    def _kill(self, name: str) -> None:
        """By SIGKILL; it comes back in a moment."""
        if not self.stack.alive(name):
            return
        self.stack.kill(name)
        down = float(self.random.uniform(0.5, 2.0))
        if name == SIMULATOR:
            self.told = Told()
            self.ledger.disturb(self.open, down + RECOVERY)
        self.due.append((time.monotonic() + down, lambda: start(self.stack, name)))

    def survey(self, whole: bool) -> None:
        """New ground: the pit with one point a little higher, or a heap somewhere."""
        self.surveyed += 1
        if whole:
            self.stand_in.publish("terrain/mesh", raise_mesh(self.world.content.mesh, self.surveyed % 50))
        else:
            self.stand_in.publish("terrain/update", self.heap())

    def heap(self) -> Any:
        """A patch of 30 by 30 m with a heap on it, somewhere below the ramp."""
        (west, east), (south, north) = PATCHED
        corner = self.random.uniform((west, south), (east, north))
        grid = self.world.heights.grid(*corner.tolist(), 1.5, 21, 21)
        i, j = np.ogrid[:21, :21]
        grid[..., 2] += self.random.uniform(0.2, 2.0) * np.clip(1.0 - np.hypot(i - 10, j - 10) / 8.0, 0.0, None)
        return patch_message(grid, self.clock.now_ns())

    def join_late(self) -> None:
        """Somebody joins and must be told the alarm of the moment, if it stands."""
        if self.told.alarm is None or time.monotonic() - self.told.alarm_since < SETTLED:
            return
        expected, heard = self.told.alarm, []  # type: ignore[var-annotated]
        began = time.monotonic()
        with StandIn(name="rpf3d_late_joiner") as joiner:
            joiner.hear("alarm", lambda data, at: heard.append(bool(deserialize_message(data, Bool).data)), LATCHED)
            joiner.wait(lambda: heard, JOINING)
        self.ledger.counts["late joiners compared"] += 1
        if heard:
            self.ledger.delays["late joiner to alarm"].append(time.monotonic() - began)
        self.stand_in.wait(lambda: False, 0.1)  # what came to us meanwhile
        if self.told.alarm == expected and (not heard or heard[-1] != expected) and self.stack.alive(SIMULATOR):
            self.ledger.fail(f"a late joiner heard the alarm as {heard or 'nothing'}, but it was {expected}")

    # --- what is demanded

    def burst(self) -> None:
        """Rocks from somewhere: the level that they demand must come, and go when it is acknowledged."""
        place = str(self.random.choice(list(PLACES)))
        level = self.world.demands[place]
        self.ledger.counts[f"bursts from {place} ({level.word})"] += 1
        self.seen = places_of(place)
        self.open = self.ledger.demand(f"{place}: {level.word}", level, WITHIN)
        if not self.stack.alive(SIMULATOR) or self.told.held is None:
            self.ledger.disturb(self.open, RECOVERY)
        self.speak()
        self.ledger.settle(self.open, self.told.held)
        demand = self.open
        while demand.met is None and time.monotonic() < demand.until:
            self.live(lambda: demand.met is not None, 0.2)
        if demand.met is None:
            self.ledger.fail(f"lost alert: {demand.what}, held is {self.told.held}", self.stack.tails())
        self.rest(float(self.random.uniform(2.0, 8.0)))
        self.open = None
        self.seen = np.empty((0, 3))
        self.speak()
        self.rest(float(self.random.uniform(1.0, 3.0)))

    def step_down(self) -> None:
        """Acknowledge until the level is normal again."""
        deadline = time.monotonic() + ACKNOWLEDGED + (RECOVERY if not self.stack.alive(SIMULATOR) else 0.0)
        while self.told.held != Level.NORMAL and time.monotonic() < deadline:
            self.live(lambda: self.told.held is not None and self.told.shown != Level.FAULT, 5.0)
            if self.stack.alive(SIMULATOR) and self.told.held not in (None, Level.NORMAL):
                done, said = self.stand_in.acknowledge("soak: the wall is quiet", 3.0)
                self.ledger.counts["acknowledged" if done else f"acknowledgement void: {said[:60]}"] += 1
            self.live(lambda: self.told.held == Level.NORMAL, 1.0)
        if self.told.held not in (Level.NORMAL, None):
            self.ledger.counts["not stepped down in time"] += 1

    def run(self, minutes: float) -> None:
        """Everything, until time is up."""
        self.stand_in.publish("terrain/mesh", self.world.content.mesh)
        if not self.live(lambda: self.told.shown == Level.NORMAL, RECOVERY):
            self.ledger.fail("normal was never told of a quiet wall", self.stack.tails())
            return
        self.ledger.began, self.next_chaos = time.monotonic(), time.monotonic() + CHAOS
        end = self.ledger.began + 60.0 * minutes
        self.calm_from = end - min(CALM, 12.0 * minutes)
        while time.monotonic() < end:
            self.burst()
            self.step_down()


def start(stack: Stack, name: str) -> None:
    """Start one of the processes, again or for the first time."""
    stack.killed.discard(name)
    if name == LISTENER:
        stack.start_script(Path(__file__).parent / f"{LISTENER}.py")
    elif name == RECORDER:
        number = stack.began.get(name, 0)
        stack.start(name, {"use_sim_time": True, "file": stack.folder / f"soak_{number}.rrd"})
    else:
        stack.start(name, {
            "use_sim_time": True, "scene": SCENE, "site_file": SITE, "decision_log": stack.folder / "decisions",
            "store": stack.folder / "store", "above_ground": 0.5, "release_speed": SPEED,
            "position_spread": SPREAD_X, "velocity_spread": SPREAD_V,
        })  # fmt: skip


def audited(log: Path) -> tuple[bool, str]:
    """Whether every decision of a log is reproduced, and what the audit says in its last lines."""
    done = subprocess.run(
        [sys.executable, "-m", "rpf3d_core.cli", "audit", str(log)], capture_output=True, text=True, check=False
    )
    return done.returncode == 0, "; ".join((done.stdout + done.stderr).strip().splitlines()[-2:])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the soak and print its report; 1 where something was lost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=1, help="of what goes wrong and when")
    parser.add_argument("--json", type=Path, help="file for the report's figures")
    parser.add_argument("--keep", type=Path, help="folder for logs and recordings, kept")
    options = parser.parse_args(arguments)
    began = machine()
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="rpf3d_soak_") as name, Stack(options.keep) as stack:
        world = world_of(Path(name))
        spoken = ("terrain/mesh", "terrain/update", "sources")
        with StandIn(spoken) as stand_in, SimulatedClock(stand_in.node, BEGINS_NS) as clock:
            for node in (SIMULATOR, RECORDER, LISTENER):
                start(stack, node)
            soak = Soak(stack, world, stand_in, clock, options.seed)
            if not stand_in.wait_for_listeners(2 * RECOVERY, 3, lambda: stack.alive(SIMULATOR)):
                print(f"the nodes do not listen\n{stack.tails()}", file=sys.stderr)
                return 1
            soak.run(options.minutes)
            codes = {node: stack.end(node) for node in (SIMULATOR, RECORDER)}
        for node, code in codes.items():
            if code:
                soak.ledger.fail(f"{node} ended with {code} after SIGINT", stack.tails())
        sound, said = audited(stack.folder / "decisions")
        return print_report(soak.ledger, began, options, world.demands, sound, said)


if __name__ == "__main__":
    sys.exit(main())
