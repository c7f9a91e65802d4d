"""Tests of the edited scene: refused edits change nothing, and files are written whole, where the user chooses."""

import os
from pathlib import Path

import pytest

from rpf3d_core.desk.scene_state import SceneState, opened, saved
from rpf3d_core.desk.scene_text import SOURCES, with_item, with_value
from rpf3d_core.errors import InputError
from rpf3d_core.scene.reading import read_scene

pytest.importorskip("ruamel.yaml", reason="the extra `desk` is not installed")

SCENES = Path(__file__).parents[2] / "config" / "scenes"


@pytest.fixture
def demo(tmp_path: Path) -> SceneState:
    path = tmp_path / "demo.yaml"
    path.write_text((SCENES / "demo.yaml").read_text())
    return opened(path)


def faster(state: SceneState) -> SceneState:
    return state.edited(lambda text: with_value(text, ("stop_speed",), 0.25))


def test_edits_are_taken_back_one_by_one(demo: SceneState) -> None:
    twice = faster(demo).edited(lambda text: with_value(text, ("seed",), 9))
    assert (twice.scene.stop_speed, twice.scene.seed, twice.unsaved) == (0.25, 9, True)
    assert twice.undone().scene.seed == 1
    assert twice.undone().undone() == demo and demo.undone() == demo and not demo.unsaved


def test_an_edit_that_makes_no_valid_scene_is_refused_with_the_sentence_of_the_command_line(demo: SceneState) -> None:
    path = ("materials", "spill", "normal_restitution")
    with pytest.raises(InputError, match=r"demo\.yaml, line \d+: `materials\.spill\.normal_restitution` is 3.*0 to 1"):
        demo.edited(lambda text: with_value(text, path, 3))
    twin = {"name": "west_wall", "points": [[0.0, 0.0, 0.0]]}
    with pytest.raises(InputError, match="names must differ"):
        demo.edited(lambda text: with_item(text, SOURCES, twin))


def test_a_scene_is_saved_in_a_new_file_by_default_and_runs(demo: SceneState) -> None:
    changed = faster(demo)
    kept = saved(changed, changed.default_path, replace=False)
    assert kept.path.name == "demo_desk.yaml" and not kept.unsaved
    assert read_scene(kept.path).stop_speed == 0.25 and read_scene(demo.path).stop_speed == 0.5
    assert "but the intervals of the results do not cover this" in kept.path.read_text(), "its comments are kept"
    assert kept.default_path == kept.path and kept.report_path.name == "demo_desk_report.html"
    assert sorted(path.name for path in kept.path.parent.iterdir()) == ["demo.yaml", "demo_desk.yaml"]


def test_an_existing_file_is_replaced_only_if_asked_and_keeps_its_permissions(demo: SceneState) -> None:
    os.chmod(demo.path, 0o640)
    with pytest.raises(InputError, match=r"demo\.yaml: exists; tick `replace the file if it exists`"):
        saved(faster(demo), demo.path, replace=False)
    assert not saved(faster(demo), demo.path, replace=True).unsaved
    assert read_scene(demo.path).stop_speed == 0.25 and demo.path.stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize("name", ["demo.txt", "no/where.yaml", "demo"])
def test_a_path_that_is_no_place_for_a_scene_is_refused(demo: SceneState, name: str) -> None:
    with pytest.raises(InputError):
        saved(demo, demo.path.parent / name, replace=True)


def test_a_scene_is_not_saved_where_its_files_are_not_found(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    state = opened(SCENES / "lab_40.yaml")
    with pytest.raises(InputError, match="there is no such file"):
        saved(state, tmp_path / "other" / "lab.yaml", replace=False)
    assert list((tmp_path / "other").iterdir()) == []
