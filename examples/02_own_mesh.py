"""Your own mesh and zones.

The terrain consists of three mesh files, one for each zone. A polygon marks a fourth zone on the floor.
The script prints the share of rocks that stop in each zone.
"""

import json
from pathlib import Path

import numpy as np

import rpf3d_core as rpf3d

SCENE = """
terrain:
  files: [{path: face.obj, zone: face}, {path: bench.obj, zone: bench}, {path: floor.obj, zone: floor}]
zones: [{zone: gravel_bed, polygons: gravel_bed.geojson}]
materials:
  gravel_bed: {normal_restitution: 0.2, tangential_restitution: 0.5, friction_angle_deg: 38}
  default: {normal_restitution: {uniform: [0.3, 0.5]}, tangential_restitution: 0.85, draw: per_impact}
sources: [{name: crest, line: [[1, 10, 0], [1, 50, 0]], above_ground: 0.5, rocks: 200, velocity: [2, 0, 0]}]
"""
OUT = Path("out/own_mesh")


def write_mesh(name: str, x_from: int, x_to: int) -> None:
    """Write an OBJ file of the ground from x_from to x_to (m), 60 m wide, with two triangles for each square of 2 m."""
    x, y = np.meshgrid(np.arange(x_from, x_to + 1, 2), np.arange(0, 61, 2), indexing="ij")
    z = np.interp(x, [0, 26, 34, 120], [45, 12, 11, 0])
    number = 1 + np.arange(x.size).reshape(x.shape)  # OBJ counts vertices from 1
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))])
    with (OUT / name).open("w") as file:
        file.writelines(f"v {px} {py} {pz}\n" for px, py, pz in zip(x.flat, y.flat, z.flat, strict=True))
        file.writelines(f"f {i} {j} {k}\n" for i, j, k in triangles)


OUT.mkdir(parents=True, exist_ok=True)
write_mesh("face.obj", 0, 26)
write_mesh("bench.obj", 26, 34)
write_mesh("floor.obj", 34, 120)
corners = [[42, 0], [54, 0], [54, 30], [42, 30], [42, 0]]  # m, in plan: one half of the floor has a bed of gravel
(OUT / "gravel_bed.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [corners]}))
(OUT / "scene.yaml").write_text(SCENE)

run = rpf3d.simulate(OUT / "scene.yaml")
rpf3d.write_run(run, OUT / "result", recording=False)
summary = json.loads((OUT / "result" / "summary.json").read_text())
for zone, stopped in summary["stopped_in_zones"].items():
    low, high = stopped["interval_95"]
    print(f"{zone:10s} {stopped['share']:6.1%} of the rocks stop here ({low:.1%} to {high:.1%})")
