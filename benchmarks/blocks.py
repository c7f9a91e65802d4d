"""Measure how many rocks with a shape fly per second: on profile P1 of Authume, and down one bench of 15 m.

    python benchmarks/blocks.py [rocks]

Only final states are recorded. The figures are medians of passes, without compile time: CPU seconds of this process for
one thread, and wall time for the gain of two threads. P1 is left out if the Authume data is not there.
"""

import os
import platform
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.errors import InputError
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import Prepared, prepare, releases_in_ranges

SCENES = Path(__file__).parents[1] / "config" / "scenes"
PASSES = 5
SHORT = 4
"""Number of short falls for each fall on P1, with which passes of both take about the same time."""


@dataclass
class Case:
    """Rocks with a shape over the terrain of a scene, and the times of their passes.

    seconds : number of threads -> CPU and wall time (s) of each pass
    """

    prepared: Prepared
    releases: Releases
    seconds: dict[int, list[tuple[float, float]]] = field(default_factory=lambda: {1: [], 2: []})

    def fly(self, threads: int) -> Deposits:
        """Fly all rocks once with a number of threads, store the times, and return the deposits."""
        began, cpu = time.perf_counter(), time.process_time()
        flights = fly_ensemble(
            self.prepared.engine, self.prepared.flight, self.releases, record=False, threads=threads
        )
        self.seconds[threads].append((time.process_time() - cpu, time.perf_counter() - began))
        return flights.deposits

    def per_second(self) -> float:
        """Return the number of rocks per CPU second on one thread."""
        return len(self.releases.x) / float(np.median([cpu for cpu, _ in self.seconds[1]]))

    def gain(self) -> float:
        """Return the wall time of a pass on one thread, divided by the wall time on two threads."""
        one, two = (np.median([wall for _, wall in self.seconds[threads]]) for threads in (1, 2))
        return float(one / two)


def case_of(name: str, rocks: int) -> Case:
    """Return the case of a scene of config/scenes with a number of rocks, after its loops have been compiled.

    name : name of the scene file, without its extension
    """
    prepared = prepare(read_scene(SCENES / f"{name}.yaml"))
    ranges = [range(rocks)] + [range(0)] * (len(prepared.sources) - 1)
    case = Case(prepared, releases_in_ranges(prepared, ranges))
    fly_ensemble(prepared.engine, prepared.flight, releases_in_ranges(prepared, [range(2), *ranges[1:]]), record=False)
    return case


def main(rocks: int) -> None:
    """Measure, and print the table of speeds; rocks : number of falls on P1."""
    cases = {"short falls, one bench": case_of("bench_blocks", SHORT * rocks)}
    try:
        cases["Authume P1"] = case_of("authume_p1_blocks", rocks)
    except InputError as fault:
        print(f"Authume P1 is left out: {fault}")
    ends: dict[str, Deposits] = {}
    for threads in (1, 2) * PASSES:
        ends |= {name: case.fly(threads) for name, case in cases.items()}
    print(f"{platform.node()}, {platform.machine()}, load {os.getloadavg()[0]:.1f}; per CPU second and core")
    print(f"{'':24} {'rocks/s':>8} {'impacts':>8} {'path, m':>8} {'time, s':>8} {'two threads':>12}")
    for name, case in cases.items():
        end = ends[name]
        means = f"{end.impacts.mean():8.1f} {end.path.mean():8.1f} {end.t.mean():8.1f}"
        print(f"{name:24} {case.per_second():8,.0f} {means} {case.gain():12.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
