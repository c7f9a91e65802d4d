"""Tests that tables and curves of a sweep state whether each interval includes the scene's unknowns."""

import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from scenes.sweeps import BERM, FENCE, SCENE, UNKNOWN, Here, road, written

from rpf3d_core.sweep.figures import PREDICTIVE, SAMPLING, Figure
from rpf3d_core.sweep.files import panels_of
from rpf3d_core.sweep.sweep import Sweep, sweep
from rpf3d_core.sweep.tables import figure_of, notes_of, run_rows, share_rows

R_N = "materials.default.normal_restitution"
BOTH = re.compile(r"[^()]+ \([\d.]+-[\d.]+; [\d.]+-[\d.?]+\)")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "road.geojson").write_text(road(20.0, 24.0))
    return tmp_path


def rows_of(found: Sweep, place: str) -> list[tuple[str, ...]]:
    return [row for row in share_rows(found.cells, found.records) if row[1] == place]


FAR_FENCE = FENCE.replace("[[14, -40], [14, 40]]", "[[20, -40], [20, 40]]").replace("5000", "0")
"""A fence without capacity, which rocks of only few parameter sets reach."""


def test_a_fence_that_few_sets_reach_is_not_under_the_predictive_note(folder: Path) -> None:
    scene = written(
        folder, (UNKNOWN + FAR_FENCE).replace("rocks: 60", "rocks: 640").replace("height: 1,", "height: 9,")
    )
    found = sweep(scene, {BERM: (4,)}, folder / "out", Here())
    note = notes_of(found.cells, found.records)[0]
    assert "predictive interval" in note
    assert "`sampling only`: the 95 % sampling interval of the number of rocks, which leaves the unknowns out" in note
    ((_, _, reached, retained),) = rows_of(found, "fence (barrier)")
    assert BOTH.fullmatch(reached), "every set may send a rock"
    assert re.fullmatch(r"[\d.]+ % \(sampling only [\d.]+-[\d.]+\)", retained)
    ((_, _, *shares),) = rows_of(found, "berm_1")
    assert all(BOTH.fullmatch(text) for text in shares)
    ((_, *percentiles),) = run_rows(found.cells, found.records)
    assert all(BOTH.fullmatch(text) for text in percentiles)
    panels = {panel.title: panel.curves[0] for panel in panels_of(found.varied, found.cells, found.records)}
    fence, runout = panels["retained by fence (barrier)"], panels["runout p95"]
    assert fence.is_predictive and fence.low == fence.high == [None], "no sampling interval as if it were all"
    assert runout.is_predictive and runout.low[0] is not None


def test_a_fence_that_all_sets_reach_has_both_intervals(folder: Path) -> None:
    scene = written(folder, (UNKNOWN + FENCE).replace("rocks: 60", "rocks: 640").replace("height: 1,", "height: 9,"))
    found = sweep(scene, {BERM: (4,)}, folder / "out", Here())
    ((_, _, reached, retained),) = rows_of(found, "fence (barrier)")
    assert BOTH.fullmatch(reached) and BOTH.fullmatch(retained)


def test_the_note_names_only_intervals_that_stand_in_the_tables(folder: Path) -> None:
    (folder / "road.geojson").write_text(road(6.0, 60.0))  # rocks of all sets reach it
    found = sweep(written(folder, UNKNOWN.replace("rocks: 60", "rocks: 400")), {BERM: (4,)}, folder / "out", Here())
    note, texts = notes_of(found.cells, found.records)[0], [*rows_of(found, "berm_1")[0], *rows_of(found, "floor")[0]]
    assert any(figure.interval == SAMPLING for figure in found.records[0].figures), "an energy of too few rocks"
    assert all("sampling only" not in text for text in texts)
    assert "sampling only" not in note


def test_without_unknowns_the_note_says_so_and_an_unknown_end_is_a_question_mark(folder: Path) -> None:
    found = sweep(written(folder, SCENE), {BERM: (4,)}, folder / "out", Here())
    assert notes_of(found.cells, found.records)[0].endswith("number of rocks; the scene has no unknowns")
    ((_, *percentiles),) = run_rows(found.cells, found.records)
    assert all(re.fullmatch(r"[\d.]+ \([\d.]+-\?\)", text) for text in percentiles), "60 rocks bound p95 from below"
    assert notes_of(found.cells, found.records)[-1] == "`?`: too few rocks determine this end of an interval"


