"""Measure time and memory of a whole run over 2.33 million triangles, for rocks as points and for rocks with a shape.

    python benchmarks/whole_blocks.py [rocks]

Rocks start on the west wall of the pit of `benchmarks/ensemble.py`. All maps and tables are written, but no pictures
and no recording. Each run is a separate process, after a first run that compiles and is not counted.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from flight import TRIANGLES

from rpf3d_core.results.mesh_writer import write_mesh
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain

ROOT = Path(__file__).parents[1]
SCENE = """
terrain: {files: [{path: pit.stl}]}
sources:
  - {name: west, line: [[-606.7, -200, 0], [-606.7, 200, 0]], velocity: [2, 0, 0], above_ground: 1.0, rocks: 1000}
hazard: {cell: 1}
outputs: {pictures: false, recording: false}
"""
KINDS = {
    "points": """
materials: {default: {normal_restitution: 0.35, tangential_restitution: 0.85, friction_angle_deg: 30}}
rebound: coulomb_limited
rock: {density: 2700, diameter: {mean: 1.0, sd: 0.3, min: 0.4, max: 2.0}}
""",
    "blocks of 38 corners": """
materials: {default: {restitution: 0.1, friction: 0.55, rolling_resistance: 0.16}}
contact: rigid
rock:
  density: 2700
  diameter: {mean: 1.0, sd: 0.3, min: 0.4, max: 2.0}
  shape: {files: [bench_block.obj], corners: 200}
""",
}


RUN = """
import sys
from pathlib import Path
from rpf3d_core.cli import main
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print([line.split()[1] for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")][0])
"""
"""Python code of a run that prints its peak memory (kB).

The peak that the system reports for a child process would include the memory of its parent.
"""


def run(folder: Path, rocks: int) -> dict[str, float]:
    """Run the scene of a folder, and return its summary, with times (s), and its peak memory `peak_gb` (GB)."""
    done = subprocess.run(
        [sys.executable, "-c", RUN, "run", "scene.yaml", "--out", "out", "--rocks", str(rocks)], cwd=folder,
        check=True, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    facts = json.loads((folder / "out" / "summary.json").read_text())
    return {**facts, "peak_gb": float(done.stdout.split()[-1]) / 1e6}


def main(rocks: int) -> None:
    """Print a line of figures for each of KINDS; rocks : number of rocks of a run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_mesh(folder / "pit.stl", pit_terrain(Pit(triangles=TRIANGLES)))
        shutil.copy(ROOT / "config" / "scenes" / "bench_block.obj", folder)
        for kind, text in KINDS.items():
            (folder / "scene.yaml").write_text(SCENE + text)
            run(folder, 50)
            found = run(folder, rocks)
            parts = ", ".join(f"{part} {found[f'{part}_s']:.1f}" for part in ("read", "index", "fly", "write"))
            print(f"{rocks:,} {kind}: {found['total_s']:.1f} s wall ({parts}), peak {found['peak_gb']:.2f} GB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
