"""Tests of the thesis' studies: their scenes differ in one respect only, and their verdicts follow the intervals."""

import json
from pathlib import Path

import pytest
from programs.command_line import ROOT, rpf3d
from scenes.small_pit import scene_file

from rpf3d_core.errors import InputError
from rpf3d_core.runs import thesis, thesis_report
from rpf3d_core.runs.compare import Counted
from rpf3d_core.runs.run import run_scene
from rpf3d_core.runs.thesis import LOCALISED, RESOLUTION, STUDIES, Printed, runs_of, scene_files, study_named
from rpf3d_core.runs.thesis_report import (
    ThesisColumn,
    report_of,
    report_section,
    stops_in_pit,
    verdict_of,
    write_report,
)
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.scene.zone_materials import material_of
from rpf3d_core.terrain.pit.synthetic import Pit

UNITS = {0: (0.5, 0.8), 1: (0.6, 0.8), 2: (0.5, 0.8), 3: (0.4, 0.7), 4: (0.5, 0.8), 5: (0.5, 0.8), 6: (0.25, 0.4)}
"""Unit -> (R_n, R_t), from table 5-3 of the thesis."""


def scenes():
    return {path.stem: read_scene(path) for study in STUDIES.values() for path in scene_files(study)}


def difference(one, other):
    """Return the keys in which two scenes differ."""
    a, b = (scene.model_dump(exclude={"path"}) for scene in (one, other))
    return {key for key in a if a[key] != b[key]}


def test_the_scenes_of_a_study_differ_in_one_thing_only():
    found = scenes()
    assert difference(found["study_low"], found["study_high"]) == {"terrain"}
    assert difference(found["study_high"], found["study_localised"]) == {"materials"}
    assert difference(found["study_high"], found["study_spills"]) == {"materials"}
    assert found["study_low"].terrain.pit == Pit(triangles=150_000, seed=1)
    assert found["study_high"].terrain.pit == Pit(triangles=2_332_287, seed=1)


def test_rocks_leave_the_west_wall_that_effects_are_measured_on_a_hundred_thousand_of_them():
    wall = read_scene(ROOT / "docs" / "effects_wall.yaml")
    for scene in scenes().values():
        assert scene.sources == tuple(source.model_copy(update={"rocks": 100_000}) for source in wall.sources)
        assert difference(wall, scene) <= {"terrain", "materials", "sources", "rebound", "ground", "hazard"}


@pytest.mark.parametrize(
    ("zone", "unit"),
    [
        ("face", 0), ("bench_1", 0), ("ground", 0), ("bench_2", 1), ("bench_6", 1), ("bench_7", 2), ("bench_10", 2),
        ("ramp", 3), ("bench_11", 4), ("bench_21", 4), ("floor", 5), ("spill", 6),
    ],
)  # fmt: skip
def test_every_zone_has_its_unit_of_table_5_3(zone, unit):
    material = material_of(scenes()["study_localised"], zone)
    assert (material.normal_restitution, material.tangential_restitution) == UNITS[unit]


def test_the_part_of_the_localised_study_is_its_spills():
    whole, part, general = (scenes()[f"study_{name}"] for name in ("localised", "spills", "high"))
    assert material_of(part, "spill") == material_of(whole, "spill") != material_of(general, "spill")
    assert material_of(part, "ramp") == material_of(general, "ramp") != material_of(whole, "ramp")


def finding(a, b, printed=(57.0, 38.0), total=100_000):
    thesis = [Counted(round(share * 0.21), 21) for share in printed]
    return ThesisColumn(Printed("ramp", ("ramp",), *printed), *thesis, Counted(a, total), Counted(b, total))


@pytest.mark.parametrize(
    ("a", "b", "printed", "verdict"),
    [
        (50_000, 40_000, (57.0, 38.0), "holds in sign"),
        (40_000, 50_000, (57.0, 38.0), "reversed"),
        (50_000, 50_100, (57.0, 38.0), "no difference"),
        (0, 0, (57.0, 38.0), "no rock stops there"),
        (50_000, 40_000, (27.0, 27.0), "a difference, where the thesis has none"),
        (50_000, 50_100, (27.0, 27.0), "no difference"),
    ],
)
def test_the_verdict_is_what_the_interval_and_the_sign_say(a, b, printed, verdict):
    assert finding(a, b, printed).verdict == verdict


def test_21_rocks_know_a_share_of_one_half_to_21_points_and_a_difference_to_30():
    assert thesis_report.half_width(Counted(50, 100)) * (100 / 21) ** 0.5 == pytest.approx(0.214, abs=1e-3)
    assert finding(50_000, 50_000).half_width_of_21 == pytest.approx(0.302, abs=1e-3)


def test_every_percentage_of_the_thesis_but_27_is_a_count_of_21():
    for study in STUDIES.values():
        for printed in study.printed:
            for share in (printed.a, printed.b):
                off = abs(100.0 * round(share * 0.21) / 21 - share)
                assert off < 1.0 or share == 27.0, (study.name, printed.area, share)


@pytest.mark.parametrize("study", [RESOLUTION, LOCALISED], ids=lambda study: study.name)
def test_none_of_the_thesis_differences_stands_out_from_chance_by_itself(study):
    for printed in study.printed:
        counts = [Counted(round(share * 0.21), 21) for share in (printed.a, printed.b)]
        low, high = ThesisColumn(printed, *counts, *counts).thesis_interval
        assert low <= 0.0 <= high


