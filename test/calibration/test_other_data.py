"""Tests of calibrations on gates, counts and few stops, with few parameter sets."""

import json
from pathlib import Path

import pytest
from campaigns.recovery import BLOCKS, MIDDLE, known_scene
from typer.testing import CliRunner, Result

from rpf3d_core.calibration import rounds, sampling, verdict
from rpf3d_core.cli import app
from rpf3d_core.errors import InputError
from rpf3d_core.jit.dispatch import HAS_NUMBA

pytestmark = pytest.mark.skipif(not HAS_NUMBA, reason="many parameter sets need the compiled engine")

STOPS = "observed: {points_file: stops.csv, along: [1, 0, 0]}\n"
GATE = "  gates: [{name: road, at: 40, speeds: [9, 10, 11, 12, 10.5]}]\n"
AREA = "areas_of_interest:\n  - {name: berm, polygons: [[40, -60], [90, -60], [90, 60], [40, 60]]}\n"
SHARE = "  shares: [{place: berm, stopped: 12, of: 30}, {place: berm, reached: 25, of: 30}]\n"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of a scene with observed stops."""
    return known_scene(tmp_path_factory.mktemp("other"), 3, MIDDLE)[0]


@pytest.fixture(autouse=True)
def few_sets(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reduce calibrations to two small rounds, whose results are not refused."""
    monkeypatch.setattr(sampling, "FIRST_SETS", 10)
    monkeypatch.setattr(sampling, "FURTHER_SETS", 10)
    monkeypatch.setattr(rounds, "MOST_ROUNDS", 2)
    monkeypatch.setattr(verdict, "FLOOR", 1.0)


def calibrated(site: Path, out: Path, before: str, after: str) -> Result:
    """Calibrate the scene with the text `before` replaced by `after`; return the result of the command."""
    text, scene = site.read_text().replace("rocks: 400", "rocks: 64"), site.with_name(f"{out.name}.yaml")
    assert before in text
    scene.write_text(text.replace(before, after))
    return CliRunner().invoke(app, ["calibrate", str(scene), "--out", str(out), "--budget", "300"])


def content(out: Path) -> dict:
    return json.loads((out / "calibration.json").read_text())


@pytest.mark.parametrize(("name", "data"), [("gates", GATE), ("shares", SHARE)], ids=["gates", "shares"])
def test_a_calibration_without_end_points(site: Path, tmp_path: Path, name: str, data: str) -> None:
    out = tmp_path / name
    done = calibrated(site, out, STOPS + "calibration:\n", AREA + "calibration:\n" + data)
    assert done.exit_code == 0, done.output
    assert content(out)["coverage"] is None
    assert (content(out)["score"]["held_out"] is None) == (name == "shares")


def keep_stops(site: Path, number: int) -> str:
    """Write a file with the first `number` stops of the scene; return the scene text that names this file."""
    lines = (site.parent / "stops.csv").read_text().splitlines()
    (site.parent / f"{number}.csv").write_text("\n".join(lines[: number + 1]) + "\n")
    return STOPS.replace("stops.csv", f"{number}.csv")


@pytest.mark.parametrize("number", [1, 2])
def test_too_few_end_points_are_refused(site: Path, tmp_path: Path, number: int) -> None:
    done = calibrated(site, tmp_path / "few", STOPS, keep_stops(site, number))
    assert isinstance(done.exception, InputError)
    points = "1 end point is" if number == 1 else "2 end points are"
    assert f"{number}.csv: {points} too few" in str(done.exception)
    assert not (tmp_path / "few").exists()


def test_few_end_points_are_a_warning_with_their_number(site: Path, tmp_path: Path) -> None:
    out = tmp_path / "five"
    assert calibrated(site, out, STOPS, keep_stops(site, 5)).exit_code == 0
    assert "only 5 end points were observed" in content(out)["verdict"]


def test_two_end_points_and_a_gate_leave_the_misfit_unknown(site: Path, tmp_path: Path) -> None:
    out = tmp_path / "two"
    done = calibrated(site, out, STOPS + "calibration:\n", keep_stops(site, 2) + "calibration:\n" + GATE)
    assert done.exit_code == 0, done.output
    assert "the error of the model (misfit) is unknown" in content(out)["verdict"]
    assert "misfit: null" in (out / "calibrated.yaml").read_text()
    words = ["run", str(out / "calibrated.yaml"), "--out", str(tmp_path / "flown"), "--rocks", "2000"]
    flown = CliRunner().invoke(app, words)
    assert flown.exit_code == 0, flown.output
    assert "the sample states no misfit" in flown.output


