"""Write scenes of Tschamut for `rpf3d calibrate`: points, and rocks with the shapes of the three blocks.

python docs/field_cases/calibrated_tschamut.py FOLDER
rpf3d calibrate FOLDER/points.yaml --out FOLDER/points
rpf3d calibrate FOLDER/blocks.yaml --out FOLDER/blocks

Each of the 18 runs is a source. The stops are those of all runs, in the coordinates of the terrain. A calibration does
not know which stop belongs to which source.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from field_cases import tschamut
from field_cases.blocks import meadow
from field_cases.blocks.shapes import DENSITY
from rpf3d_core.shapes.polyhedron import Polyhedron

COMMON = """\
terrain: {{files: [{{path: {terrain}, zone: meadow}}]}}
observed: {{points_file: stops.csv, along: [{x:.6f}, {y:.6f}, 0]}}
engine: compiled
stop_speed: 0.5
seed: 1
sources:
"""
POINTS = """\
rock: {{density: {density:g}, mass: {mass:.1f}}}
materials: {{default: {{normal_restitution: 0.3, tangential_restitution: 0.7, friction_angle_deg: 30}}}}
rebound: coulomb_limited
ground: sliding
calibration:
  unknowns:
    materials.*.normal_restitution: {{min: 0.05, max: 0.6}}
    materials.*.tangential_restitution: {{min: 0.2, max: 0.99}}
    materials.*.friction_angle_deg: {{min: 15, max: 45}}
  measuring_error: 0.5
"""
BLOCKS = """\
rock: {{density: {density:g}, shape: {{files: [{files}], corners: 40}}}}
materials: {{default: {{restitution: 0.0, friction: 0.6, rolling_resistance: 0.2}}}}
contact: rigid
calibration:
  unknowns:
    materials.*.restitution: {{min: 0.0, max: 0.3}}
    materials.*.friction: {{min: 0.2, max: 1.2}}
    materials.*.rolling_resistance: {{min: 0.02, max: 0.6}}
  measuring_error: 0.5
  shape_column: 4
"""
"""Ranges of the ground: what soil and turf can be, not what fits; friction and rolling resistance as at Authume, wider
because soil is softer than rock."""
ROCKS_A_RUN = 100


def write_scenes(folder: Path) -> None:
    """Write points.yaml and blocks.yaml with the files that they name into an existing folder."""
    field, blocks = tschamut.runs(), meadow.blocks()
    files = [f"block_{number}.obj" for number in blocks]
    for file, (_, shape) in zip(files, blocks.values(), strict=True):
        (folder / file).write_text(obj_text(shape))
    order = list(blocks)
    rows = [[*end, order.index(block) + 1] for end, block in zip(field.end, meadow.block_of_run(), strict=True)]
    (folder / "stops.csv").write_text("x,y,z,shape\n" + "\n".join(",".join(f"{v:g}" for v in row) for row in rows))
    x, y = field.axes[0][:2]
    common = COMMON.format(terrain=tschamut.DATA / "terrain.asc", x=x, y=y)
    radii = np.cbrt(field.mass / DENSITY / (4.0 / 3.0 * np.pi))
    of_points = POINTS.format(density=tschamut.MEADOW_DENSITY, mass=field.mass.mean())
    of_blocks = BLOCKS.format(density=DENSITY, files=", ".join(files))
    (folder / "points.yaml").write_text(common + _sources(lambda i: 2.0 * float(field.radius[i])) + of_points)
    (folder / "blocks.yaml").write_text(common + _sources(lambda i: meadow.ABOVE * float(radii[i])) + of_blocks)


def obj_text(shape: Polyhedron) -> str:
    """Return a polyhedron as the text of an OBJ file (m)."""
    corners = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in shape.corners]
    faces = ["f " + " ".join(str(corner + 1) for corner in face) for face in shape.faces]
    return "\n".join([*corners, *faces]) + "\n"


def _sources(above: Callable[[int], float]) -> str:
    """Return the sources of the scene, one for each run; above : height (m) of the centre of run i above the ground."""
    field, half = tschamut.runs(), tschamut.SPREAD
    return "".join(
        f"  - {{name: {name}, points: [[{field.release[i, 0]}, {field.release[i, 1]}, 0]], "
        f"above_ground: {above(i):.3f}, velocity: [{', '.join(map(str, field.velocity[i].tolist()))}], "
        f"spread: [{half}, {half}, 0], rocks: {ROCKS_A_RUN}}}\n"
        for i, name in enumerate(field.names)
    )


def main() -> int:
    """Write the scenes into the folder of the command line."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    write_scenes(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
