"""Measure the cost of hazard maps, the gain of a second thread, and a run from the scene file to the last map.

    python benchmarks/ensemble.py [rocks]

The pit has 2.33 million triangles. All maps are made: a raster of 1 m, facets, zones. Speeds are metres of path per
CPU second of this process, without compile time. Each speed is the median of several passes; the passes of all cases
alternate. The run from the scene file is a separate process. A first run, which fills the caches, is not counted.

The gain of two threads is also measured for plain arithmetic and for memory reads. These are the largest gains that are
possible on this machine at present.
"""

import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from flight import BENCH, CONE, TRIANGLES, Case, ground_of
from numpy.typing import NDArray

from rpf3d_core.ensemble.batches import BatchControl, Keep, fly_batches
from rpf3d_core.ensemble.fly import flights_of
from rpf3d_core.hazard.areas import areas_of
from rpf3d_core.hazard.bins import FINE, PER_OCTAVE, Binning, scales_of
from rpf3d_core.hazard.raster import raster_over
from rpf3d_core.hazard.tallies import Tallies, tallies_over
from rpf3d_core.hazard.walks.ground import ground_over
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.results.mesh_writer import write_mesh
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain

PASSES = 5
LONG = 4
"""Number of short falls for each long fall.

There are more short falls, so that rocks reach each cell under them many times. Otherwise the time to allocate memory
for cells would dominate the figures.
"""
CELL = 1.0  # m, cell size of the hazard maps
LINE = 64
"""Size of a cache line (bytes)."""
BYTES_A_FACET = 96
"""Memory (bytes) for each facet in `Facets.geometry`, the largest array that flights read."""
MEMORY = 1e9  # bytes, limit for the bins of percentiles
SCENE = """
terrain: {files: [{path: pit.stl}]}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
rebound: constant
ground: none
sources:
  - {name: west, line: [[-606.7, -200, 0], [-606.7, 200, 0]], velocity: [2, 0, 0], above_ground: 0.5, rocks: 100000}
hazard: {cell: 1}
outputs: {pictures: %s, recording: %s}
"""


