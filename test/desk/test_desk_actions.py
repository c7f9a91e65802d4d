"""Tests of the user's actions on the desk, without a browser: results match the scene, no edit is lost silently."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from programs.waiting import wait_for

from rpf3d_core.desk.page import NO_RESULTS

if TYPE_CHECKING:
    from rpf3d_core.desk.app import Desk

LONGEST = 300.0
"""Time limit (s) of a wait for something that takes some seconds on an idle machine."""
SLOPE = """\
v -20 0 20\nv -20 40 20\nv 0 40 20\nv 0 0 20\nv 20 40 0\nv 20 0 0\nv 90 40 0\nv 90 0 0
f 1 4 3 2\nf 4 6 5 3\nf 6 8 7 5
"""
SCENE = """\
terrain: {files: [{path: slope.obj}]}
materials: {default: {normal_restitution: 0.3, tangential_restitution: 0.8, friction_angle_deg: 30}}
sources: [{name: crest, points: [[0.5, 20, 40]], rocks: 160, velocity_spread: [1, 1, 0]}]
unknowns: {sets: 40, priors: {"materials.*.friction_angle_deg": {min: 25, max: 35}}}
engine: reference
"""


@pytest.fixture(scope="module")
def served() -> Iterator[Desk]:
    """Yield a desk without a server: only the values of the page and the thread that simulates rocks."""
    for library in ("trame", "trame_vtk", "ruamel.yaml"):
        pytest.importorskip(library, reason="the extra `desk` is not installed")
    from rpf3d_core.desk.app import Desk

    desk = Desk()
    yield desk
    desk.close()


@pytest.fixture
def desk(served: Desk, tmp_path: Path) -> Desk:
    """Return the desk with a scene that was just opened and is ready to fly."""
    (tmp_path / "slope.obj").write_text(SLOPE)
    (tmp_path / "scene.yaml").write_text(SCENE)
    served.state.messages, served.state.ready = [], False
    served.open(tmp_path / "scene.yaml")
    until(served, lambda: served.state.ready)
    return served


def until(desk: Desk, done: Callable[[], Any]) -> list[dict[str, Any]]:
    """Do the work of the server's thread in this thread until `done()` is true; return the states shown meanwhile."""
    shown: list[dict[str, Any]] = []

    def step() -> bool:
        while desk._waiting:
            desk._waiting.pop(0)()
            shown.append({"progress": desk.state.progress, "notes": desk.state.notes, "last": desk.state.has_run})
        return bool(done())

    wait_for(step, LONGEST)
    return shown


def act(desk: Desk, name: str, *values: Any) -> list[str]:
    """Do an action of the page by its name; return the texts of the messages shown afterwards."""
    desk._with_message(getattr(desk, f"_{name}"))(*values)
    return [each["text"] for each in desk.state.messages]


def test_results_go_with_the_scene_that_they_are_of(desk: Desk) -> None:
    act(desk, "run")
    shown = until(desk, lambda: desk.state.has_run)
    first, last = next(each for each in shown if each["progress"]), shown[-1]
    assert first["progress"].startswith("preliminary: 40 of 160 rocks, ") and first["notes"]
    assert last["progress"].startswith("160 rocks, ") and desk.state.benches["rows"] and desk.state.legend
    assert act(desk, "edit", "default", "normal_restitution", "0.4") == []
    assert {key: desk.state[key] for key in NO_RESULTS} == NO_RESULTS
    until(desk, lambda: not desk.state.busy)
    assert desk.state.progress == ""


