"""Tests that a result folder is written completely or not at all, and never over other files."""

import csv
import json

import pytest
from flights.flights_on_a_floor import SURVEY, findings, floor, none_thrown, scene, thrown

from rpf3d_core.errors import InputError
from rpf3d_core.hazard.convergence import Place, Step
from rpf3d_core.results import folder as results
from rpf3d_core.results.earlier_results import read_summary
from rpf3d_core.results.folder import check_folder, result_folder, write_all_tables, write_findings

FILES = {
    "summary.json", "deposits.csv", "impacts.parquet", "trajectories.parquet", "terrain.vtp", "trajectories.vtp",
    "profiles", "map.png", "hazard", "run.rrd", "inputs.json",
}  # fmt: skip
PROFILES = {"overview.png", "overview.csv", "sections.png", "sections.csv"}


def record(path, facts):
    path.write_text(f"recording of {facts['rocks']} rocks")


def written(folder, tmp_path, flights=None, more="", record=record, **found):
    terrain = floor(SURVEY)
    made = findings(scene(tmp_path, more), terrain, flights or thrown(terrain), **found)
    with result_folder(folder) as part:
        write_all_tables(part, made)
        write_findings(part, made, record)
    return folder


@pytest.fixture
def no_pictures(monkeypatch):
    """Replace pictures by stand-ins: they take most of the time and do not matter for the folders."""

    def stand_ins(folder, *_):
        (folder / "map.png").write_bytes(b"map")
        (folder / "profiles").mkdir()

    monkeypatch.setattr(results, "_write_pictures", stand_ins)


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_a_run_leaves_all_files_of_the_design(tmp_path):
    folder = written(tmp_path / "out", tmp_path)
    assert names(folder) == FILES and names(folder / "profiles") == PROFILES
    assert {"zones.geojson", "benches.csv", "reach_probability.tif", "energy_p95.png"} <= names(folder / "hazard")
    assert names(tmp_path) == {"out", "floor.yaml"}
    assert all(path.stat().st_size > 0 for path in folder.rglob("*"))


@pytest.mark.long
def test_a_run_without_paths_has_no_profiles(tmp_path):
    folder = written(tmp_path / "out", tmp_path, more="outputs: {trajectories: 0}\n")
    assert names(folder) == FILES - {"profiles"}


@pytest.mark.long
def test_the_summary_in_the_folder_says_how_long_writing_took(tmp_path, no_pictures):
    facts = json.loads((written(tmp_path / "out", tmp_path) / "summary.json").read_text())
    assert facts["wall_s"] == 2.0 and facts["write_s"] > 0.0 and facts["rocks"] == 6
    assert facts["total_s"] == facts["wall_s"] + facts["write_s"]


@pytest.mark.long
def test_the_recording_is_given_the_summary(tmp_path, no_pictures):
    folder = written(tmp_path / "out", tmp_path)
    assert (folder / "run.rrd").read_text() == "recording of 6 rocks"
    assert "run.rrd" not in names(written(tmp_path / "bare", tmp_path, record=None))


@pytest.mark.long
def test_only_as_many_trajectories_as_asked_for_are_written(tmp_path):
    folder = written(tmp_path / "out", tmp_path, more="outputs: {trajectories: 2}\n")
    with (folder / "profiles" / "overview.csv").open(newline="") as file:
        assert {(line["source"], line["rock"]) for line in csv.DictReader(file)} == {("crest", "0"), ("ledge", "2")}


def test_a_run_without_impacts_leaves_no_table_of_them(tmp_path, no_pictures):
    folder = written(tmp_path / "out", tmp_path, more="outputs: {impacts: false}\n")
    assert names(folder) == FILES - {"impacts.parquet"}


@pytest.mark.long
def test_a_run_that_doubled_its_rocks_leaves_a_picture_of_how_its_answer_settled(tmp_path):
    steps = [Step(n, {"floor": Place(0.5, 0.4, 0.1, energy)}) for n, energy in ((1000, None), (2000, 5e3), (4000, 6e3))]
    folder = written(tmp_path / "out", tmp_path, steps=steps)
    assert names(folder) == FILES | {"convergence.png"}
    assert (folder / "convergence.png").read_bytes().startswith(b"\x89PNG")
    facts = json.loads((folder / "summary.json").read_text())["convergence"]
    assert [step["rocks"] for step in facts["steps"]] == [1000, 2000, 4000]
    assert facts["reached"] is False, "what was not known two doublings ago has not held still"


def test_a_run_that_was_interrupted_says_so(tmp_path, no_pictures):
    for planned, partial in ((6, False), (7, True)):
        facts = json.loads((written(tmp_path / "out", tmp_path, planned=planned) / "summary.json").read_text())
        assert (facts["partial"], facts["rocks"], facts["rocks_planned"]) == (partial, 6, planned)


def test_a_disk_without_room_is_refused_before_anything_else_and_left_clean(tmp_path, monkeypatch):
    monkeypatch.setattr(results, "LEAST_ROOM", 1 << 62)
    with pytest.raises(InputError, match="has no room"), result_folder(tmp_path / "out"):
        pytest.fail("it began to work")
    assert names(tmp_path) == set()


