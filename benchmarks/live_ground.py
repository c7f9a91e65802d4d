"""Measure how long the live simulator takes to make terrain from a survey (grid, mesh or patch) and to store it.

    python benchmarks/live_ground.py [updates]

The grid has 1.17 million points, the mesh 2.33 million triangles. The figures are wall and CPU times of this process,
as medians of 10 repetitions after two that do not count, because they compile and use new memory. The table also has
the longest delay of another thread that wakes every millisecond: a callback of a node would wait as long for the
interpreter. Then the program makes updates (100 by default), one whole survey for every nine patches, and prints the
memory of the process during and after the updates.
"""

import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.live.ground import LiveTerrain, Workshop
from rpf3d_core.live.store import Store, read_last
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, MeshSurvey, Survey
from rpf3d_core.terrain.grid_rows import grid_mesh

SIDE = 1081
"""Number of points on each side of the grid of a whole survey, which makes 2.33 million triangles."""
PATCH = 71
"""Number of points on each side of a patch that is a grid, which makes 9,800 triangles."""
CLOUD = 5_000
"""Number of points of a patch with scattered points, which makes 10,000 triangles."""
TIMES = 10
REPEATED = 10
"""Number of updates in a cycle: the first is a whole survey, the others are patches."""


def hills(x: np.ndarray, y: np.ndarray, seed: int) -> np.ndarray:
    """Return the heights (m) at x, y (m) of an artificial pit: benches of 15 m in a bowl, with noise of 0.15 m."""
    away = np.hypot(x - 0.5 * SIDE, y - 0.5 * SIDE)
    noise = np.random.default_rng(seed).normal(0.0, 0.15, x.shape)
    return 15.0 * np.floor(away / 45.0) + np.minimum(15.0, 3.0 * (away % 45.0)) + noise


def grid(side: int, east: float, north: float, seed: int) -> GridSurvey:
    """Return a survey of a square grid of points with steps of 1 m.

    side : number of points on each side; east, north : south-western corner (m); seed : seed of the noise
    """
    y, x = np.mgrid[0:side, 0:side] + np.array([north, east])[:, None, None]
    return GridSurvey(np.stack([x, y, hills(x, y, seed)], axis=-1))


def cloud(east: float, north: float, seed: int) -> CloudSurvey:
    """Return a survey of CLOUD points scattered over a square as wide as a patch.

    east, north : south-western corner (m); seed : seed of places and noise
    """
    x, y = np.random.default_rng(seed).uniform(0.0, PATCH - 1.0, (2, CLOUD)) + np.array([[east], [north]])
    return CloudSurvey(np.column_stack([x, y, hills(x, y, seed)]))


def mesh(survey: GridSurvey) -> MeshSurvey:
    """Return the survey of a grid as a survey of a mesh."""
    made = grid_mesh(survey.points)
    return MeshSurvey(made.vertices + np.array(made.origin), made.triangles)


class Heartbeat:
    """A thread that wakes every millisecond, to measure how long other work blocks the Python interpreter."""

    def __init__(self) -> None:
        self._late = 0.0
        threading.Thread(target=self._beat, daemon=True).start()

    def longest(self) -> float:
        """Return the longest time (s) from one awakening of the thread to the next, since the last call."""
        late, self._late = self._late, 0.0
        return late

    def _beat(self) -> None:
        while True:
            began = time.perf_counter()
            time.sleep(0.001)
            self._late = max(self._late, time.perf_counter() - began)


def resident() -> float:
    """Return the resident memory of this process (GB)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1e6


def timed(name: str, beat: Heartbeat, work: Callable[[int], Any]) -> None:
    """Do some work several times, and print a line of the table with its times and the delays of the thread `beat`.

    name : name of the work; work : called with the number of the repetition
    """
    walls, cpus, gaps = [], [], []
    for k in range(TIMES + 2):
        beat.longest()
        wall, cpu = time.perf_counter(), time.process_time()
        work(k)
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
        gaps.append(beat.longest())
    wall, cpu, gap = (statistics.median(values[2:]) for values in (walls, cpus, gaps))
    late = f"{1e3 * gap:10.1f} {1e3 * max(gaps[2:]):10.1f}"
    print(f"{name:40} {wall:8.3f} {cpu:8.3f} {late} {resident():8.2f}", flush=True)


class Updates:
    """The terrain of a simulator over a sequence of surveys."""

    def __init__(self, survey: Survey) -> None:
        self.workshop = Workshop()
        self.ground: LiveTerrain = self.workshop.whole(survey)

    def whole(self, survey: Survey) -> None:
        """Replace the terrain by the terrain of a whole survey."""
        self.ground = self.workshop.whole(survey)

    def patched(self, patch: GridSurvey | CloudSurvey) -> None:
        """Change the terrain by a patch."""
        self.ground = self.workshop.patched(self.ground, patch)


def places(count: int) -> list[tuple[float, float]]:
    """Return random south-western corners (east, north) m of `count` patches; they are not points of the grid."""
    return [tuple(place) for place in np.random.default_rng(0).uniform(20.0, SIDE - PATCH - 20.0, (count, 2)).tolist()]


def main(updates: int) -> None:
    """Measure, and print the table of times and then the memory during `updates` updates."""
    beat, survey, at = Heartbeat(), grid(SIDE, 0.0, 0.0, 0), places(updates)
    meshed, patches = mesh(survey), [grid(PATCH, *at[k], k) for k in range(TIMES + 2)]
    clouds = [cloud(*at[k], k) for k in range(TIMES + 2)]
    now = Updates(survey)
    print(f"{'':40} {'wall s':>8} {'CPU s':>8} {'late ms':>10} {'worst ms':>10} {'RSS GB':>8}")
    timed(f"whole grid, {SIDE * SIDE:,} points", beat, lambda k: now.whole(survey))
    timed(f"whole mesh, {len(meshed.triangles):,} triangles", beat, lambda k: now.whole(meshed))
    meshed.vertices.reshape(SIDE, SIDE, 3)[9::50, 9::50, 0] += 1.6
    timed("whole mesh, some of it overhanging", beat, lambda k: now.whole(meshed))
    timed(f"patch, grid of {PATCH} x {PATCH}", beat, lambda k: now.patched(patches[k]))
    timed(f"patch, cloud of {CLOUD:,} points", beat, lambda k: now.patched(clouds[k]))
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        timed("kept on disk, until handed over", beat, lambda k: store.keep(now.workshop.whole(survey), survey))
        timed("kept on disk, until it is there", beat, lambda k: store.flush())
        timed("read from disk", beat, lambda k: read_last(Path(folder)))
        store.close()
    for k in range(updates):
        if k % (updates // 4 or 1) == 0:
            grounds = now.workshop.size / 1e9
            print(f"after {k:4} updates {resident():6.2f} GB, of that grounds {grounds:.2f} GB", flush=True)
        if k % REPEATED == 0:
            now.whole(survey)
        else:
            now.patched(grid(PATCH, *at[k], k))
    print(f"after {updates:4} updates {resident():6.2f} GB, {len(now.ground.facets.zone):,} rows of facets")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