@pytest.fixture(scope="module")
def small_study(tmp_path_factory):
    """Yield the folder, the report and the runs of the localised study, flown on a small pit."""
    folder = tmp_path_factory.mktemp("study")
    files = [
        scene_file(folder, f"study_{name}.yaml", R_n, R_t, spills=60)
        for name, R_n, R_t in (("high", 0.5, 0.8), ("localised", 0.3, 0.5), ("spills", 0.4, 0.7))
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(thesis, "scene_files", lambda _: files)
        patch.setattr(thesis_report, "scene_files", lambda _: files)
        runs = runs_of(LOCALISED, folder / "out")
        for scene, into in runs:
            run_scene(scene, into, recording=False)
        yield folder / "out", report_of(LOCALISED, [into for _, into in runs]), runs


@pytest.mark.long
def test_a_study_reports_what_its_runs_found(small_study):
    _, report, runs = small_study
    assert [into.name for _, into in runs] == ["high", "localised", "spills"]
    for column, (scene, into) in zip(("a", "b", "part"), runs, strict=True):
        stops = stops_in_pit(into, scene)
        facts = json.loads((into / "summary.json").read_text())
        for found in report.findings:
            assert getattr(found, column) == Counted(sum(stops[zone] for zone in found.printed.zones), 100)
        assert stops["ramp"] == facts["stopped_in_zones"]["ramp"]["rocks"]
        benches = [name for name in facts["benches"] if name.startswith("bench_")]
        on_spills = sum(stops[name] - facts["stopped_in_zones"][name]["rocks"] for name in benches)
        assert on_spills == facts["stopped_in_zones"]["spill"]["rocks"] and stops.total() == 100


def test_the_report_is_written_for_people_and_for_programs(small_study):
    out, report, _ = small_study
    write_report(report, out)
    told = json.loads((out / "comparison.json").read_text())
    assert told == json.loads(json.dumps(report_section(report)))
    assert told["verdict"] == verdict_of(report) and "none stood out from chance" in told["verdict"]
    assert {"comparison", "spills_alone"} <= set(told) and len(told["findings"]) == 5
    text = (out / "comparison.md").read_text()
    assert verdict_of(report) in text and text.count("## ") == 2 and "| haulage ramp | 8 of 21 | 4 of 21 |" in text


def test_a_rock_on_a_spill_counts_with_the_bench_below_it(tmp_path):
    scene = scene_file(tmp_path)  # crest at 72 m, benches at 60, 48, 36, 24 and 12 m
    rows = [("spill", 60.4), ("spill", 59.8), ("spill", 71.0), ("spill", 50.0), ("spill", 13.0), ("face", 50.0)]
    lines = ["outcome,zone,z", *(f"stopped,{zone},{z}" for zone, z in rows), "left_terrain,spill,50"]
    (tmp_path / "deposits.csv").write_text("\n".join(lines))
    assert stops_in_pit(tmp_path, scene) == {"bench_1": 3, "bench_2": 1, "bench_5": 1, "face": 1}


def test_an_unknown_study_is_refused_with_the_names_of_those_there_are(tmp_path):
    with pytest.raises(InputError, match="no study 'reslution'; there are resolution, localised"):
        study_named("reslution")
    done = rpf3d("study", "reslution", "--out", tmp_path / "out")
    assert done.returncode == 2 and "there are resolution, localised" in done.stderr


def test_a_folder_of_something_else_is_refused_before_anything_flies(tmp_path):
    (tmp_path / "high").mkdir()
    (tmp_path / "high" / "thesis.doc").write_text("mine")
    with pytest.raises(InputError, match=r"high.*holds 'thesis.doc', but no result of rpf3d"):
        runs_of(RESOLUTION, tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds 'notes.txt', which is not of this study"):
        runs_of(RESOLUTION, tmp_path)


def test_scenes_that_are_not_installed_are_missed_by_name(monkeypatch, tmp_path):
    monkeypatch.setattr(thesis, "__file__", str(tmp_path / "site" / "rpf3d_core" / "thesis.py"))
    monkeypatch.setattr(thesis.sysconfig, "get_path", lambda _: str(tmp_path))
    with pytest.raises(InputError, match=r"study_low\.yaml is in none of"):
        scene_files(RESOLUTION)
    installed = tmp_path / "share" / "rpf3d" / "config" / "scenes"
    installed.mkdir(parents=True)
    for name in ("low", "high"):
        (installed / f"study_{name}.yaml").write_text("")
    assert [path.parent for path in scene_files(RESOLUTION)] == [Path(installed)] * 2


@pytest.mark.long
def test_the_command_flies_a_study_and_prints_its_verdict(tmp_path, monkeypatch, capsys):
    from rpf3d_core import cli

    files = [scene_file(tmp_path, f"study_{name}.yaml", R_n) for name, R_n in (("low", 0.5), ("high", 0.3))]
    for module in (thesis, thesis_report):
        monkeypatch.setattr(module, "scene_files", lambda _: files)
    cli.study("resolution", tmp_path / "out", rocks=30)
    printed = capsys.readouterr().out
    assert "With 30 rocks a run on the synthetic pit: first bench" in printed and "haulage ramp" in printed
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"low", "high", "comparison.json", "comparison.md"}
