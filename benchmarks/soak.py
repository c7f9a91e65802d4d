"""A mine's day in the life of the nodes, with everything that goes wrong: rocks, new ground, kills, jumps of the clock.

    python benchmarks/soak.py [--minutes 20] [--seed 1] [--json soak.json] [--keep folder]

Prints a report in markdown. Exit code 1 where an alert was lost, the log of decisions does not audit, a late joiner
was told a wrong alarm, or a node ended by itself. Wall time: the load is printed.
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
from soak_mine import LISTENER, RECORDER, SIMULATOR, Mine, start
from soak_report import print_report
from soak_world import PLACES, World, places_of, world_of

from rpf3d_core.alerts.levels import Level
from rpf3d_ros.demo.stand_in import StandIn
from rpf3d_ros.interface.simulated_clock import SimulatedClock

WITHIN = 5.0
"""Seconds from a burst until its level is told, while the simulator runs and the clock goes on."""
FALLING, QUIET = (2.0, 8.0), (1.0, 3.0)
"""Seconds that rocks are seen after their level was told; that the wall is quiet before somebody acknowledges."""
ACKNOWLEDGED, EACH = 30.0, 3.0
"""Seconds that acknowledging may take, with all its reasons to be void; that each of its tries may."""
CALM = 60.0
"""Last seconds, in which nothing is disturbed."""
BEGINS_NS = 1_767_250_800_000_000_000
"""2026-01-01, 07:00 UTC."""


class Soak:
    """Bursts of sources one after the other, and what each demands."""

    def __init__(self, mine: Mine, world: World, disturbances: Disturbances) -> None:
        self._mine, self._world, self._disturbances = mine, world, disturbances
        self._random = disturbances.random

    def run(self, minutes: float) -> None:
        """Everything, until time is up."""
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
        """Rocks from somewhere: the level that they demand must come, as long as they are seen."""
        mine, place = self._mine, str(self._random.choice(list(PLACES)))
        level = self._world.demands[place]
        mine.ledger.counts[f"bursts from {place} ({level.word})"] += 1
        mine.seen, mine.open = places_of(place), mine.ledger.demand(f"{place}: {level.word}", level, WITHIN)
        if not mine.stack.alive(SIMULATOR) or mine.told.held is None:
            mine.ledger.disturb(mine.open, RECOVERY)
        mine.speak()
        mine.ledger.settle(mine.open, mine.told.held)
        self._await()
        mine.live(lambda: False, float(self._random.uniform(*FALLING)))
        self._await()  # again, where the node was killed meanwhile
        mine.seen, mine.open = np.empty((0, 3)), None
        mine.speak()
        mine.live(lambda: False, float(self._random.uniform(*QUIET)))

    def _await(self) -> None:
        """Wait until what is demanded has been told, or its time is up."""
        mine = self._mine
        while (demand := mine.open) and demand.met is None and time.monotonic() < demand.until:
            mine.live(lambda: demand.met is not None or mine.open is not demand, 0.2)
        if demand is not None and demand.met is None:
            mine.ledger.fail(f"lost alert: {demand.what}, held is {mine.told.held}", mine.stack.tails())

    def step_down(self) -> None:
        """Acknowledge until the level is normal again."""
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
    """Whether every decision of a log is reproduced, and what the audit says in its last lines."""
    done = subprocess.run(
        [sys.executable, "-m", "rpf3d_core.cli", "audit", str(log)], capture_output=True, text=True, check=False
    )
    return done.returncode == 0, "; ".join((done.stdout + done.stderr).strip().splitlines()[-2:])


def soaked(stack: Stack, world: World, options: argparse.Namespace) -> Mine:
    """Run the soak; the mine with its ledger. Raises TimeoutError where the nodes do not start."""
    spoken = ("terrain/mesh", "terrain/update", "sources")
    with StandIn(spoken) as stand_in, SimulatedClock(stand_in.node, BEGINS_NS) as clock:
        nodes = (SIMULATOR, RECORDER, LISTENER)
        for node in nodes:
            start(stack, node)
        mine = Mine(stack, stand_in, clock)
        if not stand_in.wait_for_listeners(2.0 * RECOVERY, len(nodes), lambda: stack.alive(SIMULATOR)):
            raise TimeoutError(f"the nodes do not listen\n{stack.tails()}")
        Soak(mine, world, Disturbances(mine, world, options.seed)).run(options.minutes)
        for node in (SIMULATOR, RECORDER):
            if code := stack.end(node):
                mine.ledger.fail(f"{node} ended with {code} after SIGINT", stack.tails())
    return mine


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
        mine = soaked(stack, world, options)
        sound, said = audited(stack.folder / "decisions")
    return print_report(mine.ledger, began, options, world.demands, sound, said)


if __name__ == "__main__":
    sys.exit(main())
