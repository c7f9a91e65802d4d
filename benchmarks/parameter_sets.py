"""Compare the CPU time of a run over 64 parameter sets with the CPU time of the same run with one set.

    python benchmarks/parameter_sets.py [rocks] [turns]

Rocks start on the west wall of the synthetic pit. The values of the 64 sets differ by 0.01 % at most from those of the
one set, so the rocks fly about the same distances. The difference of the times is therefore the cost of the sets, and
not of other flights. Every map, table and picture is written. The two runs alternate, after one run of each that
compiles and is not counted.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
VALUES = {"normal_restitution": 0.35, "tangential_restitution": 0.85, "friction_angle_deg": 30.0}
WIDTH = 1e-4
"""Largest relative difference of a coefficient from its value with one set (-)."""

SCENE = """
terrain: {pit: {triangles: 150000, seed: 1}}
sources:
  - {name: west, line: [[-607, -50, 1687], [-607, 50, 1687]], velocity: [2, 0, 0], above_ground: 0.5, rocks: 1000}
rebound: coulomb_limited
ground: sliding
rock: {density: 2700, diameter: {mean: 1.0, sd: 0.3, min: 0.4, max: 2.0}}
"""


def scene(sets: int) -> str:
    """Return the text of the scene for a number of parameter sets: 1, or several sets of almost equal values."""
    text = SCENE + f"materials: {{default: {_mapping(VALUES)}}}\n"
    if sets == 1:
        return text
    ranges = {
        f"materials.default.{name}": _mapping({"min": value * (1 - WIDTH), "max": value * (1 + WIDTH)})
        for name, value in VALUES.items()
    }
    return text + f"unknowns: {{sets: {sets}, priors: {_mapping(ranges)}}}\n"


def _mapping(entries: dict[str, float] | dict[str, str]) -> str:
    return "{" + ", ".join(f"{key}: {value}" for key, value in entries.items()) + "}"


def cpu_seconds(folder: Path, name: str, rocks: int) -> float:
    """Run a scene of a folder in a child process; return the CPU time (s) of the child and of its own children.

    name : name of the scene file without extension, and of the result folder; rocks : number of rocks
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "rpf3d_core.cli", "run", f"{name}.yaml", "--out", name, "--rocks", str(rocks)],
        cwd=folder, check=True, capture_output=True, env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(rocks: int = 100_000, turns: int = 5) -> None:
    """Measure, and print the medians and their ratio; rocks : number of rocks; turns : number of runs of each kind."""
    with tempfile.TemporaryDirectory() as name:
        folder, times = Path(name), {"one": list[float](), "sets": list[float]()}
        for kind, sets in (("one", 1), ("sets", 64)):
            (folder / f"{kind}.yaml").write_text(scene(sets), encoding="utf-8")
            cpu_seconds(folder, kind, rocks)
        for _ in range(turns):
            for kind, found in times.items():
                found.append(cpu_seconds(folder, kind, rocks))
    one, many = (statistics.median(found) for found in times.values())
    print(f"{rocks:,} rocks: one set {one:.1f} CPU s, 64 sets {many:.1f} CPU s, {many / one:.2f} times")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
