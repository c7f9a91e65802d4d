"""Tests that `rpf3d sweep` prints both tables, can continue after Ctrl-C, and refuses bad input in one sentence."""

import signal
import subprocess
from pathlib import Path

import pytest
from programs.command_line import COMMAND, call, environment, refused
from programs.waiting import wait_for

SCENE = """\
terrain: {benches: {number: 1, height: 10, floor: 60}}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8}}
sources: [{name: top, crest: 1, above_ground: 0.5, rocks: 40, velocity: [2, 0, 0]}]
engine: reference
"""
PATIENCE = 600.0
"""Longest time (s) of a sweep, which takes some seconds on an idle machine."""
ANGLES = "terrain.benches.face_angle_deg=60,75,90"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path / "scene.yaml"


def test_the_command_prints_both_tables_and_says_what_the_cells_share(
    scene: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = scene.parent / "out"
    assert call(monkeypatch, "sweep", scene, "--vary", ANGLES, "--out", out, "--workers", 1, "--rocks", 20) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "3 cells, of which 0 have flown before"
    assert lines[1:4] == [f"{done} of 3 cells have flown" for done in (1, 2, 3)], "a log shows that the sweep goes on"
    for angle in ("60", "75", "90"):
        assert sum(line.startswith(f"{angle} ") for line in lines) >= 2
    assert any("runout p95 (m)" in line for line in lines)
    assert any(line.startswith("all cells have seed 1") for line in lines)
    assert call(monkeypatch, "sweep", scene, "--vary", ANGLES, "--out", out, "--workers", 1, "--rocks", 20) == 0
    again = capsys.readouterr().out.splitlines()
    assert again == lines[4:], "no cell flies again, and the tables are the same"


@pytest.mark.long
def test_after_ctrl_c_the_same_command_goes_on(scene: Path) -> None:
    out, angles = scene.parent / "out", "terrain.benches.face_angle_deg=50:90:41"
    words = [*COMMAND, "sweep", str(scene), "--vary", angles, "--out", str(out), "--workers", "1"]
    process = subprocess.Popen(
        words, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    wait_for(lambda: list(out.glob("cells/*.json")) or process.poll() is not None, PATIENCE)
    assert process.poll() is None, "the sweep has ended before it was interrupted"
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert errors.startswith("rpf3d: interrupted; the cells that have flown are in")
    flown = {path.name: path.stat().st_mtime_ns for path in out.glob("cells/*.json")}
    assert 1 <= len(flown) < 41
    assert not list(out.glob("cells/.*")), "nothing half-written is left"
    subprocess.run(words, env=environment(), check=True, capture_output=True, timeout=PATIENCE)
    assert len(list(out.glob("cells/*.json"))) == 41
    assert all((out / "cells" / name).stat().st_mtime_ns == then for name, then in flown.items())


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--vary", "terrain.benches.angle=60,70"), "did you mean `face_angle_deg`?"),
        (("--vary", "terrain.benches.face_angle_deg"), "write --vary KEY=V1,V2,..."),
        (("--vary", ANGLES, "--workers", "0"), "--workers is 0; it must be at least 1"),
    ],
)
def test_a_wrong_command_is_refused(
    scene: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: tuple[str, ...],
    sentence: str,
) -> None:  # fmt: skip
    assert sentence in refused(monkeypatch, capsys, "sweep", scene, "--out", scene.parent / "out", *words)
