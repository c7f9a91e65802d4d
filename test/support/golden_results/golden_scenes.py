"""Scenes for the golden digests: shipped scenes, a scene for each model and effect, and scenes with rarely used keys.

Each scene is text and uses no helper of other tests, so a change of a helper cannot change a digest.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from golden_results.golden_slope import ascii_stl, esri_grid, legacy_vtk, obj, ply, strip

CONFIG = Path(__file__).parents[3] / "config" / "scenes"
WITHOUT_TERRAIN = ("authume_p1", "authume_p1_blocks")
"""The shipped scenes whose terrain is not part of the project."""
REFERENCE, COMPILED, BOTH = ("reference",), ("compiled",), ("reference", "compiled")
KINDS = ("rebound", "ground", "contact", "effects")
"""Keys of a scene that name models and effects; `rpf3d effects --json` has the same names in `kind`."""


@dataclass(frozen=True)
class Entry:
    """A scene, and the options of its run.

    name : name of the entry and of the scene file; scene : text of the scene file
    rocks : value of --rocks, empty for the number in the scene; engines : engines that must give the same digests
    files : name -> text of the files that the scene refers to
    """

    name: str
    scene: str
    rocks: str = ""
    engines: tuple[str, ...] = REFERENCE
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def named(self) -> set[str]:
        """Names of the models and effects in the scene, such as `rebound.constant`."""
        content = yaml.safe_load(self.scene)
        return {f"{kind}.{name}" for kind in KINDS for name in _names(content.get(kind))}

    def write(self, folder: Path) -> Path:
        """Write the scene and its files into a folder; return the path of the scene file."""
        for name, text in {**self.files, f"{self.name}.yaml": self.scene}.items():
            (folder / name).write_text(text, encoding="utf-8")
        return folder / f"{self.name}.yaml"


def _names(value: Any) -> list[str]:
    """Return the names in the value of a key of KINDS."""
    return [value] if isinstance(value, str) else list(value or ())


SHIPPED = "outputs: {pictures: false, recording: false}\n"
TABLES = "outputs: {trajectories: 10, pictures: false, recording: false}\n"
PROFILES = "outputs: {trajectories: 10, recording: false}\n"
"""Outputs with pictures, because the points of profiles are only written together with pictures."""

PIT = """\
terrain:
  pit: {triangles: 6000, seed: 1, waste_benches: 6, ore_benches: 0, floor_radius: 120, crest_altitude: 72, spills: 20}
materials:
  default: {normal_restitution: 0.5, tangential_restitution: 0.8, friction_angle_deg: 30, rolling_friction: 0.3}
rock: {density: 2700, diameter: 1.2}
sources:
  - {name: top, zone: bench_1, above_ground: 8, rocks: 12, velocity_spread: [9, 9, 0]}
  - {name: below, zone: bench_3, above_ground: 8, rocks: 4, velocity_spread: [9, 9, 0]}
