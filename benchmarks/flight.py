"""Measure the speed of flights over a synthetic pit: short bench falls and long falls, also with the algorithm in C++.

    python benchmarks/flight.py [rocks]

Only final states are recorded, and the rocks fly on one thread. The figures are CPU seconds of this process without
compile time, as medians. The passes of all cases alternate, so the ratios also hold on a busy machine. The whole pit
has one material, and the ground model is `none`.
"""

import os
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from cpp_engine import CppEngine, CppFlights

from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flight_order import LARGEST_BATCH, flight_order
from rpf3d_core.ensemble.flights import Deposits, IntArray
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases, Source, releases_of
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.kinetics.ground import NoGround, Sliding
from rpf3d_core.kinetics.rebound import ConstantRestitution
from rpf3d_core.materials.library import Surface, materials_of
from rpf3d_core.simulation.engines import Engine, Models, engine_of
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain
from rpf3d_core.values import Rock

TRIANGLES = 2_332_287  # thesis, table 5-2
FEWER = 150_000
PASSES = 7
GROUNDS = {"none": NoGround(), "sliding": Sliding()}
LONG = 20
"""Number of short falls for each long fall, with which passes of both take about the same time."""


class Falls(NamedTuple):
    """A kind of fall: rocks that are released 0.5 m above a line on the ground, with a velocity towards +x.

    pit : parameters in which the pit differs from the default pit
    line : (2, 2) x, y (m), ends of the line in the pit's coordinates
    speed : m/s, at the release; surface : coefficients of the whole ground
    """

    pit: dict[str, object]
    line: tuple[tuple[float, float], tuple[float, float]]
    speed: float
    surface: Surface


BENCH = Falls({}, ((-606.7, -200.0), (-606.7, 200.0)), 2.0, Surface(0.5, 0.8, 0.58, 0.5))
"""Short falls: rocks start along 400 m of the west wall and fall onto the next bench; R_n 0.5, R_t 0.8 (thesis, table
5-1)."""
CONE = Falls(
    {"bench_widths": (0.0, 0.0), "face_angle_deg": 48.0, "ramp_width": 0.0},
    ((-530.0, -100.0), (-530.0, 100.0)), 10.0, Surface(0.35, 0.88, 0.58, 0.5),
)  # fmt: skip
"""Long falls: rocks start along 200 m of the west side of a pit without benches, and fall down its hard wall."""


def ground_of(falls: Falls, triangles: int) -> Terrain:
    """Return the pit over which the rocks of a kind of fall fly, as one zone; triangles : number of its triangles."""
    terrain = pit_terrain(Pit(triangles=triangles, **falls.pit))  # type: ignore[arg-type]
    return replace(terrain, zone=np.zeros_like(terrain.zone), zones=("ground",))


def flight_of(falls: Falls, ground: str = "none") -> Flight:
    """Return the material, settings and models of a kind of fall; ground : name of the ground model."""
    models = Models(ConstantRestitution(), GROUNDS[ground])
    return Flight(materials_of([falls.surface]), Settings(), models)


def releases(falls: Falls, engine: Engine, terrain: Terrain, rocks: int) -> Releases:
    """Return the releases of a number of rocks of a kind of fall, along its line."""
    line = terrain.frame.points_to_local(np.array([(*point, 0.0) for point in falls.line]))
    source = Source("line", line, rocks, velocity=(falls.speed, 0.0, 0.0), line=True, above_ground=0.5)
    return releases_of([source], Rock(1000.0, 0.5), 1, engine)


