"""Tests that a sweep flies each combination of values once, like a run with these values, and stores the result."""

from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
from scenes.sweeps import ANGLE, BERM, FENCE, SCENE, UNKNOWN, Here, road, table, written

import rpf3d_core as rpf3d
from rpf3d_core.hazard.benches import bench_table
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.sweep.files import panels_of
from rpf3d_core.sweep.sweep import Sweep, sweep
from rpf3d_core.sweep.tables import figure_of, notes_of, run_rows, share_rows


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "road.geojson").write_text(road(20.0, 24.0))
    return written(tmp_path, SCENE)


def swept(scene: Path, berms: tuple[Any, ...], executor: Executor, **more: tuple[Any, ...]) -> Sweep:
    varied = {BERM: berms, **({ANGLE: more["angles"]} if "angles" in more else {})}
    return sweep(scene, varied, scene.parent / "out", executor)


def test_each_cell_is_a_run_of_the_scene_with_its_values(scene: Path) -> None:
    found = swept(scene, (3, 6.5), Here(), angles=(70, 90))
    assert [tuple(cell.values.values()) for cell in found.cells] == [(3, 70), (3, 90), (6.5, 70), (6.5, 90)]
    for cell, record in zip(found.cells, found.records, strict=True):
        run = rpf3d.simulate(with_values(read_scene(scene), dict(cell.values)))
        for bench in bench_table(run.terrain, run.maps):
            for name in ("reached", "stopped", "retained"):
                figure, share = figure_of(record, name, (bench.kind, bench.name)), getattr(bench, name)
                assert figure is not None and figure.value == share["share"]
                assert [figure.low, figure.high] == list(share["interval_95"] or (None, None))
        runout = figure_of(record, "runout_p95")
        assert runout is not None and runout.value == run.totals.runout.summary((95,))["p95"]
        assert (runout.low, runout.high) == run.totals.runout.interval(95)


def test_the_table_has_a_row_for_each_figure_of_each_cell(scene: Path) -> None:
    found = swept(scene, (3, 6), Here())
    rows = table(scene)
    assert len(rows) == sum(len(record.figures) for record in found.records)
    assert {row[BERM] for row in rows} == {"3", "6"}
    assert {row["place"] for row in rows} == {"", "crest", "face_1", "berm_1", "face_2", "floor", "road"}
    for row in rows:
        assert (scene.parent / "out" / "cells" / row["cell"] / "summary.json").is_file()
        assert row["interval"] == "sampling" and row["low"] == row["sampling_low"]
    assert (scene.parent / "out" / "sweep.png").stat().st_size > 10_000


def test_more_values_fly_the_new_cells_only_and_old_results_stay(scene: Path) -> None:
    first = swept(scene, (3, 6), once := Here())
    kept = {path: path.stat().st_mtime_ns for path in (scene.parent / "out" / "cells").iterdir()}
    more = swept(scene, (3, 5, 6), again := Here())
    assert (once.flown, again.flown) == (2, 1)
    assert (more.records[0], more.records[2]) == first.records
    assert all(path.stat().st_mtime_ns == then for path, then in kept.items())


def test_a_changed_file_that_the_scene_names_flies_the_cells_again(scene: Path) -> None:
    swept(scene, (3,), Here())
    (scene.parent / "road.geojson").write_text(road(12.0, 30.0))
    changed = swept(scene, (3,), again := Here())
    assert again.flown == 1
    reached = figure_of(changed.records[0], "reached", ("area", "road"))
    assert reached is not None and reached.value == 1.0


