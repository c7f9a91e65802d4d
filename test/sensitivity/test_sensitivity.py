"""Tests of the sensitivity of a scene: the unknown that determines a known fall, and the command."""

import json
from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import with_models
from typer.testing import CliRunner

from rpf3d_core.cli import app
from rpf3d_core.errors import InputError
from rpf3d_core.results.plots import sensitivity as tornado
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.sensitivity.analysis import Asked, Stopped, sensitivity
from rpf3d_core.sensitivity.flown import compared
from rpf3d_core.sensitivity.words import is_clear, sentence_of
from rpf3d_core.setup.prepared import prepare

SCENE = """\
terrain: {{files: [{{path: floor.obj, zone: default}}]}}
materials:
  default:
    normal_restitution: {R_n}
    tangential_restitution: 0.5
    friction_angle_deg: {angle}
sources: [{{name: ledge, points_file: ledge.csv, rocks: 4, velocity: [2, 0, 0]}}]
engine: reference
"""
RANGES = {"R_n": "{prior: {min: 0.2, max: 0.6}}", "angle": "{prior: {min: 20, max: 21}}"}
R_N = "materials.default.normal_restitution"
FEW = Asked(rocks=4, trajectories=8, base_sets=0)


def scene(folder: Path, **values: str) -> Path:
    (folder / "floor.obj").write_text("v -50 -50 0\nv 90 -50 0\nv 90 50 0\nv -50 50 0\nf 1 2 3\nf 1 3 4\n")
    (folder / "ledge.csv").write_text("x,y,z\n0,0,20\n")
    path = folder / "scene.yaml"
    path.write_text(with_models(SCENE.format(**{**RANGES, **values})))
    return path


def test_the_unknown_that_bounces_decides_the_runout(tmp_path: Path) -> None:
    found = sensitivity(scene(tmp_path), FEW)
    runout = found.results.index("mean runout")
    assert found.names == (R_N, "materials.default.friction_angle_deg")
    assert found.sets == 8 * 3
    assert is_clear(found, runout)
    assert sentence_of(found, runout).startswith(f"{R_N} decides the mean runout: moved by two thirds")
    energy = found.results.index("p95 energy")  # of the first impact, which no coefficient of the ground changes
    assert sentence_of(found, energy).startswith("no unknown moves the p95 energy")


def test_the_command_writes_its_files(tmp_path: Path) -> None:
    words = ["sensitivity", str(scene(tmp_path)), "--out", str(tmp_path / "out"), "--rocks", "4", "--trajectories", "4"]
    result = CliRunner().invoke(app, [*words, "--sobol", "8"])
    assert result.exit_code == 0, result.output
    assert "moves the mean runout most" in result.output or "decides the mean runout" in result.output
    content = json.loads((tmp_path / "out" / "sensitivity.json").read_text())
    assert content["sets"] == 4 * 3 + 8 * 4
    one = content["results"]["mean runout"]["unknowns"][R_N]
    assert set(one) == {"effect", "low", "high", "spread", "first", "total"}
    assert one["low"] <= one["effect"] <= one["high"]
    assert content["results"]["p95 energy"]["unknowns"][R_N]["total"]["share"] is None
    assert (tmp_path / "out" / "tornado.png").stat().st_size > 10_000


def test_a_scene_without_unknowns_and_wrong_numbers_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has no unknowns with a range"):
        sensitivity(scene(tmp_path, R_n="0.4", angle="30"), FEW)
    with pytest.raises(InputError, match="--trajectories is 1; it must be from 4"):
        sensitivity(scene(tmp_path), Asked(trajectories=1))


def test_a_stopped_analysis_ends(tmp_path: Path) -> None:
    flown = list[int]()
    with pytest.raises(Stopped):
        sensitivity(scene(tmp_path), FEW, lambda done, of: flown.append(done), lambda: len(flown) > 2)
    assert np.diff(flown).tolist() == [1, 1]


def test_a_scene_with_a_sample_is_refused_because_its_values_do_not_vary_one_by_one(tmp_path: Path) -> None:
    path = scene(tmp_path)
    (tmp_path / "posterior.parquet").touch()
    path.write_text(path.read_text() + "unknowns: {sample: posterior.parquet}\n")
    with pytest.raises(InputError, match=r"`unknowns.sample` gives the values of a calibration"):
        sensitivity(path, FEW)


def test_few_rocks_stand_for_the_whole_ledge(tmp_path: Path) -> None:
    path = scene(tmp_path)
    (tmp_path / "ledge.csv").write_text("x,y,z\n" + "".join(f"0,{y},20\n" for y in range(40)))
    y = compared(prepare(read_scene(path)), (R_N,), 10).releases.x[:, 1]
    assert np.ptp(y) >= 36  # the first ten points would span 9 m


def test_sources_that_never_flew_are_noted(tmp_path: Path) -> None:
    path = scene(tmp_path)
    sources = ", ".join(f"{{name: s{y}, points: [[0, {y}, 20]], rocks: 1}}" for y in range(8))
    lines = [f"sources: [{sources}]" if line.startswith("sources") else line for line in path.read_text().splitlines()]
    path.write_text("\n".join(lines))
    (sentence,) = sensitivity(path, FEW).left_out
    assert sentence.startswith("4 of 8 sources flew no rock")
    assert "--rocks" in sentence


def test_an_unknown_of_unknown_effect_is_the_lowest_bar_and_marked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figures = []
    monkeypatch.setattr(tornado, "save", lambda figure, path: figures.append(figure))
    sizes = np.array([[0.1], [np.nan], [0.3]])
    ends = np.stack([sizes - 0.05, sizes + 0.05])
    tornado.write_tornado(tmp_path / "t.png", ["low", "nan", "high"], [("runout", "m")], sizes, ends)
    labels = [label.get_text() for label in figures[0].axes[0].get_yticklabels()]
    assert labels == ["nan (unknown)", "low", "high"], "from the bottom to the top"