hazard: {cell: 10}
seed: 1
"""
"""A pit that is small enough for the reference engine, with the coefficients of all models."""
WEST_HALF = '{"type": "Polygon", "coordinates": [[[-300, -300], [0, -300], [0, 300], [-300, 300], [-300, -300]]]}'
EAST_HALF = '{"type": "Polygon", "coordinates": [[[0, -300], [300, -300], [300, 300], [0, 300], [0, -300]]]}'


def _ring(name: str, half: int, capacity_kj: int) -> str:
    """Return a barrier along a square around the middle of the pit; half : half the side of the square (m)."""
    corners = [[-half, -half], [half, -half], [half, half], [-half, half], [-half, -half]]
    return f"{{name: {name}, along: {corners}, height: 2, capacity_kj: {capacity_kj}}}"


RINGS = ", ".join(_ring(f"r{half}", half, capacity) for half, capacity in ((120, 40), (150, 400), (180, 0), (210, 90)))
TREES = "x,y,dbh_cm,height,kind\n" + "".join(
    f"{12 * i},{12 * j},{20 + (3 * i + 5 * j) % 40},18,{('conifer', 'broadleaved', 'silver_fir')[(i + j) % 3]}\n"
    for i in range(-18, 19)
    for j in range(-18, 19)
    if 120 <= 12 * (i * i + j * j) ** 0.5 <= 215
)
"""Text of a CSV file with trees on the wall of the pit."""
ROWS = "[[5, 1.6, 0.6], [30, 0.7, 0.7], [60, 0.35, 0.85], [90, 0.25, 0.9]]"
COVARIANCE = [[0.0025 if row == column else 0.0005 for column in range(9)] for row in range(9)]
EFFECTS = {
    "roughness": "{angle_sd_deg: 6}",
    "scarring": "{}",
    "drag": "{coefficient: 0.5, accuracy: 0.05}",
    "drag_layer": "{coefficient: 100, height: 3}",
    "forest": "{stems_per_ha: 300}",
    "barriers": f"{{panels: [{RINGS}]}}",
    "fragmentation": "{least_ratio: 0.4, least_volume: 0.02, generations: 2}",
}
"""Every effect, with parameters with which the effect changes paths of rocks in the pit."""
ALL_EFFECTS = "effects: {" + ", ".join(f"{name}: {value}" for name, value in EFFECTS.items()) + "}\nmax_time: 120\n"

REBOUNDS = {
    "constant": "{constant: {}}",
    "coulomb_limited": "{coulomb_limited: {}}",
    "thesis_literal": "{thesis_literal: {}}",
    "pfeiffer_bowen": "{pfeiffer_bowen: {}}",
    "velocity_scaled": "{velocity_scaled: {}}",
    "mass_scaled": "{mass_scaled: {}}",
    "mass_scaled_with_k": "{mass_scaled: {C: 2000, K: 12}}",
    "v_half": "{v_half: {speed: 6}}",
    "angle_table_law": "{angle_table: {law: wyllie}}",
    "angle_table_rows": f"{{angle_table: {{rows: {ROWS}}}}}",
    "stochastic_matrix": (
        f"{{stochastic_matrix: {{mean: [[0.7, 0, 0.1], [0, 0.4, 0], [0.4, 0, 0.3]], covariance: {COVARIANCE}}}}}"
    ),
}
GROUNDS = {"none": "none", "rolling": "rolling", "rolling_stone": "{rolling_stone: {stop_speed: 2}}"}
"""Ground models; other scenes use the models `sliding` and `sphere`."""
MORE_EFFECTS = {
    "roughness_amplitude": "roughness: {amplitude: 0.1, deviates: true}",
    "roughness_sideways": "roughness: {angle_sd_deg: 6, lateral_sd_deg: 4}",
    "scarring_zones": "scarring: {zones: {face: {stiffness: 5000000}, spill: {mu_max: 3}}}",
    "drag_layer_polygons": "drag_layer: {coefficient: 250, polygons: west.geojson}",
    "forest_file": "forest: {file: trees.csv}",
    "forest_within": (
        "forest: {stems_per_ha: 500, within: west.geojson, conifer_share: 0.5, deflection: {frontal: [0.4, 0.3, 0.3]}}"
    ),
}
"""Effects with parameters that differ from EFFECTS."""


def _shipped() -> Iterator[Entry]:
    """Yield the scenes of config/scenes that need no external data; scenes that would take long get fewer rocks.

    The finer scenes `study_*` fly on the compiled engine only.
    """
    beside = {path.name: path.read_text() for path in CONFIG.iterdir() if path.suffix != ".yaml"}
    for path in sorted(CONFIG.glob("*.yaml")):
        if path.stem not in WITHOUT_TERRAIN:
            text, is_study = path.read_text(), path.stem.startswith("study_")
            fine = is_study and path.stem != "study_low"
            many = is_study or path.stem in ("bench_15m", "catch_bench")
            rocks = "200" if many else "10" if path.stem.endswith("_blocks") else ""
            yield Entry(path.stem, text + SHIPPED, rocks, COMPILED if fine else BOTH, beside)


def _models() -> Iterator[Entry]:
    """Yield scenes for each rebound model, ground model and effect, some of them with other parameters."""
    beside = {"west.geojson": WEST_HALF, "trees.csv": TREES}
    for name, rebound in REBOUNDS.items():
        yield Entry(f"rebound_{name}", f"{PIT}rebound: {rebound}\nground: sliding\n{TABLES}")
    for name, ground in GROUNDS.items():
        yield Entry(f"ground_{name}", f"{PIT}rebound: coulomb_limited\nground: {ground}\n{TABLES}")
    sphere = f"{PIT}ground: sphere\n{TABLES}".replace("rock: {", "rock: {shape: sphere, ")
    yield Entry("sphere", sphere, engines=BOTH)
    yield Entry("sphere_that_bounces_sideways", f"{sphere}contact: {SIDEWAYS}\n")
    for name, effect in EFFECTS.items():
        yield Entry(f"effects_{name}", f"{PIT}{DEFAULTS}effects: {{{name}: {effect}}}\n{TABLES}")
    for name, effects in MORE_EFFECTS.items():
        yield Entry(f"effects_{name}", f"{PIT}{DEFAULTS}effects: {{{effects}}}\n{TABLES}", files=beside)
    together = f"{PIT}rebound: constant\nground: sliding\n{ALL_EFFECTS}{TABLES}"
    yield Entry("effects_all_together", together, engines=BOTH)


SIDEWAYS = "{coulomb_sphere: {impact_friction: 0.4, tangential_restitution: 0.3}}"
DEFAULTS = "rebound: coulomb_limited\nground: sliding\n"

DRAWN = """\
terrain:
  pit: {triangles: 6000, seed: 2, waste_benches: 6, ore_benches: 0, floor_radius: 120, crest_altitude: 72, spills: 20}