def test_an_interrupted_sweep_goes_on_where_it_stopped(scene: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        swept(scene, (3, 4, 5), Here(ends=2))
    assert not (scene.parent / "out" / "sweep.csv").exists()
    swept(scene, (3, 4, 5), rest := Here())
    assert rest.flown == 1
    assert {row[BERM] for row in table(scene)} == {"3", "4", "5"}


@pytest.mark.parametrize("content", ["", "{}", "[]", '{"digest": "x", "version": "y", "rocks": 1, "figures": [{}]}'])
def test_a_damaged_record_is_flown_again(scene: Path, content: str) -> None:
    whole = swept(scene, (3,), Here())
    (scene.parent / "out" / "cells" / f"{whole.cells[0].name}.json").write_text(content)
    assert swept(scene, (3,), again := Here()).records == whole.records
    assert again.flown == 1


def test_processes_find_the_same_table(scene: Path) -> None:
    swept(scene, (3, 6), Here())
    here = (scene.parent / "out" / "sweep.csv").read_bytes()
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        sweep(scene, {BERM: (3, 6)}, scene.parent / "processes", pool)
    assert (scene.parent / "processes" / "sweep.csv").read_bytes() == here


def test_a_cell_that_is_refused_is_named_and_the_others_are_kept(scene: Path) -> None:
    written(scene.parent, SCENE.replace("crest: 1, above_ground: 0.5", "points: [[1, 0, 25]]"))
    with pytest.raises(rpf3d.InputError, match=r"cell sources\.top\.points \[\[-1, 0, 5\]\]"):
        sweep(scene, {"sources.top.points": (((1, 0, 25),), ((-1, 0, 5),))}, scene.parent / "out", Here())
    assert sweep(scene, {"sources.top.points": (((1, 0, 25),),)}, scene.parent / "out", rest := Here())
    assert rest.flown == 0


def test_intervals_are_predictive_where_the_scene_has_unknowns(scene: Path) -> None:
    found = swept(written(scene.parent, UNKNOWN.replace("rocks: 60", "rocks: 640")), (4,), Here())
    retained = figure_of(found.records[0], "retained", ("zone", "berm_1"))
    assert retained is not None and retained.interval == "predictive"
    assert None not in retained
    low, high = retained.sampling_low or 0.0, retained.sampling_high or 0.0
    assert (retained.low or 0.0) < low < high < (retained.high or 1.0)
    assert "predictive interval" in notes_of(found.cells, found.records)[0]
    text = next(row for row in share_rows(found.cells, found.records) if row[1] == "berm_1")[3]
    assert text.count("-") == 2 and ";" in text


def test_a_fence_is_a_place_with_the_share_that_it_caught(scene: Path) -> None:
    written(scene.parent, (SCENE + FENCE).replace("height: 1,", "height: 20,"))
    key = "effects.barriers.panels.fence.capacity_kj"
    found = sweep(scene, {key: (0, 5000)}, scene.parent / "out", Here())
    low, high = (figure_of(record, "retained", ("barrier", "fence")) for record in found.records)
    assert low is not None and high is not None
    assert (low.value, high.value) == (0.0, 1.0)
    assert any(row[1] == "fence (barrier)" for row in share_rows(found.cells, found.records))
    assert panels_of(found.varied, found.cells, found.records)[0].title in (
        "retained by fence (barrier)", "reached road (area)",
    )  # fmt: skip


def test_the_panel_of_an_area_is_the_share_of_rocks_that_reach_it(scene: Path) -> None:
    """A road that retains few of the rocks that reach it is not clear."""
    (scene.parent / "road.geojson").write_text(road(1.0, 60.0))
    found = swept(scene, (3, 6.5), Here())
    panels = {panel.title: panel for panel in panels_of(found.varied, found.cells, found.records)}
    shares = [figure_of(record, "reached", ("area", "road")) for record in found.records]
    assert panels["reached road (area)"].curves[0].values == [100.0 * (share.value or 0.0) for share in shares if share]
    assert "retained by road (area)" not in panels
    zones = [title for title in panels if title.endswith(("berm_1", "floor"))]
    assert list(panels).index("reached road (area)") < min(map(list(panels).index, zones))


def test_the_picture_has_a_curve_for_each_combination_of_the_other_keys(scene: Path) -> None:
    found = swept(scene, (3, 6), Here(), angles=(70, 90))
    panels = panels_of(found.varied, found.cells, found.records)
    assert [panel.title for panel in panels[-3:]] == ["runout p95", "energy p95", "height p95"]
    for panel in panels:
        assert [curve.name for curve in panel.curves] == ["face angle 70 degrees", "face angle 90 degrees"]
        assert all(set(curve.at) <= {3, 6} for curve in panel.curves)  # a share of zero rocks is not drawn
    assert all(list(curve.at) == [3, 6] for curve in panels[-1].curves)
    energy = figure_of(found.records[3], "energy_p95")
    assert energy is not None
    assert panels[-2].curves[1].values[1] == pytest.approx((energy.value or 0.0) / 1000.0)


def test_words_are_values_too_and_rows_follow_the_cells(scene: Path) -> None:
    found = sweep(scene, {"rebound": ("constant", "coulomb_limited")}, scene.parent / "out", Here())
    assert [row[0] for row in run_rows(found.cells, found.records)] == ["constant", "coulomb_limited"]
    assert "common" not in notes_of(found.cells, found.records)[0]
    assert "all cells have seed 1" in notes_of(found.cells, found.records)[1]


def test_cells_of_different_seeds_are_not_said_to_be_alike(scene: Path) -> None:
    found = sweep(scene, {"seed": (1, 2)}, scene.parent / "out", Here())
    assert not any("all cells have seed" in note for note in notes_of(found.cells, found.records))


def refusals() -> Iterator[tuple[dict[str, Any], str]]:
    yield {"terrain.benches.bermm": (3, 4)}, "did you mean `berm`?"
    yield {BERM: (3, -1)}, "berm is -1"
    yield {"data_hint": ("one", "two")}, "two cells are the same run: data_hint one; and data_hint two"
    yield {BERM: (3, 3)}, "two cells are the same run"
    yield {}, "varies at least one key"
    yield {BERM: ()}, "has 0 values"
    yield {BERM: range(200), ANGLE: range(200)}, "40,000 cells, and 10,000 is the most"


@pytest.mark.parametrize(("varied", "sentence"), refusals())
def test_a_wrong_sweep_is_refused_before_a_rock_flies(scene: Path, varied: dict[str, Any], sentence: str) -> None:
    executor = Here()
    with pytest.raises(rpf3d.InputError) as caught:
        sweep(scene, varied, scene.parent / "out", executor)
    assert sentence in str(caught.value)
    assert executor.flown == 0
    assert not (scene.parent / "out").exists()


def test_a_folder_with_other_files_is_refused(scene: Path) -> None:
    with pytest.raises(rpf3d.InputError, match="which is not of a sweep"):
        sweep(scene, {BERM: (3,)}, scene.parent, Here())
