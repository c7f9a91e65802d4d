"""What hazard maps cost while rocks fly, what a second thread gains, and a run from the scene file to the last map.

    python benchmarks/ensemble.py [rocks]

The pit of 2.33 million triangles; every map on: raster of 1 m, facets, zones. CPU seconds of this process, compile time
apart, medians of passes that take turns; the run is a process of its own.
"""

import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from flight import BENCH, CONE, TRIANGLES, Case, ground_of

from rpf3d_core.ensemble.batches import Keep, fly_batches
from rpf3d_core.ensemble.fly import flights_of
from rpf3d_core.hazard.areas import areas_of
from rpf3d_core.hazard.bins import FINE, PER_OCTAVE, scales_of
from rpf3d_core.hazard.ground import ground_over
from rpf3d_core.hazard.raster import raster_over
from rpf3d_core.hazard.tallies import Tallies, tallies_over
from rpf3d_core.io.mesh_writer import write_mesh
from rpf3d_core.terrain.pit import Pit, pit_terrain

PASSES = 5
LONG = 4
"""Short falls for each long one: the cells under them are then counted often enough that finding room for them is not
what is measured."""
CELL = 1.0  # m
MEMORY = 1e9  # bytes that bins may take
SCENE = """
terrain: {files: [{path: pit.stl}]}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
sources:
  - {name: west, line: [[-606.7, -200, 0], [-606.7, 200, 0]], velocity: [2, 0, 0], above_ground: 0.5, rocks: 100000}
hazard: {cell: 1}
outputs: {pictures: %s, recording: %s}
"""


class Mapped:
    """A case of `flight.py` that is flown with every map on as well; seconds of passes, CPU and wall."""

    def __init__(self, case: Case) -> None:
        self.case = case
        terrain = ground_of(case.falls, TRIANGLES)
        facets = case.engine.facets
        self.ground = ground_over(facets, case.engine.locator, raster_over(terrain, CELL))
        drop = facets.high[2] - facets.low[2]
        self.scales = [scales_of(drop, 9.81, case.falls.speed, 1e3, 1e3, bins) for bins in (PER_OCTAVE, FINE)]
        self.cpu: dict[str, list[float]] = {}
        self.wall: dict[str, list[float]] = {}

    def tallies(self) -> Tallies:
        """Nothing counted yet."""
        return tallies_over(self.ground, areas_of({}), 1, 9.81, *self.scales, MEMORY, True)

    def fly(self, name: str, threads: int, maps: bool) -> None:
        """Fly all rocks once more, by so many threads."""
        watch = self.tallies() if maps else None
        none = np.zeros(len(self.case.releases.x), dtype=bool)
        cpu, wall = time.process_time(), time.perf_counter()
        batch = fly_batches(
            self.case.engine, self.case.flight, self.case.releases, Keep(none, none, maps), watch, threads
        )  # fmt: skip
        flights_of([batch], self.case.releases, self.case.engine.name)
        self.cpu.setdefault(name, []).append(time.process_time() - cpu)
        self.wall.setdefault(name, []).append(time.perf_counter() - wall)

    def report(self, name: str) -> None:
        """Print what the maps cost, and what two threads gain."""
        path = float(self.case.deposits.path.sum())
        bare, maps = (float(np.median(self.cpu[kind])) for kind in ("bare", "maps"))
        gains = [float(np.median(np.divide(self.wall[kind], self.wall[f"{kind}, two"]))) for kind in ("bare", "maps")]
        print(
            f"{name:12} {path / bare / 1e6:12.2f} {path / maps / 1e6:12.2f} {maps / bare:8.1f} "
            f"{gains[0]:12.2f} {gains[1]:12.2f}"
        )


def end_to_end(folder: Path, more: bool) -> None:
    """Run a scene in a process of its own and print how long it took and how much memory."""
    word = "true" if more else "false"
    (folder / "scene.yaml").write_text(SCENE % (word, word))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "rpf3d_core.cli", "run", "scene.yaml", "--out", "out"], cwd=folder, check=True,
        stdout=subprocess.DEVNULL, env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])},
    )  # fmt: skip
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    facts = json.loads((folder / "out" / "summary.json").read_text())
    parts = ", ".join(f"{name} {facts[f'{name}_s']:.1f}" for name in ("read", "index", "compile", "fly", "write"))
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    what = "everything" if more else "every map and table, no pictures, no recording"
    print(f"{what}: {wall:.1f} s wall ({parts}), {cpu:.1f} CPU s, peak of memory so far {after.ru_maxrss / 1e6:.2f} GB")


def main(rocks: int) -> None:
    """Print the tables."""
    short, long = (Mapped(Case(falls, TRIANGLES, n)) for falls, n in ((BENCH, rocks), (CONE, rocks // LONG)))
    short.tallies().warm()
    for _ in range(PASSES):
        for mapped in (short, long):
            for maps in (False, True):
                kind = "maps" if maps else "bare"
                mapped.fly(kind, 1, maps)
                mapped.fly(f"{kind}, two", 2, maps)
    print(f"{platform.node()}, {platform.machine()}, load {os.getloadavg()[0]:.1f}; million m of path per CPU second")
    print(f"{'':12} {'final states':>12} {'every map':>12} {'times':>8} {'two threads':>12} {'with maps':>12}")
    short.report("short falls")
    long.report("long falls")
    with tempfile.TemporaryDirectory() as name:
        write_mesh(Path(name) / "pit.stl", pit_terrain(Pit(triangles=TRIANGLES)))
        print("100,000 rocks from the west wall, end to end:")
        end_to_end(Path(name), more=False)
        end_to_end(Path(name), more=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
