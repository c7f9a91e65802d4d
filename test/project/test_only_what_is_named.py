"""Tests that only the models and effects that a scene names are imported, compiled and drawn."""

import subprocess
import sys
from pathlib import Path

import pytest
from flights.compiled_loops import compiled_loops

from rpf3d_core.materials.streams import Purpose
from rpf3d_core.runs.check import check_scene
from rpf3d_core.scene.reading import read_scene

ROOT = Path(__file__).parents[2]
SCENE = """
terrain: {pit: {triangles: 2000}}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
sources:
  - {name: west, line: [[-570, -10, 0], [-570, 40, 0]], above_ground: 1.0, velocity: [3, 0, 0], rocks: 20}
outputs: {pictures: false, recording: false}
"""
IMPORTED = """
import sys, rpf3d_core
rpf3d_core.simulate(sys.argv[1], rocks=2, engine="reference")
print(*sorted(name for name in sys.modules if name.startswith("rpf3d_core.")))
"""
DEFAULT = [
    "rpf3d_core.effects.hooks", "rpf3d_core.kinetics.rebounds.coulomb_limited", "rpf3d_core.setup.builders",
    "rpf3d_core.setup.builders.hazard",
]  # fmt: skip
"""Modules under HOMES that every scene imports: for its maps and the default rebound model."""
HOMES = ("rpf3d_core.effects.", "rpf3d_core.kinetics.rebounds.", "rpf3d_core.setup.builders")
"""Beginnings of the names of modules with models and effects that a scene may name."""
OF_UNKNOWNS = (
    "rpf3d_core.unknowns", "rpf3d_core.hazard.by_set", "rpf3d_core.runs.over_sets", "rpf3d_core.setup.parameter_sets",
    "rpf3d_core.setup.unknowns", "rpf3d_core.scene.library_entries",
)  # fmt: skip
"""Modules that only a scene with unknowns needs."""


def scene_with(folder: Path, *lines: str) -> Path:
    """Write SCENE with further lines into the folder; return its path."""
    (folder / "scene.yaml").write_text(SCENE + "\n".join(lines) + "\n")
    return folder / "scene.yaml"


def test_a_scene_that_names_nothing_imports_nothing_of_it(tmp_path: Path) -> None:
    command = [sys.executable, "-c", IMPORTED, str(scene_with(tmp_path))]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    ours = [name for name in done.stdout.split() if name.startswith(HOMES)]
    assert "rpf3d_core.simulation.march" in done.stdout.split() and ours == DEFAULT


def test_a_scene_without_unknowns_imports_nothing_about_them(tmp_path: Path) -> None:
    unknown = ("unknowns: {sets: 40, priors: {materials.default.normal_restitution: {min: 0.4, max: 0.5}}}",)
    for lines, expected in (((), False), (unknown, True)):
        command = [sys.executable, "-c", IMPORTED, str(scene_with(tmp_path, *lines))]
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
        assert any(name.startswith(OF_UNKNOWNS) for name in done.stdout.split()) is expected


def test_a_scene_that_names_nothing_compiles_nothing_of_it(tmp_path: Path) -> None:
    pytest.importorskip("numba", reason="numba is not installed: nothing is compiled")
    import rpf3d_core

    rpf3d_core.simulate(scene_with(tmp_path), engine="compiled")
    plain = [loop for loop in compiled_loops() if "CoulombLimited" in loop.rebound]
    assert any(loop.effects == loop.sizes == loop.keys == "none" for loop in plain)


def test_no_two_purposes_draw_from_one_stream() -> None:
    assert len(Purpose.__members__) == len(set(Purpose)), "an alias would share the numbers of another purpose"


def test_a_check_says_which_ground_model_would_help(tmp_path: Path) -> None:
    slippery = SCENE.replace("tangential_restitution: 0.8", "tangential_restitution: 1.0")
    (tmp_path / "scene.yaml").write_text(slippery + "rebound: constant\nground: none\n")
    warnings = check_scene(read_scene(tmp_path / "scene.yaml")).warnings
    assert any("name `ground: sliding`" in warning for warning in warnings)
