"""Tests that `new`, `run`, `sweep` and, at its top, the report note a terrain in a wrong unit."""

import json
from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import grid, with_models, write_binary_stl
from programs.command_line import rpf3d
from scenes.sweeps import Here

from rpf3d_core.report.report import write_report
from rpf3d_core.sweep.sweep import sweep
from rpf3d_core.sweep.warnings import warnings_of_cells

NOTE = "the terrain is larger than any slope, 10000 m wide and 5000 m high: is it in millimetres, centimetres or "
SCENE = """\
terrain: {files: [{path: pit.stl}]}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8, friction_angle_deg: 35}}
sources: [{name: top, points: [[4100, 3000, 0]], above_ground: 50, rocks: 12}]
engine: reference
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """Return the path of a scene with a face of 50 m whose file is in centimetres but is read in metres."""
    vertices, triangles = grid(7, 11, 10.0)
    vertices[:, 2] = np.interp(vertices[:, 0], [40.0, 60.0], [50.0, 0.0])
    write_binary_stl(tmp_path / "pit.stl", 100.0 * vertices[triangles])
    (tmp_path / "scene.yaml").write_text(with_models(SCENE, ground="sliding"))
    return tmp_path / "scene.yaml"


def test_a_run_prints_and_keeps_the_note_and_its_report_begins_with_it(scene: Path) -> None:
    done = rpf3d("run", scene, "--out", scene.parent / "out")
    assert done.returncode == 0 and done.stderr.count(f"note: {NOTE}") == 1, done.stderr
    inputs = json.loads((scene.parent / "out" / "inputs.json").read_text(encoding="utf-8"))
    assert inputs["warnings"][0].startswith(NOTE) and inputs["surer_than_it_may_be"]
    pytest.importorskip("plotly", reason="plotly is not installed: it is in the extra `report`")
    write_report(scene.parent / "out", scene.parent / "r.html")
    page = (scene.parent / "r.html").read_text(encoding="utf-8")
    assert f"<strong>Read first</strong><ul><li>T{NOTE[1:]}" in page


def test_a_new_scene_of_the_file_is_written_with_the_note_and_the_check_comes_next(scene: Path) -> None:
    folder = scene.parent / "site"
    done = rpf3d("new", folder, "--terrain", scene.parent / "pit.stl")
    assert done.returncode == 0 and f"note: {NOTE}" in done.stderr, done.stderr
    assert done.stdout.endswith(
        f"next: rpf3d check {folder / 'scene.yaml'}\nthen: rpf3d run {folder / 'scene.yaml'} --out OUT\n"
    )


def test_a_sweep_has_the_note_once_and_first(scene: Path) -> None:
    varied = {"materials.default.normal_restitution": (0.3, 0.4)}
    found = sweep(scene, varied, scene.parent / "out", Here())
    first, *others = warnings_of_cells(found.cells, found.records)
    assert first.startswith(f"2 of 2 cells: {NOTE}") and not any(NOTE in other for other in others)


def test_a_terrain_in_its_unit_has_no_note(scene: Path) -> None:
    text = scene.read_text().replace("pit.stl", "pit.stl, unit: cm").replace("4100, 3000", "41, 30")
    scene.write_text(text.replace("above_ground: 50", "above_ground: 0.5"))
    done = rpf3d("run", scene, "--out", scene.parent / "out")
    assert done.returncode == 0 and "m wide" not in done.stderr, done.stderr
