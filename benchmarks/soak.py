"""Soak test: run the nodes for a long time with rocks and disturbances, such as new terrain, kills and clock jumps.

    python benchmarks/soak.py [--minutes 20] [--seed 1] [--json soak.json] [--keep folder]

The program prints a report in Markdown. Its exit code is 1 if an alert is lost, if the audit of the decision log fails,
if a late subscriber receives a wrong alarm, if a level falls below the level of the present sources, if the second pit
shows a danger of the first, or if a node ends by itself. The delays are wall times, so the load is printed.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from live_stack import Stack, machine
from soak_disturbances import RECOVERY, Disturbances
from soak_mine import LISTENER, PIT, RADARS, RECORDER, SIMULATOR, Mine, start
from soak_neighbour import Neighbour
from soak_report import print_report
from soak_world import PLACES, World, places_of, world_of

from rpf3d_core.alerts.levels import Level
from rpf3d_ros.demo.stand_in import StandIn
from rpf3d_ros.interface.simulated_clock import SimulatedClock

WITHIN = 5.0
"""Goal: time (s) from sources to their alert level, while the simulator runs and the clock runs evenly."""
FALLING, QUIET = (2.0, 8.0), (1.0, 3.0)
"""Ranges of times (s): for which a burst stays visible after its level was published, and then without sources."""
ACKNOWLEDGED, EACH = 30.0, 3.0
"""Longest times (s): for all attempts to acknowledge until the level falls, and for one attempt."""
CALM = 60.0
"""Largest length (s) of the last part of the test, which has no disturbances; at most a fifth of the test."""
BEGINS_NS = 1_767_250_800_000_000_000
"""Start of the simulated clock: 2026-01-01, 07:00 UTC (ns)."""


class Soak:
    """Publishes one burst of sources after another, and checks that the alert reaches the level of each burst."""

    def __init__(self, mine: Mine, world: World, disturbances: Disturbances) -> None:
        self._mine, self._world, self._disturbances = mine, world, disturbances
        self._random = disturbances.random

    def run(self, minutes: float) -> None:
        """Publish bursts and acknowledge their alerts for a time (minutes)."""
        mine = self._mine
        mine.stand_in.publish("terrain/mesh", self._world.content.mesh)
        if not mine.live(lambda: mine.told.shown == Level.NORMAL, RECOVERY):
            mine.ledger.fail("normal was never told of a quiet wall", mine.stack.tails())
            return
        mine.ledger.began = time.monotonic()
        end = mine.ledger.began + 60.0 * minutes
        self._disturbances.begin(end - 30.0 * minutes, end - min(CALM, 12.0 * minutes))
        while time.monotonic() < end:
            self.burst()
            self.step_down()

    def burst(self) -> None:
        """Publish sources at a random place, and wait until the alert has their level; then publish no sources."""
        mine, place = self._mine, str(self._random.choice(list(PLACES)))
        level = self._world.demands[place]
        mine.ledger.counts[f"bursts from {place} ({level.word})"] += 1
        mine.seen, mine.seen_by = places_of(place, self._world.heights), str(self._random.choice(RADARS))
        mine.ledger.counts[f"bursts on {mine.seen_by}"] += 1
        mine.open, mine.reached = mine.ledger.demand(f"{place}: {level.word}", level, WITHIN), False
        if not mine.stack.alive(SIMULATOR) or mine.told.held is None:
            mine.ledger.disturb(mine.open, RECOVERY)
        mine.speak()
        mine.ledger.settle(mine.open, mine.told.held)
        self._await()
        mine.live(lambda: False, float(self._random.uniform(*FALLING)))
        self._await()  # a killed node must reach the alert level again
        mine.seen, mine.open = np.empty((0, 3)), None
        mine.speak()
        mine.live(lambda: False, float(self._random.uniform(*QUIET)))

    def _await(self) -> None:
        """Wait until the alert has the demanded level; record a failure if the level is not reached in time."""
        mine = self._mine
        while (demand := mine.open) and demand.met is None and time.monotonic() < demand.until:
            mine.live(lambda: demand.met is not None or mine.open is not demand, 0.2)
        if demand is not None and demand.met is None:
            mine.ledger.fail(f"lost alert: {demand.what}, held is {mine.told.held}", mine.stack.tails())

    def step_down(self) -> None:
        """Acknowledge the alert until its level is normal."""
        mine = self._mine
        deadline = time.monotonic() + ACKNOWLEDGED + (0.0 if mine.stack.alive(SIMULATOR) else RECOVERY)
        while mine.told.held != Level.NORMAL and time.monotonic() < deadline:
            mine.live(lambda: mine.told.held is not None and mine.told.shown != Level.FAULT, 5.0)
            if mine.stack.alive(SIMULATOR) and mine.told.held not in (None, Level.NORMAL):
                done, said = mine.stand_in.acknowledge("soak: the wall is quiet", EACH)
                mine.ledger.counts["acknowledged" if done else f"acknowledgement void: {said[:60]}"] += 1
            mine.live(lambda: mine.told.held == Level.NORMAL, 1.0)
        if mine.told.held not in (Level.NORMAL, None):
            mine.ledger.counts["not stepped down in time"] += 1


def audited(log: Path) -> tuple[bool, str]:
    """Return True if the audit of a decision log finds no error, else False; and the last lines of its output."""
    done = subprocess.run(
        [sys.executable, "-m", "rpf3d_core.cli", "audit", str(log)], capture_output=True, text=True, check=False
    )
    return done.returncode == 0, "; ".join((done.stdout + done.stderr).strip().splitlines()[-2:])


def soaked(stack: Stack, world: World, options: argparse.Namespace) -> Mine:
    """Start the nodes, run the soak test, end the nodes, and return the mine with the record of the test.

    Raises TimeoutError if the nodes do not start.
    """
    spoken = ("terrain/mesh", "terrain/update")
    with StandIn(spoken, namespace=PIT) as stand_in, SimulatedClock(stand_in.node, BEGINS_NS) as clock:
        nodes = (SIMULATOR, RECORDER, LISTENER)
        for node in nodes:
            start(stack, node)
        mine = Mine(stack, stand_in, clock)
        if not stand_in.wait_for_subscribers(2.0 * RECOVERY, len(nodes), lambda: stack.alive(SIMULATOR)):
            raise TimeoutError(f"the nodes do not listen\n{stack.tails()}")
        with Neighbour(stack, clock, world, mine.ledger) as neighbour:
            mine.neighbour = neighbour.live
            if not mine.live(lambda: neighbour.level == Level.NORMAL, 2.0 * RECOVERY):
                raise TimeoutError(f"the neighbour does not become normal\n{stack.tails()}")
            Soak(mine, world, Disturbances(mine, world, options.seed)).run(options.minutes)
            neighbour.end(RECOVERY)
        for node in (SIMULATOR, RECORDER):
            if code := stack.end(node):
                mine.ledger.fail(f"{node} ended with {code} after SIGINT", stack.tails())
    return mine


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the soak test and print its report; return 1 if it fails."""
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
        mine = soaked(stack, world, options)
        sound, said = audited(stack.folder / "decisions")
    return print_report(mine.ledger, began, options, world.demands, sound, said)


if __name__ == "__main__":
    sys.exit(main())
