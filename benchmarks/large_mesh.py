"""Measure the time to read, weld and index a pit of 2.33 million triangles, and to fly rocks over it on both engines.

    python benchmarks/large_mesh.py [rocks]

The rocks are the short falls of `flight.py`, on one thread; only final states are recorded. The figures are CPU times,
wall times and peak memory of this process, without compile time.
"""

import platform
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from flight import BENCH, TRIANGLES, flight_of, releases

from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.results.mesh_writer import write_mesh
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain

REFERENCE_ROCKS = 200
SCENE = """
terrain: {files: [{path: pit.stl}]}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
sources: [{name: unused, points: [[0, 0, 0]]}]
"""


def timed(name: str, work: Callable[[], Any]) -> Any:
    """Call `work`, print its CPU and wall time (s) and the peak of memory so far (GB), and return its result."""
    cpu, wall = time.process_time(), time.perf_counter()
    result = work()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"{name:34} {time.process_time() - cpu:8.2f} {time.perf_counter() - wall:8.2f} {peak:8.2f}")
    return result


def read(folder: Path) -> Terrain:
    """Return the terrain of the scene in a folder."""
    return read_terrain(read_scene(folder / "scene.yaml"))[0]


def fly(engine: Engine, terrain: Terrain, rocks: int) -> None:
    """Fly rocks on one thread, and print how many rocks fly per CPU second."""
    some = releases(BENCH, engine, terrain, rocks)
    fly_ensemble(engine, flight_of(BENCH), releases(BENCH, engine, terrain, 10), record=False)  # compiles the loops
    cpu = time.process_time()
    deposits = fly_ensemble(engine, flight_of(BENCH), some, record=False, threads=1).deposits
    rate = rocks / (time.process_time() - cpu)
    print(f"{engine.name:10} {rate:10,.0f} rocks per CPU second ({deposits.impacts.mean():.1f} impacts, "
          f"{deposits.path.mean():.1f} m of path a rock)")  # fmt: skip


def main(rocks: int) -> None:
    """Measure, and print the table of times and the speeds; rocks : number of rocks on the compiled engine."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_mesh(folder / "pit.stl", pit_terrain(Pit(triangles=TRIANGLES)))
        (folder / "scene.yaml").write_text(SCENE)
        engine_of("compiled", facets_of(pit_terrain(Pit(triangles=2000))))  # compiles the index
        print(f"{platform.machine()}, {(folder / 'pit.stl').stat().st_size / 1e6:.0f} MB of STL")
        print(f"{'':34} {'CPU s':>8} {'wall s':>8} {'peak GB':>8}")
        terrain = timed("read, weld, wind, count faults", lambda: read(folder))
        facets = timed("arrays for the kernels", lambda: facets_of(terrain))
        compiled = timed("bucket grid", lambda: engine_of("compiled", facets))
        reference = timed("VTK locator", lambda: engine_of("reference", facets))
        fly(compiled, terrain, rocks)
        fly(reference, terrain, REFERENCE_ROCKS)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
