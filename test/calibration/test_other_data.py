"""Calibrations on other data than many end points: gates, counts, and few stops. Only a few parameter sets fly."""

import json
from pathlib import Path

import pytest
from recovery import MIDDLE, known_scene
from typer.testing import CliRunner, Result

from rpf3d_core.calibration import rounds, sampling, verdict
from rpf3d_core.cli import app
from rpf3d_core.jit.dispatch import HAS_NUMBA

pytestmark = pytest.mark.skipif(not HAS_NUMBA, reason="many parameter sets need the compiled engine")

STOPS = "observed: {points_file: stops.csv, along: [1, 0, 0]}\n"
GATE = "  gates: [{name: road, at: 60, speeds: [9, 10, 11, 12, 10.5]}]\n"
AREA = "areas_of_interest:\n  - {name: berm, polygons: [[40, -60], [90, -60], [90, 60], [40, 60]]}\n"
SHARE = "  shares: [{place: berm, stopped: 12, of: 30}, {place: berm, reached: 25, of: 30}]\n"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene with observed stops."""
    return known_scene(tmp_path_factory.mktemp("other"), 3, MIDDLE)[0]


@pytest.fixture(autouse=True)
def few_sets(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two rounds of 20 and 10 sets are enough to see what is written; their result is not refused."""
    monkeypatch.setattr(sampling, "FIRST_SETS", 10)
    monkeypatch.setattr(sampling, "FURTHER_SETS", 10)
    monkeypatch.setattr(rounds, "MOST_ROUNDS", 2)
    monkeypatch.setattr(verdict, "FLOOR", 1.0)


def calibrated(site: Path, out: Path, before: str, after: str) -> Result:
    """Calibrate the scene, with another text in place of one of its lines."""
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