def test_too_few_parameter_sets_for_any_predictive_interval_do_not_mean_no_unknowns(folder: Path) -> None:
    scene = written(folder, UNKNOWN.replace("rocks: 60", "rocks: 10"))
    found = sweep(scene, {BERM: (4,)}, folder / "out", Here())
    note, ((_, *percentiles),) = notes_of(found.cells, found.records)[0], run_rows(found.cells, found.records)
    assert "no unknowns" not in note
    assert all(re.fullmatch(r"[\d.]+ \(sampling only [\d.?]+-\?\)", text) for text in percentiles)


def band_of(intervals: Sequence[str], found: Sweep) -> tuple[bool, list[float | None]]:
    """Return whether the band of the runout curve is predictive, and its lower ends (m).

    intervals : kind of the interval of each cell
    """
    figures = [
        Figure("runout_p95", "", "", "m", 50.0, 1.0 if kind == PREDICTIVE else 40.0, 60.0, kind, 40.0, 60.0)
        for kind in intervals
    ]
    records = [record._replace(figures=(one,)) for record, one in zip(found.records, figures, strict=True)]
    curve = panels_of(found.varied, found.cells, records)[0].curves[0]
    return curve.is_predictive, list(curve.low)


def test_a_point_without_a_predictive_interval_has_none_and_the_others_keep_theirs(folder: Path) -> None:
    found = sweep(written(folder, SCENE), {BERM: (4, 5)}, folder / "out", Here())
    assert band_of((PREDICTIVE, PREDICTIVE), found) == (True, [1.0, 1.0])
    assert band_of((PREDICTIVE, SAMPLING), found) == (True, [1.0, None])
    assert band_of((SAMPLING, SAMPLING), found) == (False, [40.0, 40.0])


def test_a_cell_without_unknowns_next_to_one_with_them_is_marked(folder: Path) -> None:
    varied = {R_N: (0.4, {"prior": {"min": 0.2, "max": 0.6}})}
    scene = written(folder, SCENE.replace("rocks: 60", "rocks: 200"))
    found = sweep(scene, varied, folder / "out", Here())
    known, unknown = rows_of(found, "berm_1")
    assert "sampling only" in known[3]
    assert BOTH.fullmatch(unknown[3])


FLOOR = "terrain.benches.floor"


@pytest.mark.parametrize(("text", "rocks"), [(SCENE, 60), (UNKNOWN, 640)], ids=["known ground", "unknown ground"])
def test_a_runout_is_unknown_if_many_rocks_left_the_terrain(folder: Path, text: str, rocks: int) -> None:
    """Most rocks that reach a floor of 6 m leave the terrain; on a floor of 60 m none does."""
    (folder / "road.geojson").write_text(road(12.0, 15.0))
    text = text.replace("rocks: 60", f"rocks: {rocks}").replace("velocity: [2, 0, 0]", "velocity: [7, 0, 0]")
    scene = written(folder, text)
    found = sweep(scene, {FLOOR: (6, 60)}, folder / "out", Here())
    short, wide = (figure_of(record, "runout_p95") for record in found.records)
    left = figure_of(found.records[0], "left_terrain")
    assert short is not None and wide is not None and left is not None
    assert left.value is not None and left.value > 0.05
    assert short.value is None and short.high is None and short.sampling_high is None
    assert wide.value is not None
    rows = [row[1] for row in run_rows(found.cells, found.records)]
    assert rows[0] == "beyond the terrain" and rows[1] != rows[0]
    assert any("did not stop" in note for note in notes_of(found.cells, found.records))
    assert panels_of(found.varied, found.cells, found.records)[-3].unknown == "beyond the terrain"


def test_a_p95_runout_says_which_rocks_it_leaves_out(folder: Path) -> None:
    found = sweep(written(folder, SCENE), {BERM: (4,)}, folder / "out", Here())
    (record,) = found.records
    assert not any("of the rocks that stopped" in note for note in notes_of(found.cells, found.records))
    left = [each._replace(value=0.03) if each.result == "left_terrain" else each for each in record.figures]
    notes = notes_of(found.cells, [record._replace(figures=tuple(left))])
    assert any(note.startswith("runout p95 is that of the rocks that stopped; it leaves out the others, up to 3.00 %")
               for note in notes)  # fmt: skip
    assert not any("beyond the terrain" in note for note in notes)
