"""Tests that no rock stops on a bench face that is too steep for friction, unless the scene has `ground: none`."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from flights.scenes_of_facets import strip
from programs.command_line import call

import rpf3d_core as rpf3d
from rpf3d_core.results.mesh_writer import write_mesh
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome

ROCKS, HEIGHT, FACE = 500, 15.0, 70.0
FOOT = HEIGHT / math.tan(math.radians(FACE))
PARTS = {
    "crest": [(-20.0, HEIGHT), (0.0, HEIGHT)],
    "face": [(0.0, HEIGHT), (FOOT, 0.0)],
    "floor": [(FOOT, 0.0), (FOOT + 60.0, 0.0)],
}
SCENE = """\
terrain: {files: [{path: crest.vtp, zone: crest}, {path: face.vtp, zone: face}, {path: floor.vtp, zone: floor}]}
materials:
  default: {normal_restitution: 0.35, tangential_restitution: 0.85}
  floor: {normal_restitution: 0.3, tangential_restitution: 0.7, friction_angle_deg: 32}
rebound: constant
sources: [{name: crest, points: [[0.05, 0, 15.02]], rocks: 500, velocity: [0.4, 0, 0], velocity_spread: [0.3, 1, 0]}]
"""


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """Return the scene file of a 15 m bench with a face of 70 degrees; all surfaces are planes, as in a design."""
    for zone, profile in PARTS.items():
        write_mesh(tmp_path / f"{zone}.vtp", strip(profile, half_width=40.0))
    (tmp_path / "bench.yaml").write_text(SCENE)
    return tmp_path / "bench.yaml"


def hanging(bench: Path, more: str, engine: str, rocks: int) -> int:
    """Run the scene with the YAML text `more` appended; return the number of rocks that stopped on the face."""
    bench.write_text(SCENE + more)
    run = rpf3d.simulate(bench, rocks, engine=engine)
    ends = run.flights.deposits
    face = run.terrain.zone[ends.facet] == run.terrain.zones.index("face")
    return int(np.sum(face & (ends.outcome == Outcome.STOPPED)))


@pytest.mark.parametrize(("engine", "rocks"), [("reference", 50), ("compiled", ROCKS)])
def test_no_rock_rests_on_a_face_of_70_degrees(bench: Path, engine: str, rocks: int) -> None:
    assert hanging(bench, "", engine, rocks) == 0


def test_rocks_hang_on_the_face_where_the_scene_says_so(bench: Path) -> None:
    """As in the thesis: without a ground model, rocks stop on this face."""
    assert hanging(bench, "ground: none\n", "compiled", ROCKS) == ROCKS


def printed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], bench: Path, command: str) -> str:
    """Return the output of a command about the scene, with single blanks between words."""
    out = ("--out", bench.parent / "out") if command == "run" else ()
    assert call(monkeypatch, command, bench, "--rocks", 3, *out) == 0
    return " ".join(capsys.readouterr().out.split())


@pytest.mark.long
@pytest.mark.parametrize("command", ["run", "check"])
def test_what_is_printed_names_the_materials_with_the_default_friction_angle(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], bench: Path, command: str
) -> None:
    text = printed(monkeypatch, capsys, bench, command)
    assert "`friction_angle_deg` is not given for default: the default of 30 degrees is used" in text


def test_nothing_is_said_of_friction_that_no_model_asks_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], bench: Path
) -> None:
    bench.write_text(SCENE + "ground: none\n")
    assert "friction_angle_deg" not in printed(monkeypatch, capsys, bench, "run")


@pytest.mark.long
def test_the_sentence_of_a_rock_stopped_without_a_ground_model_says_what_is_not_asked(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], bench: Path
) -> None:
    """The sentence is on the screen, in the summary and in the recording; with `sliding` the rock stopped."""
    sentences = {}
    for ground in ("none", "sliding"):
        bench.write_text(f"{SCENE}ground: {ground}\n")
        shutil.rmtree(bench.parent / "out", ignore_errors=True)
        text = printed(monkeypatch, capsys, bench, "run")
        summary = json.loads((bench.parent / "out" / "summary.json").read_text())
        sentences[ground] = summary["outcomes"]["stopped"]["sentence"]
        assert sentences[ground].split()[0] in text
    assert "`ground: none` does not ask whether friction holds it" in sentences["none"]
    assert sentences["sliding"] == OUTCOME_SENTENCES[Outcome.STOPPED]
    assert summary["scene"]["materials_with_default_friction"] == ["default"]