class Case:
    """Rocks of one kind of fall over a pit, flown with the compiled engine, and the CPU time of each pass.

    seconds : CPU time (s) of each pass; deposits : result of the last pass
    """

    def __init__(self, falls: Falls, triangles: int, rocks: int) -> None:
        terrain = ground_of(falls, triangles)
        self.falls, self.flight = falls, flight_of(falls)
        self.engine = engine_of("compiled", facets_of(terrain))
        self.releases = releases(falls, self.engine, terrain, rocks)
        self.seconds: list[float] = []
        self.deposits = self.fly()
        self.seconds.clear()

    def fly(self) -> Deposits:
        """Fly all rocks once, store the CPU seconds, and return the deposits."""
        began = time.process_time()
        self.deposits = fly_ensemble(self.engine, self.flight, self.releases, record=False, threads=1).deposits
        self.seconds.append(time.process_time() - began)
        return self.deposits

    def per_rock(self) -> float:
        """Return the CPU time (s) for each rock, as a median over all passes."""
        return float(np.median(self.seconds)) / len(self.releases.x)

    def against_cpp(self) -> str:
        """Return as text the CPU time of the compiled engine over that of C++, and how many final states differ.

        The passes of both alternate.
        """
        rows = np.concatenate(list(flight_order(self.releases, 1, LARGEST_BATCH)))  # in the engine's order
        releases = taken(self.releases, rows)
        program = CppEngine(self.engine, self.falls.surface, self.flight.settings, releases)  # type: ignore[arg-type]
        self.seconds.clear()
        passes = [(self.fly(), program.fly()) for _ in range(PASSES)]
        ratio = self.per_rock() * len(self.releases.x) / float(np.median([cpp.seconds for _, cpp in passes]))
        return f"{ratio:.2f}; {told_apart(rows, *passes[-1])}"


def told_apart(rows: IntArray, deposits: Deposits, other: CppFlights) -> str:
    """Return as text how many rocks have final states that differ in any bit between the compiled engine and C++.

    rows : (R,) row of each rock of `other` in `deposits`; deposits : result of the engine; other : result of C++
    """
    ours = np.column_stack([deposits.t, deposits.x, deposits.path, deposits.max_speed, deposits.ground_speed])
    theirs = other.finals[:, [0, 1, 2, 3, 4, 5, 7]]
    counted = np.column_stack([deposits.outcome, deposits.facet, deposits.impacts])
    ours, counts = ours[rows], counted[rows] != other.counts[:, :3]
    unequal = ((ours != theirs) & ~(np.isnan(ours) & np.isnan(theirs))).any(axis=1) | counts.any(axis=1)
    return f"{unequal.sum():,} of {len(ours):,} final states differ in any bit"


FIRST_CALL = """
import sys, time
from rpf3d_core.simulation.engines import engine_of, precompile_flights
from rpf3d_core.terrain.facets import facets_of
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain
from flight import BENCH, flight_of
facets, flight = facets_of(pit_terrain(Pit(triangles=2000))), flight_of(BENCH, sys.argv[1])
began = time.process_time()
precompile_flights(engine_of("compiled", facets), flight.models, flight.materials, flight.settings)
print(time.process_time() - began)
"""


def first_call(cache: str, ground: str) -> float:
    """Return the CPU seconds that a new process takes to compile its loops, or to load them from the cache.

    cache : folder for the machine code, empty before the first call; ground : name of the ground model
    """
    paths = os.pathsep.join([os.path.dirname(os.path.abspath(__file__)), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", FIRST_CALL, ground], env=os.environ | {"XDG_CACHE_HOME": cache, "PYTHONPATH": paths},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return float(done.stdout)


def main(rocks: int) -> None:
    """Measure, and print the table of speeds; rocks : number of short falls."""
    cases = {
        "short falls, 2.33 M triangles": Case(BENCH, TRIANGLES, rocks),
        "short falls, 0.15 M triangles": Case(BENCH, FEWER, rocks),
        "long falls, 2.33 M triangles": Case(CONE, TRIANGLES, rocks // LONG),
    }
    for _ in range(PASSES):
        for case in cases.values():
            case.fly()
    print(f"{platform.node()}, {platform.machine()}, load {os.getloadavg()[0]:.1f}; per CPU second and core")
    print(f"{'':32} {'rocks/s':>10} {'path, M m/s':>12} {'impacts':>8} {'path, m':>8}")
    for name, case in cases.items():
        path, took = case.deposits.path.mean(), case.per_rock()
        rates = f"{1 / took:10,.0f} {path / took / 1e6:12.2f}"
        print(f"{name:32} {rates} {case.deposits.impacts.mean():8.1f} {path:8.1f}")
    short, coarse, long = cases.values()
    print(f"cost per rock, 2.33 M over 0.15 M triangles: {short.per_rock() / coarse.per_rock():.2f}")
    for name, case in (("short", short), ("long", long)):
        print(f"{name} falls, time over that of C++ -O3: {case.against_cpp()}")
    for ground in GROUNDS:
        with tempfile.TemporaryDirectory() as cache:
            compiled, loaded = first_call(cache, ground), first_call(cache, ground)
        print(f"first call, ground {ground}: {compiled:.1f} CPU s to compile, {loaded:.2f} from the disk cache")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
