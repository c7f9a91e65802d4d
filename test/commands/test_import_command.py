"""Tests that `rpf3d import` writes a scene that `rpf3d check` and `rpf3d run` accept, or prints one sentence."""

from pathlib import Path

import pytest
from input_files.imported_folders import rockyfor3d_grids, stone_grids, write_folder
from programs.command_line import call, refused

GRIDS = {"rockyfor3d": rockyfor3d_grids, "stone": stone_grids}


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write no pictures and no recording, which take most of the time of a run and have their own tests."""
    monkeypatch.setattr("rpf3d_core.results.folder._write_pictures", lambda *_: None)
    monkeypatch.setattr("rpf3d_core.recordings.log.write_recording", lambda *_: None)


@pytest.mark.usefixtures("no_pictures")
@pytest.mark.parametrize("program", GRIDS)
def test_what_is_imported_is_checked_and_run_as_it_is(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, program: str
) -> None:
    folder = write_folder(tmp_path / "in", GRIDS[program]())
    assert call(monkeypatch, "import", program, folder, "--out", tmp_path / "scene") == 0
    said = capsys.readouterr().out
    assert "terrain: 14 by 12 cells of 5 m, 286 facets" in said
    assert "\nNot carried over:\n- " in said
    assert said.endswith(f"\nscene in {tmp_path / 'scene' / 'scene.yaml'}\n")
    assert call(monkeypatch, "check", tmp_path / "scene" / "scene.yaml") == 0
    assert call(monkeypatch, "run", tmp_path / "scene" / "scene.yaml", "--out", tmp_path / "out") == 0
    notes = capsys.readouterr().err.splitlines()
    unknown = (
        "the terrain states no coordinate reference system in metres; name it as `terrain.crs`, such as EPSG:32719"
    )
    same = [f"rpf3d: note: {unknown}"] * 2  # from check and from run
    assert notes == same, "an imported scene needs no other warning; .asc files state no system"


@pytest.mark.usefixtures("no_pictures")
def test_a_scene_folder_may_be_moved(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "in", rockyfor3d_grids())
    assert call(monkeypatch, "import", "rockyfor3d", folder, "--out", tmp_path / "scene") == 0
    (tmp_path / "scene").rename(tmp_path / "elsewhere")
    folder.rename(tmp_path / "away")
    assert call(monkeypatch, "check", tmp_path / "elsewhere" / "scene.yaml") == 0


@pytest.mark.parametrize("program", GRIDS)
def test_a_folder_without_grids_is_refused_in_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, program: str
) -> None:
    said = refused(monkeypatch, capsys, "import", program, tmp_path, "--out", tmp_path / "scene")
    assert said.startswith(f"{tmp_path}: has no dem.asc, ")
    assert list(tmp_path.iterdir()) == []


def test_a_scene_is_never_overwritten(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = write_folder(tmp_path / "in", stone_grids())
    said = refused(monkeypatch, capsys, "import", "stone", folder, "--out", folder)
    assert said == f"{folder}: is not empty; give the path of a new or empty folder"


def test_the_programs_are_listed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(monkeypatch, "import", "--help") == 0
    said = capsys.readouterr().out
    assert all(program in said for program in GRIDS)