def test_a_run_of_no_rocks_leaves_all_files_but_profiles(tmp_path):
    assert names(written(tmp_path / "out", tmp_path, none_thrown())) == FILES - {"profiles"}


def test_folders_above_are_made(tmp_path, no_pictures):
    assert names(written(tmp_path / "a" / "b" / "out", tmp_path)) == FILES


def test_an_empty_folder_is_filled(tmp_path, no_pictures):
    (tmp_path / "out").mkdir()
    assert names(written(tmp_path / "out", tmp_path)) == FILES


def test_an_earlier_result_is_replaced_whole(tmp_path, no_pictures):
    folder = written(tmp_path / "out", tmp_path)
    (folder / "convergence.png").write_text("of an earlier run with rocks: auto")
    (folder / "deposits.csv").write_text("old")
    written(folder, tmp_path)
    assert names(folder) == FILES and names(tmp_path) == {"out", "floor.yaml"}
    assert (folder / "deposits.csv").read_text() != "old"


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "out").write_text("precious")
    with pytest.raises(InputError, match="is a file"):
        written(tmp_path / "out", tmp_path)
    assert (tmp_path / "out").read_text() == "precious"


def test_a_folder_of_something_else_is_refused_and_untouched(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.txt").write_text("precious")
    with pytest.raises(InputError, match="but no result of rpf3d"):
        written(tmp_path / "out", tmp_path)
    assert names(tmp_path / "out") == {"thesis.txt"}


@pytest.mark.parametrize("file", ["calibration.json", "state/plan.json"])
def test_the_folder_of_a_calibration_is_named_as_such_and_another_one_is_suggested(tmp_path, file):
    (tmp_path / "out" / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / "out" / file).write_text("{}")
    with pytest.raises(InputError, match=r"is the folder of a calibration, .* such as .*out_run$"):
        check_folder(tmp_path / "out")


@pytest.mark.parametrize(
    ("files", "words"),
    [
        (["calibration.json", "calibrated.yaml"], r"report\.md; fly .* `rpf3d run .*calibrated\.yaml --out RESULT`"),
        (["calibration.json"], r"refused calibration.*report\.md says what would help"),
        (["state/plan.json"], r"unfinished calibration.*`rpf3d calibrate` command continues it"),
    ],
)
def test_a_calibration_in_place_of_a_run_is_named_with_its_report_and_its_command(tmp_path, files, words):
    for file in files:
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_text("{}")
    with pytest.raises(InputError, match=words):
        read_summary(tmp_path)


def test_a_summary_of_another_program_does_not_make_a_result(tmp_path):
    (tmp_path / "out").mkdir()
    for content in ('{"program": "other"}', "[1, 2]", "no json"):
        (tmp_path / "out" / "summary.json").write_text(content)
        with pytest.raises(InputError, match="but no result of rpf3d"):
            check_folder(tmp_path / "out")


def test_a_result_with_somebodys_notes_in_it_is_not_replaced(tmp_path, no_pictures):
    folder = written(tmp_path / "out", tmp_path)
    (folder / "notes.txt").write_text("precious")
    with pytest.raises(InputError, match=r"notes\.txt"):
        written(folder, tmp_path)
    assert (folder / "notes.txt").read_text() == "precious"


def test_a_folder_below_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        check_folder(tmp_path / "file" / "out")


def test_a_failure_while_writing_leaves_nothing_behind(tmp_path, no_pictures):
    def fails(path, facts):
        raise RuntimeError("a fault of the program")

    with pytest.raises(RuntimeError, match="a fault of the program"):
        written(tmp_path / "out", tmp_path, record=fails)
    assert names(tmp_path) == {"floor.yaml"}


def test_a_failure_while_writing_leaves_the_earlier_result(tmp_path, no_pictures):
    def fails(path, facts):
        raise KeyboardInterrupt

    folder = written(tmp_path / "out", tmp_path)
    before = (folder / "summary.json").read_bytes()
    with pytest.raises(KeyboardInterrupt):
        written(folder, tmp_path, record=fails)
    assert names(tmp_path) == {"out", "floor.yaml"}
    assert (folder / "summary.json").read_bytes() == before


def test_if_the_last_step_fails_the_earlier_result_returns(tmp_path, no_pictures, monkeypatch):
    folder = written(tmp_path / "out", tmp_path)
    rename = type(folder).rename

    def refuses_the_new(path, target):
        if path.name.endswith(".part"):
            raise OSError("no")
        return rename(path, target)

    monkeypatch.setattr(type(folder), "rename", refuses_the_new)
    with pytest.raises(InputError, match=r"could not be written \(no\)"):
        written(folder, tmp_path)
    assert names(folder) == FILES and names(tmp_path) == {"out", "floor.yaml"}


def test_the_names_that_may_be_replaced_are_those_that_are_written(tmp_path, no_pictures):
    assert names(written(tmp_path / "out", tmp_path)) <= results.RESULT_NAMES