materials:
  spill:
    normal_restitution: {uniform: [0.2, 0.4]}
    tangential_restitution: 0.7
    rolling_friction: 0.6
    draw: per_impact
  bench_*:
    normal_restitution: {mean: 0.45, sd: 0.1, min: 0.1, max: 0.8}
    tangential_restitution: {mean: 0.9, sd: 0.05, min: 0.5, max: 0.99}
    friction_angle_deg: {mean: 30, sd: 2, min: 20, max: 40}
    rolling_friction: {uniform: [0.3, 0.5]}
    draw: per_impact
  default:
    normal_restitution: {mean: 0.5, sd: 0.1, min: 0.1, max: 0.9}
    tangential_restitution: {lognormal: {mean: 0.7, sd: 0.2, min: 0.3, max: 0.95}}
    friction_angle_deg: {uniform: [25, 35]}
    rolling_friction: {mean: 0.4, sd: 0.1, min: 0.1, max: 0.8}
    stop_speed: 0.7
"""
ROCKS = {
    "diameter": "{density: 2600, diameter: {mean: 1.0, sd: 0.3, min: 0.4, max: 2.0}}",
    "mass": "{density: 2600, mass: {lognormal: {mean: 800, sd: 400, min: 50, max: 5000}}}",
    "volume": "{density: 2600, volume: {power_law: {exponent: 0.5, min: 0.05, max: 8}}}",
}
SOURCES = """\
sources:
  - {name: line, line: [[-230, -60, 0], [-234, 0, 0], [-230, 60, 0]], above_ground: 1, rocks: 5, velocity: [3, 0, 0]}
  - {name: polygon, polygon: [[150, -40], [200, -40], [200, 40]], above_ground: 0.5, rocks: 5}
  - {name: faces, zone: face, steeper_than_deg: 45, above_ground: 1, rocks: 5}
  - {name: points, points: [[0, 190, 90], [10, 190, 90]], rocks: 4, spread: [2, 2, 0], velocity_spread: [2, 2, 0]}
  - name: blast
    points_file: holes.csv
    above_ground: 2
    rocks: 5
    speed: {uniform: [2, 6]}
    azimuth_deg: 90
    elevation_deg: 30
    spread_deg: 20
seed: 7
"""
HOLES = "name,east,north\na,-200,0\nb,-190,20\nc,-190,-20\n"

WATCHED = f"""\
terrain:
  pit: {{triangles: 6000, seed: 1, waste_benches: 6, ore_benches: 0, floor_radius: 120, crest_altitude: 72, spills: 20}}
  crs: EPSG:31287
  berms: [{{name: road, along: [[-170, -60], [-170, 0], [-160, 60]], height: 2, width: 8, crest: 1}}]
zones: [{{zone: west, polygons: west.geojson}}]
materials:
  berm_road: {{normal_restitution: 0.2, tangential_restitution: 0.5}}
  west: {{normal_restitution: 0.45, tangential_restitution: 0.85}}
  default: {{normal_restitution: 0.5, tangential_restitution: 0.8}}
sources:
  - {{name: top, zone: ground, above_ground: 3, rocks: 4, velocity_spread: [9, 9, 0]}}
  - {{name: wall, line: [[-230, -60, 0], [-234, 0, 0], [-230, 60, 0]], above_ground: 1, rocks: 36, velocity: [4, 0, 0]}}
areas_of_interest: [{{name: east_side, polygons: east.geojson}}, {{name: west_side, polygons: west.geojson}}]
hazard:
  reach_levels: [0.05, 0.2]
  energy_percentile: 90
  passage_per_metre: true
  matrix:
    energy_levels_kj: [30, 300]
    probability_levels: [0.001, 0.01]
    object_width: 2
    classes: [[null, low, middle], [low, middle, high], [middle, high, high]]