def test_the_outcomes_of_all_rocks_are_shown_and_rocks_that_left_the_terrain_are_warned_of(
    desk: Desk, tmp_path: Path
) -> None:
    (tmp_path / "slope.obj").write_text(SLOPE.replace("90", "24"))
    desk.open(tmp_path / "scene.yaml")
    act(desk, "run")
    until(desk, lambda: desk.state.has_run)
    header, rows = desk.state.outcomes["header"], desk.state.outcomes["rows"]
    assert header == ["outcome", "rocks", "share", "meaning"]
    left = {row[0]: row for row in rows}["left_terrain"]
    assert sum(int(row[1]) for row in rows) == 160
    assert "; " in left[2] and left[3] == "flew past the edge of the terrain"
    assert desk.state.notes[0].startswith(f"{left[1]} of 160 rocks (")
    assert "did not stop on the terrain" in desk.state.notes[0]


def test_an_outcome_without_a_known_interval_says_so(desk: Desk, tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE.replace("rocks: 160", "rocks: 20"))
    desk.open(tmp_path / "scene.yaml")
    act(desk, "run")
    until(desk, lambda: desk.state.has_run)
    assert desk.state.outcomes["rows"][0][2].startswith("100 % (not known; ")


def test_results_that_come_after_an_edit_are_not_shown(desk: Desk) -> None:
    act(desk, "run")
    wait_for(lambda: len(desk._waiting) > 2, LONGEST)
    act(desk, "edit", "default", "normal_restitution", "0.4")
    shown = until(desk, lambda: not desk.state.flying)
    assert {each["progress"] for each in shown} == {""} and not desk.state.has_run


def test_a_run_counts_for_the_file_in_which_its_scene_is_saved_afterwards(desk: Desk, tmp_path: Path) -> None:
    """Run, Save, Report: the report names the saved file, and no rock flies twice; also after an earlier report."""
    pytest.importorskip("plotly", reason="the extra `report` is not installed")
    act(desk, "edit", "default", "normal_restitution", "0.4")
    act(desk, "run")
    until(desk, lambda: desk.state.has_run)
    run = desk.runner._flown
    for name in ("one", "two"):
        desk.state.save_path = str(tmp_path / f"{name}.yaml")
        act(desk, "save")
        assert desk.state.has_run and not desk.state.unsaved
        act(desk, "report")
        until(desk, lambda: desk.state.messages)
        assert "report saved in" in desk.state.messages[0]["text"]
        assert f"{name}.yaml" in (tmp_path / f"{name}_report.html").read_text(encoding="utf-8")
    assert run is not None and desk.runner._flown is not None
    assert desk.runner._flown[1].flights is run[1].flights, "no rock has flown again"


def test_a_saved_scene_that_reads_other_files_must_fly_again(desk: Desk, tmp_path: Path) -> None:
    act(desk, "run")
    until(desk, lambda: desk.state.has_run)
    (tmp_path / "other").mkdir()
    (tmp_path / "other/slope.obj").write_text(SLOPE.replace("90", "80"))
    desk.state.save_path = str(tmp_path / "other/scene.yaml")
    assert any("lead to other files" in message for message in act(desk, "save")) and not desk.state.has_run


def test_a_coefficient_that_is_drawn_elsewhere_is_not_edited(desk: Desk) -> None:
    (material,) = desk.state.materials
    fixed = {value["key"]: value["fixed"] for value in material["values"]}
    why = "drawn from `unknowns.priors`, key path `materials.*.friction_angle_deg`; change it there"
    assert fixed == {"normal_restitution": "", "tangential_restitution": "", "friction_angle_deg": why}
    before = desk._opened().text
    (refusal,) = act(desk, "edit", "default", "friction_angle_deg", "20")
    assert refusal == f"`materials.default.friction_angle_deg` is {why}"
    assert desk._opened().text == before


def test_run_after_a_refused_edit_repeats_the_refusal_and_flies_no_rock_once(desk: Desk) -> None:
    (refusal,) = act(desk, "edit", "default", "normal_restitution", "3")
    (again,) = act(desk, "run")
    assert again.startswith(refusal) and "no rock has flown" in again and not desk.state.flying
    assert act(desk, "run") == [] and desk.state.flying
    until(desk, lambda: desk.state.has_run)
