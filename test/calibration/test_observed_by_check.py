"""Tests that `rpf3d check` reads the observations of a calibration and reports those outside the terrain."""

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from rpf3d_core.calibration.observations import calibration_of
from rpf3d_core.cli import app
from rpf3d_core.errors import InputError
from rpf3d_core.runs.check import check_scene
from rpf3d_core.runs.check_calibration import observations_in_words
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.scene.unknowns import PriorSpec
from rpf3d_core.setup.prepared import prepare
from rpf3d_core.unknowns.parameter_sets import parameter_sets, write_parameter_sets

SCENE = """\
terrain: {files: [{path: slope.obj, zone: default}]}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8, friction_angle_deg: 32}}
rock: {density: 2700, mass: 500}
sources: [{name: top, points: [[10, 10, 9]], rocks: 10, velocity: [1, 0, 0]}]
rebound: constant
ground: sliding
engine: reference
observed: {points_file: stops.csv, along: [1, 0, 0], sections: {low: [20, null]}}
"""
ALL = "{normal_restitution: 0.3, tangential_restitution: 0.7, friction_angle_deg: 30}"
CALIBRATION = """\
calibration:
  unknowns: {materials.default.normal_restitution: {min: 0.2, max: 0.6}}
  mass_column: mass
  gates: [{name: near, at: 20, speeds: [5, 7]}, {name: far, at: 5000, speeds: [5]}]
  shares: [{place: low, stopped: 2, of: 3}]
"""


def written(folder: Path, calibration: str = CALIBRATION, stops: str = "30,20,400\n500,20,600\n20,-5,500\n") -> Path:
    (folder / "slope.obj").write_text("v 0 0 5\nv 50 0 0\nv 50 50 0\nv 0 50 5\nf 1 2 3\nf 1 3 4\n")
    (folder / "stops.csv").write_text("x,y,mass\n" + stops)
    path = folder / "scene.yaml"
    path.write_text(SCENE + calibration)
    return path


def test_a_doubtful_unit_of_the_masses_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, CALIBRATION.replace("mass_column: mass", "mass_column: mass_t"))
    (tmp_path / "stops.csv").write_text("x,y,mass_t\n30,20,0.4\n20,5,0.6\n")
    _, warnings = observations_in_words(prepare(read_scene(path)))
    assert [told for told in warnings if "'mass_t' is read as a unit" in told]


def test_the_observations_are_counted_and_those_outside_are_named(tmp_path: Path) -> None:
    lines, warnings = observations_in_words(prepare(read_scene(written(tmp_path))))
    assert lines == (
        "3 observed stops, along 20 .. 500 m, across -5 .. 20 m, masses 400 to 600 kg",
        "gate near at 20 m: 2 x speed, 5 to 7",
        "gate far at 5000 m: 1 x speed, 5 to 5",
        "low: 2 of 3 observed rocks stopped",
    )
    stops, gate, few, twice, exact = warnings
    assert stops.startswith("2 of 3 observed stops lie outside the terrain")
    assert "number 2 at (500, 20, 0), 3 at (20, -5, 0);" in stops
    assert gate.startswith("gate 'far' is at 5000 m, but the terrain reaches from 0 to 50 m")
    assert "only 3 end points were observed" in few
    assert "the counts of low are of 3 rocks, as many as there are end points" in twice
    assert "values count as exact (speed at far, speed at near)" in exact


def test_nothing_is_said_of_stops_on_the_terrain(tmp_path: Path) -> None:
    path = written(tmp_path, calibration="", stops="30,20,400\n49,1,600\n")
    assert observations_in_words(prepare(read_scene(path))) == ((), [])


def test_check_prints_them_and_what_calibrate_would_refuse(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["check", str(written(tmp_path))])
    assert result.exit_code == 0, result.output
    assert "3 observed stops" in result.output
    result = CliRunner().invoke(app, ["check", str(written(tmp_path, CALIBRATION.replace(": mass\n", ": weight\n")))])
    assert result.exit_code == 0, result.output
    assert "rpf3d calibrate would refuse this scene (the exit code is for rpf3d run)" in " ".join(result.output.split())
    assert "'weight', but the header has x, y, mass" in result.output


def test_check_names_the_unknowns_of_a_run_and_of_a_calibration_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path)
    prior = "tangential_restitution: {prior: {min: 0.5, max: 0.9}}"
    path.write_text(path.read_text().replace("tangential_restitution: 0.8", prior))
    monkeypatch.setattr("rpf3d_core.commands.check.screen", Console(width=300))  # for any terminal
    words = " ".join(CliRunner().invoke(app, ["check", str(path)]).output.split())
    of_a_run, of_calibrate = words.split("unknowns of a run ")[1].split("unknowns of calibrate ")
    assert "normal_restitution" not in of_a_run and "tangential_restitution" in of_a_run
    assert of_calibrate.startswith(
        "materials.default.normal_restitution (0.2 to 0.6); materials.default.tangential_restitution (0.5 to 0.9) "
    )


def test_check_leaves_out_the_unknowns_of_a_material_that_no_surface_has(tmp_path: Path) -> None:
    """Ranges of the library for `default` change nothing if each zone has a material of its own."""
    prior, own = "{prior: {min: 0.5, max: 0.9}}", "{normal_restitution: {prior: {min: 0.3, max: 0.4}}"
    text = SCENE.replace(", zone: default", "")
    text = text.replace("tangential_restitution: 0.8", f"tangential_restitution: {prior}")
    path = written(tmp_path, "")
    path.write_text(text.replace("materials: {", f"materials: {{terrain: {own}, tangential_restitution: 0.8}}, "))
    report = check_scene(read_scene(path))
    assert report.idle == ("default",) and report.scene.unknowns is not None
    assert report.scene.unknowns.describe(report.idle) == "64 parameter sets of materials.terrain.normal_restitution"


def test_check_leaves_out_the_material_of_a_zone_whose_facets_polygons_have_taken(tmp_path: Path) -> None:
    path = written(tmp_path, "zones: [{zone: all, polygons: all.geojson}]\n")
    path.write_text(path.read_text().replace("materials: {", f"materials: {{all: {ALL}, "))
    ring = [[-1, -1], [51, -1], [51, 51], [-1, 51], [-1, -1]]
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    text = json.dumps({"type": "FeatureCollection", "features": [feature]})
    (tmp_path / "all.geojson").write_text(text)
    assert check_scene(read_scene(path)).idle == ("default",)


def test_a_normal_prior_is_described() -> None:
    assert PriorSpec(min=0.2, max=0.6, mean=0.4, sd=0.1).describe() == "0.2 to 0.6, mean 0.4, sd 0.1"


def test_a_scene_with_a_sample_is_not_calibrated_without_its_sample(tmp_path: Path) -> None:
    path = written(tmp_path)
    write_parameter_sets(tmp_path / "sets.parquet", parameter_sets(["stop_speed"], np.full((50, 1), 0.1)))
    path.write_text(path.read_text() + "unknowns: {sets: 50, sample: sets.parquet, misfit: 1}\n")
    with pytest.raises(InputError, match=r"unknowns\.sample` gives the values of an earlier calibration"):
        calibration_of(read_scene(path))