effects: {{barriers: {{panels: [{_ring("fence", 140, 100)}, {_ring("line", 170, 0)}]}}}}
observed: {{points_file: seen.xyz, along: [1, 0, 0], sections: {{west: [null, 0], east: [0, null]}}}}
"""
"""Berms, zones of polygons, areas, a matrix, barriers, a reference system and observations."""
SEEN = "# x y z\n-150.5 3.25 20\n-140 -7.5 19\n-130.25 11 18\n"

SLOPE = """\
rebound: coulomb_limited
ground: sliding
hazard: {cell: 4}
"""


MESHES = {
    "talus.stl": ascii_stl(*strip(0, 5)),
    "rock.obj": obj(*strip(5, 10)),
    "road.ply": ply(*strip(10, 14)),
    "floor.vtk": legacy_vtk(*strip(14, 24)),
}
"""Name -> text of the mesh files of one slope in four parts; each file is a zone."""
MESH_SCENE = f"""\
terrain:
  files: [{", ".join(f"{{path: {name}, zone: {name.partition('.')[0]}}}" for name in MESHES)}]
  up: y
  weld: 0.001
materials:
  talus: {{normal_restitution: 0.3, tangential_restitution: 0.8, friction_angle_deg: 35}}
  ro*: {{normal_restitution: 0.5, tangential_restitution: 0.9}}
  default: {{normal_restitution: 0.2, tangential_restitution: 0.6}}
sources: [{{name: edge, line: [[2, 0, -6], [2, 0, -42]], above_ground: 2, rocks: 20, velocity: [4, 0, 0.5]}}]
{SLOPE}"""


GRID_SCENE = f"""\
terrain: {{files: [{{path: slope.asc}}], crs: EPSG:31287}}
materials: {{default: {{normal_restitution: 0.4, tangential_restitution: 0.8, friction_angle_deg: 30}}}}
sources:
  - {{name: edge, line: [[400006, 300008, 0], [400006, 300044, 0]], above_ground: 2, rocks: 20, velocity: [4, 0.5, 0]}}
{SLOPE}"""
STEPPING = "method: {stepping: {dt: 0.002, threshold: 0.05}}\n"
CUT_OFF = "max_impacts: 6\nmax_time: 5\nsmallest_bounce: 0.05\nstop_speed: 1.5\ngravity: 9.5\n"


def _others() -> Iterator[Entry]:
    """Yield scenes with distributions, sources, terrain files, holes, areas, barriers, stepping and targets."""
    watched = {"west.geojson": WEST_HALF, "east.geojson": EAST_HALF, "seen.xyz": SEEN}
    holes = {"holes.csv": HOLES}
    for name, rock in ROCKS.items():
        engines = BOTH if name == "diameter" else REFERENCE
        yield Entry(f"drawn_{name}", f"{DRAWN}rock: {rock}\n{SOURCES}{DEFAULTS}{TABLES}", "", engines, holes)
    rolling = f"{DRAWN}rock: {ROCKS['mass']}\n{SOURCES}rebound: pfeiffer_bowen\nground: rolling\n{TABLES}"
    yield Entry("drawn_rolling", rolling, files=holes)
    yield Entry("watched", f"{WATCHED}{DEFAULTS}{PROFILES}", files=watched)
    yield Entry("meshes_of_zones", MESH_SCENE + PROFILES, files=MESHES)
    yield Entry("grid", GRID_SCENE + TABLES, files={"slope.asc": esri_grid()})
    yield Entry("grid_with_a_hole", GRID_SCENE + TABLES, files={"slope.asc": esri_grid(with_hole=True)})
    yield Entry("grid_in_steps", GRID_SCENE + STEPPING + TABLES, files={"slope.asc": esri_grid()})
    yield Entry("pit_in_steps", f"{PIT}{DEFAULTS}{STEPPING}{TABLES}", rocks="6")
    yield Entry("squared_steps", f"{PIT}{DEFAULTS}{STEPPING.replace('}}', ', squared: true}}')}{TABLES}", rocks="6")
    yield Entry("cut_off", f"{PIT}{DEFAULTS}{CUT_OFF}{TABLES}")
    target = "rocks: auto\ntarget: {half_width: 0.02, p95_energy: 0.2, most_rocks: 4000}\n"
    yield Entry("rocks_as_a_target_asks", f"{PIT}{DEFAULTS}{target}{TABLES}", engines=COMPILED)


ENTRIES = {entry.name: entry for entry in (*_shipped(), *_models(), *_others())}
"""Name -> entry, in the order of golden.json."""
