"""Tests that `rpf3d materials` lists the library as scenes use it."""

import json

import pytest
from programs.command_line import call

from rpf3d_core.scene.library_entries import ENTRIES


def printed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert call(monkeypatch, "materials", *words) == 0
    return capsys.readouterr().out


def test_every_entry_has_a_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(monkeypatch, capsys).splitlines()
    for name, entry in ENTRIES.items():
        (line,) = [line for line in lines if line.split()[:1] == [name]]
        assert entry.ground in line and line.rstrip().endswith(entry.confirmed)
    assert any(line.startswith("hoek_bedrock") and "0.27-0.43" in line and "0.77-0.93" in line for line in lines)


def test_the_list_says_what_is_assumed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assumed = "10-45, rolling_friction of spheres 0.27-0.88, rolling_resistance of rocks with a shape 0-0.4."
    assert f"A scene then assumes a range: friction_angle_deg {assumed}" in printed(monkeypatch, capsys)


def test_one_entry_has_its_source(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    text = printed(monkeypatch, capsys, "pit_coal")
    assert "pyrockfall 0.1.2" in text and "friction_angle_deg" in text and "0.41" in text
    assert "assumed of spheres" in text


def test_one_entry_has_the_ranges_that_a_scene_assumes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (line,) = [x for x in printed(monkeypatch, capsys, "bedrock").splitlines() if x.startswith("friction_angle_deg")]
    assert line.split()[1:] == ["10", "45", "assumed"]
    facts = json.loads(printed(monkeypatch, capsys, "ramms_hard", "--json"))["ramms_hard"]
    assert set(facts["assumed"]) == {"rolling_resistance"}


def test_json_has_the_ranges(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    facts = json.loads(printed(monkeypatch, capsys, "ramms_hard", "--json"))["ramms_hard"]
    assert facts["ranges"] == {"restitution": 0.0, "friction": {"low": 0.55, "high": 2.0, "mean": None, "sd": None}}


def test_an_unknown_entry_is_refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(monkeypatch, "materials", "granite") == 2
    assert "there is no material 'granite' in the library" in capsys.readouterr().err
