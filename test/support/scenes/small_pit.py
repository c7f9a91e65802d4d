"""Write a scene file with a synthetic pit that is small enough for flights in a test."""

from pathlib import Path

from input_files.terrain_files import with_models

SCENE = """\
terrain:
  pit: {{triangles: 6000, waste_benches: 6, ore_benches: 0, floor_radius: 120, crest_altitude: 72, spills: {spills}}}
materials:
  default: {{normal_restitution: {R_n}, tangential_restitution: {R_t}}}
sources:
  - {{name: top, zone: bench_1, above_ground: 8, rocks: 75, velocity_spread: [9, 9, 0]}}
  - {{name: below, zone: bench_3, above_ground: 8, rocks: 25, velocity_spread: [9, 9, 0]}}
hazard: {{cell: {cell}}}
areas_of_interest: [{{name: east_side, polygons: east.geojson}}]
outputs: {{trajectories: 10}}
{more}
"""
HAZARD_CELL = 10
EAST = '{"type": "Polygon", "coordinates": [[[0, -300], [300, -300], [300, 300], [0, 300], [0, -300]]]}'


def scene_file(
    folder: Path, name: str = "pit.yaml", R_n: float = 0.5, R_t: float = 0.8, more: str = "", spills: int = 20
) -> Path:
    """Write the scene and its area of interest to a folder; return the path of the scene.

    R_n, R_t : coefficients of restitution; spills : number of spills of the pit
    more : further YAML; unless it names other models, the scene has the models of the thesis
    """
    (folder / "east.geojson").write_text(EAST)
    path = folder / name
    path.write_text(with_models(SCENE.format(R_n=R_n, R_t=R_t, more=more, spills=spills, cell=HAZARD_CELL)))
    return path
