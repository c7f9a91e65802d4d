"""Write the scenes of Authume and Tschamut for `rpf3d calibrate`: one for each site and model.

python docs/field_cases/scenes.py FOLDER
rpf3d calibrate FOLDER/tschamut_coulomb_limited.yaml --out FOLDER/result

At Tschamut, each of the 18 runs is a source. The stops of all runs are in one file, in the coordinates of the terrain,
so a calibration does not know which stop belongs to which source.
"""

import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from field_cases import authume, tschamut
from field_cases.blocks import meadow, quarry
from field_cases.blocks.shapes import DENSITY
from field_cases.models import AUTHUME, CONSTANT, COULOMB_LIMITED, HOEK, MODELS, SHAPES, TSCHAMUT, Model
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.shapes.polyhedron import Polyhedron

Raw = dict[str, Any]
SHIPPED = {(AUTHUME, CONSTANT): authume.SCENE, (AUTHUME, SHAPES): quarry.SCENE}
"""Site and model -> scene file of the project; other scenes are written by this module."""
MEASURING_ERROR = 0.5
"""Standard deviation (m) of the measured position of an observed stop."""
SOIL = {"restitution": 0.0, "friction": 0.6, "rolling_resistance": 0.2}
"""Values of the coefficients of rocks with a shape, which a scene must have; a calibration replaces all of them."""
ROCKS_A_RUN = 100


@lru_cache
def scene_file(site: str, model: Model) -> Path:
    """Return the scene file of a site and a model; a scene that is not shipped is written to a temporary folder."""
    return SHIPPED.get((site, model)) or write_scene(Path(_folder().name), site, model)


@lru_cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory()


def name_of(site: str, model: Model) -> str:
    """Return the name of the files of a site and a model without extension, such as tschamut_coulomb_limited."""
    return f"{site.lower()}_{model.impact}"


def write_scene(folder: Path, site: str, model: Model) -> Path:
    """Write a scene and the files that it names to an existing folder; return the path of the scene file."""
    scene = _quarry() if site == AUTHUME else _meadow(folder, model)
    ground = {"default": SOIL} if model == SHAPES else model.published(site, HOEK)["materials"]
    unknown: Raw = {"unknowns": model.unknowns(site), "measuring_error": MEASURING_ERROR}
    if model == SHAPES:
        unknown["shape_column"] = 4
    if model == COULOMB_LIMITED and "calibration" in scene:
        unknown["book"] = scene["calibration"]["book"]
    rock = {**scene["rock"], **model.keys().get("rock", {})}
    path = folder / f"{name_of(site, model)}.yaml"
    written = {**scene, **model.keys(), "rock": rock, "materials": ground, "calibration": unknown}
    path.write_text(yaml.safe_dump(written, sort_keys=False), encoding="utf-8")
    return path


def _quarry() -> Raw:
    """Return the shipped scene of points at Authume without its models, with absolute paths."""
    scene: Raw = yaml.safe_load(authume.SCENE.read_text(encoding="utf-8"))
    for named in (*scene["terrain"]["files"], *scene["sources"], scene["observed"]):
        key = "path" if "path" in named else "points_file"
        named[key] = str((authume.SCENE.parent / named[key]).resolve())
    return {key: value for key, value in scene.items() if key not in ("rebound", "ground", "data_hint")}


def _meadow(folder: Path, model: Model) -> Raw:
    """Return the scene of Tschamut without its models; write the stops and the shapes of the blocks to a folder."""
    field = tschamut.runs()
    rock: Raw = {"density": tschamut.MEADOW_DENSITY, "mass": round(float(field.mass.mean()), 1)}
    above = 2.0 * field.radius
    if model == SHAPES:
        rock = {"density": DENSITY, "shape": {"files": _block_files(folder), "corners": 40}}
        above = meadow.ABOVE * np.cbrt(field.mass / DENSITY / (4.0 / 3.0 * np.pi))
    _write_stops(folder / "stops.csv")
    return {
        "terrain": {"files": [{"path": str(tschamut.DATA / "terrain.asc"), "zone": "meadow"}]},
        "observed": {"points_file": "stops.csv", "along": [*np.round(field.axes[0][:2], 6).tolist(), 0.0]},
        "engine": "compiled", "stop_speed": 0.5, "seed": 1, "rock": rock, "sources": _runs(above),
    }  # fmt: skip


def _block_files(folder: Path) -> list[str]:
    """Write the shape of each block as an OBJ file into a folder; return the names of the files."""
    files = [f"block_{number}.obj" for number in meadow.blocks()]
    for file, (_, shape) in zip(files, meadow.blocks().values(), strict=True):
        (folder / file).write_text(obj_text(shape), encoding="utf-8")
    return files


def _write_stops(path: Path) -> None:
    """Write a CSV file with the stops of all runs, and the number (from 1) of the shape of each run's block."""
    order = list(meadow.blocks())
    rows = [[*end, order.index(block) + 1]
            for end, block in zip(tschamut.runs().end, meadow.block_of_run(), strict=True)]  # fmt: skip
    path.write_text("x,y,z,shape\n" + "\n".join(",".join(f"{v:g}" for v in row) for row in rows), encoding="utf-8")


def _runs(above: FloatArray) -> list[Raw]:
    """Return the sources of the scene, one for each run; above : (R,) m, height of the centre above the ground."""
    field, half = tschamut.runs(), tschamut.SPREAD
    return [
        {"name": name, "points": [[*field.release[i, :2].tolist(), 0.0]], "above_ground": round(float(above[i]), 3),
         "velocity": field.velocity[i].tolist(), "spread": [half, half, 0.0], "rocks": ROCKS_A_RUN}
        for i, name in enumerate(field.names)
    ]  # fmt: skip


def obj_text(shape: Polyhedron) -> str:
    """Return a polyhedron as the text of an OBJ file (m)."""
    corners = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in shape.corners]
    faces = ["f " + " ".join(str(corner + 1) for corner in face) for face in shape.faces]
    return "\n".join([*corners, *faces]) + "\n"


def main() -> int:
    """Write the scenes that are not shipped to the folder that the command line names."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for site in (AUTHUME, TSCHAMUT):
        for model in MODELS:
            if (site, model) not in SHIPPED:
                print(write_scene(folder, site, model))
    return 0


if __name__ == "__main__":
    sys.exit(main())