class Mapped:
    """One kind of fall, flown with and without hazard maps, and the times of its passes.

    cpu, wall : name of a kind of pass -> CPU and wall time (s) of each pass
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        terrain = ground_of(case.falls, TRIANGLES)
        facets = case.engine.facets
        self.ground = ground_over(facets, case.engine.locator, raster_over(terrain, CELL))
        drop = facets.high[2] - facets.low[2]
        coarse, fine = (scales_of(drop, 9.81, case.falls.speed, 1e3, 1e3, bins) for bins in (PER_OCTAVE, FINE))
        self.binning = Binning(coarse=coarse, fine=fine, limit=MEMORY)
        self.cpu: dict[str, list[float]] = {}
        self.wall: dict[str, list[float]] = {}

    def tallies(self) -> Tallies:
        """Return empty counts (tallies) for all hazard maps."""
        return tallies_over(self.ground, areas_of({}), 1, 9.81, self.binning, True)

    def fly(self, name: str, threads: int, maps: bool) -> None:
        """Fly all rocks once with a number of threads, and store the times under `name`; maps : True to make maps."""
        watch = self.tallies() if maps else None
        none = np.zeros(len(self.case.releases.x), dtype=bool)
        cpu, wall = time.process_time(), time.perf_counter()
        batch = fly_batches(
            self.case.engine, self.case.flight, self.case.releases, Keep(none, none, maps), watch, BatchControl(threads)
        )  # fmt: skip
        flights_of([batch], self.case.releases, self.case.engine.name)
        self.cpu.setdefault(name, []).append(time.process_time() - cpu)
        self.wall.setdefault(name, []).append(time.perf_counter() - wall)

    def report(self, name: str) -> None:
        """Print a line of the table: speed without and with maps, the ratio of the two, and the gain of two threads."""
        path = float(self.case.deposits.path.sum())
        bare, maps = (float(np.median(self.cpu[kind])) for kind in ("bare", "maps"))
        gained = [
            gains((self.wall[kind], self.cpu[kind]), (self.wall[f"{kind}, two"], self.cpu[f"{kind}, two"]))
            for kind in ("bare", "maps")
        ]
        print(f"{name:12} {path / bare / 1e6:12.2f} {path / maps / 1e6:12.2f} {maps / bare:8.1f} {'  '.join(gained)}")


@loop
def _shift(rounds: int, seed: int) -> int:
    """Do arithmetic that reads no memory, to time threads; return its result.

    The arithmetic is a random generator (Marsaglia 2003, J. Stat. Softw. 8(14)).
    """
    x = np.uint64(seed)
    for _ in range(rounds):
        x ^= x << np.uint64(13)
        x ^= x >> np.uint64(7)
        x ^= x << np.uint64(17)
    return x


@loop
def _follow_links(links: Any, rounds: int, begin: int) -> int:
    """Read memory at random places, to time threads that wait for memory; return the index after the last read.

    links : each element is the index of the next element to read; rounds : number of reads; begin : first index
    """
    at = begin
    for _ in range(rounds):
        at = links[at]
    return at


def chain(size: int) -> NDArray[np.int64]:
    """Return links for `_follow_links` that visit each cache line of a memory of `size` bytes once, in random order."""
    order = np.random.default_rng(1).permutation(size // LINE)
    links = np.zeros(len(order) * (LINE // 8), dtype=np.int64)
    links[order * (LINE // 8)] = np.roll(order, -1) * (LINE // 8)
    return links


class Control:
    """Work that threads can share without waiting for each other, to measure the largest possible gain of two threads.

    work : called with a number of rounds and the number of the thread, from 1; rounds : total number of rounds
    cpu, wall : number of threads -> CPU and wall time (s) of each pass
    """

    def __init__(self, work: Callable[[int, int], object], rounds: int) -> None:
        self.work, self.rounds = work, rounds
        self.cpu: dict[int, list[float]] = {1: [], 2: []}
        self.wall: dict[int, list[float]] = {1: [], 2: []}
        work(1, 1)

    def go(self, threads: int) -> None:
        """Do the whole work once with a number of threads, and store the times."""
        cpu, wall = time.process_time(), time.perf_counter()
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(lambda k: self.work(self.rounds // threads, k + 1), range(threads)))
        self.cpu[threads].append(time.process_time() - cpu)
        self.wall[threads].append(time.perf_counter() - wall)


def gains(one: Sequence[Sequence[float]], two: Sequence[Sequence[float]]) -> str:
    """Return as text the gain of two threads in wall time, and in brackets the gain on a machine without other load.

    The second gain follows from the CPU time: two threads that take no more CPU time than one thread halve the wall
    time. one, two : wall times and CPU times (s) of the passes with one thread, and with two threads
    """
    wall, cpu = (float(np.median(np.divide(a, b))) for a, b in zip(one, two, strict=True))
    return f"{wall:8.2f} ({2.0 * cpu:.2f})"


def end_to_end(folder: Path, more: bool) -> None:
    """Run a scene in separate processes; print wall time, CPU time, and the peak of memory of all runs so far.

    The wall time and its parts are those of the run with the median wall time; the CPU time is the median of all runs.

    more : True to write pictures and a recording as well
    """
    word = "true" if more else "false"
    (folder / "scene.yaml").write_text(SCENE % (word, word))
    run(folder, "1000")  # fills the caches of machine code and of Python's byte code
    walls, cpus, facts = [], [], []
    for _ in range(PASSES):
        before, began = children_cpu_s(), time.perf_counter()
        run(folder, "100000")
        walls.append(time.perf_counter() - began)
        cpus.append(children_cpu_s() - before)
        facts.append(json.loads((folder / "out" / "summary.json").read_text()))
    middle = int(np.argsort(walls)[PASSES // 2])
    spent = facts[middle]
    parts = ", ".join(f"{name} {spent[f'{name}_s']:.1f}" for name in ("read", "index", "compile", "fly", "write"))
    what = "everything" if more else "every map and table, no pictures, no recording"
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
    print(
        f"{what}: {walls[middle]:.1f} s wall ({min(walls):.1f} to {max(walls):.1f}; {parts}),"
        f" {np.median(cpus):.1f} CPU s, peak of memory so far {peak:.2f} GB"
    )


def children_cpu_s() -> float:
    """Return the CPU time (s) of all child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(folder: Path, rocks: str) -> None:
    """Run `rpf3d run` on the scene in a folder with a number of rocks; Python caches its byte code in the folder."""
    home = {
        "PYTHONPATH": str(Path(__file__).parents[1]), "PYTHONPYCACHEPREFIX": str(folder / "pycache"),
        "PYTHONDONTWRITEBYTECODE": "",
    }  # fmt: skip
    subprocess.run(
        [sys.executable, "-m", "rpf3d_core.cli", "run", "scene.yaml", "--out", "out", "--rocks", rocks], cwd=folder,
        check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=os.environ | home,
    )  # fmt: skip


def main(rocks: int) -> None:
    """Measure, and print all tables; rocks : number of short falls.

    Whole runs come first, because the peak of memory of a child process includes the memory of its parent.
    """
    with tempfile.TemporaryDirectory() as name:
        write_mesh(Path(name) / "pit.stl", pit_terrain(Pit(triangles=TRIANGLES)))
        print("100,000 rocks from the west wall, end to end:")
        end_to_end(Path(name), more=False)
        end_to_end(Path(name), more=True)
    short, long = (Mapped(Case(falls, TRIANGLES, n)) for falls, n in ((BENCH, rocks), (CONE, rocks // LONG)))
    short.tallies().precompile()
    links = chain(BYTES_A_FACET * TRIANGLES)
    half = len(links) // LINE * (LINE // 2)  # start of a cache line in the middle
    controls = {
        "arithmetic": Control(_shift, 100_000_000),  # type: ignore[arg-type]
        "reads": Control(lambda n, k: _follow_links(links, n, (k - 1) * half), 2_000_000),
    }
    for _ in range(PASSES):
        for control in controls.values():
            for threads in (1, 2):
                control.go(threads)
        for mapped in (short, long):
            for maps in (False, True):
                kind = "maps" if maps else "bare"
                mapped.fly(kind, 1, maps)
                mapped.fly(f"{kind}, two", 2, maps)
    print(f"{platform.node()}, {platform.machine()}, load {os.getloadavg()[0]:.1f}; million m of path per CPU second;")
    print("what two threads gain of wall time (in brackets: alone on the machine, by the CPU time that they take)")
    print(f"{'':12} {'final states':>12} {'every map':>12} {'times':>8} {'two threads':>12} {'with maps':>12}")
    short.report("short falls")
    long.report("long falls")
    for name, control in controls.items():
        print(f"{name:46} {gains(*((control.wall[n], control.cpu[n]) for n in (1, 2)))}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