def test_end_points_off_the_terrain(site: Path, tmp_path: Path) -> None:
    """One such point causes a warning with its number; a file without any end point on the terrain is refused."""
    header, *lines = (site.parent / "stops.csv").read_text().splitlines()
    (site.parent / "off.csv").write_text("\n".join([header, *lines[:6], "700,0,0", *lines[6:]]))
    (site.parent / "away.csv").write_text("x,y,z\n700,1,0\n710,2,0\n720,3,0\n")
    assert calibrated(site, tmp_path / "off", STOPS, STOPS.replace("stops", "off")).exit_code == 0
    assert f"1 of {BLOCKS + 1} end points lie off the terrain in plan or over a hole of it (number 7)" in (
        content(tmp_path / "off")["verdict"])  # fmt: skip
    refused = calibrated(site, tmp_path / "away", STOPS, STOPS.replace("stops", "away")).exception
    assert isinstance(refused, InputError)
    assert "away.csv: no end point lies on the terrain: it goes from (700, 1) to (720, 3)" in str(refused)


def test_values_at_gates_carry_no_error_of_the_model(site: Path, tmp_path: Path) -> None:
    """The verdict also names a gate that no rock passed."""
    out, data = tmp_path / "gate", GATE + "    - {name: far, at: 5000, speeds: [12]}\n"
    data = data.replace("gates: [{", "gates:\n    - {").replace("}]", "}")
    assert calibrated(site, out, "calibration:\n", "calibration:\n" + data).exit_code == 0
    verdict = content(out)["verdict"]
    assert "the values observed at far, road includes the measuring error, but not the error of the model" in verdict
    assert "no simulated rock fits the observations at the gate far (at 5000 m)" in verdict
    assert "at the gate road" not in verdict
    assert "values count as exact (speed at far, speed at road)" in verdict


def test_masses_in_another_unit_are_named_with_those_of_the_scene(site: Path, tmp_path: Path) -> None:
    lines = (site.parent / "stops.csv").read_text().splitlines()
    text = "\n".join([f"{lines[0]},weight", *(f"{line},0.5" for line in lines[1:])])
    (site.parent / "tonnes.csv").write_text(text + "\n")
    out, data = tmp_path / "tonnes", STOPS.replace("stops", "tonnes")
    done = calibrated(site, out, STOPS + "calibration:\n", data + "calibration:\n  mass_column: weight\n")
    assert done.exit_code == 0, done.output
    warned = "observed blocks is 0.5 kg, that of the scene's rocks 500 kg: check the unit of the masses"
    assert warned in content(out)["verdict"]
    checked = CliRunner().invoke(app, ["check", str(site.with_name("tonnes.yaml"))])
    assert warned in " ".join(checked.output.split())


def test_a_run_repeats_the_warnings_of_the_calibration_of_its_sample(site: Path, tmp_path: Path) -> None:
    out = tmp_path / "warned"
    assert calibrated(site, out, STOPS, keep_stops(site, 5)).exit_code == 0
    flown = CliRunner().invoke(
        app, ["run", str(out / "calibrated.yaml"), "--out", str(tmp_path / "run"), "--rocks", "2000"]
    )
    assert flown.exit_code == 0, flown.output
    assert f"the calibration of the sample warned: {content(out)['warnings'][0][:40]}" in " ".join(flown.output.split())


def test_counts_of_the_rocks_that_have_end_points(site: Path, tmp_path: Path) -> None:
    out = tmp_path / "twice"
    assert calibrated(site, out, "calibration:\n", AREA + "calibration:\n" + SHARE).exit_code == 0
    verdict = content(out)["verdict"]
    assert f"the counts of berm are of {BLOCKS} rocks, as many as there are end points" in verdict
    assert "keep one of them" not in verdict, "the advice is to leave them all out"


def test_several_counts_of_the_same_rocks(site: Path, tmp_path: Path) -> None:
    out = tmp_path / "several"
    shares = SHARE.replace(f"of: {BLOCKS}", "of: 40")
    assert calibrated(site, out, "calibration:\n", AREA + "calibration:\n" + shares).exit_code == 0
    assert "the counts stopped at berm, reached at berm are of 40 rocks each" in content(out)["verdict"]
