"""Tests that a sweep repeats the warnings of its runs: each once, with its number of cells; outcomes are figures."""

from pathlib import Path
from typing import Any

import pytest
from programs.command_line import call
from scenes.sweeps import ANGLE, BERM, FENCE, SCENE, UNKNOWN, Here, road, table, written

import rpf3d_core as rpf3d
from rpf3d_core.results.notes import warnings_of_run
from rpf3d_core.results.overconfidence import surer_than_it_may_be
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.sweep.cells import cells_of
from rpf3d_core.sweep.sweep import Sweep, sweep
from rpf3d_core.sweep.tables import figure_of
from rpf3d_core.sweep.varied import Varied
from rpf3d_core.sweep.warnings import places_that_stay, surer_cells, warnings_of_cells
from rpf3d_core.values import Outcome

FRICTION = "materials.default.friction_angle_deg"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "road.geojson").write_text(road(20.0, 24.0))
    return written(tmp_path, SCENE)


def swept(scene: Path, varied: dict[str, tuple[Any, ...]]) -> Sweep:
    return sweep(scene, varied, scene.parent / "out", Here())


def test_a_cell_keeps_the_sentences_of_its_run(scene: Path) -> None:
    found = swept(scene, {FRICTION: (0.5, 30)})
    for cell, record in zip(found.cells, found.records, strict=True):
        run = rpf3d.simulate(with_values(read_scene(scene), dict(cell.values)))
        assert record.warnings == tuple(warnings_of_run(run))
        assert record.surer == tuple(surer_than_it_may_be(run))
    assert found.records[0].warnings
    assert swept(scene, {FRICTION: (0.5, 30)}).records == found.records, "also from the records of the cells"


def test_each_sentence_comes_once_with_the_number_of_its_cells(scene: Path) -> None:
    found = swept(scene, {FRICTION: (0.5, 0.6, 30)})
    sentences = warnings_of_cells(found.cells, found.records)
    (friction,) = (text for text in sentences if f"`{FRICTION}` is" in text)
    assert friction.startswith(f"2 of 3 cells (the numbers are those of {FRICTION} 0.5): `{FRICTION}` is 0.5 degrees")
    assert any(text.startswith("3 of 3 cells: every coefficient counts as known")
               for text in surer_cells(found.cells, found.records))  # fmt: skip


def test_names_with_different_numbers_are_different_sentences(scene: Path) -> None:
    found = swept(scene, {FRICTION: (29, 30)})
    records = [
        record._replace(warnings=(f"berm_{number}: {number} rocks of 1,200.5",), surer=(f"{number}.5 m",))
        for number, record in enumerate(found.records, start=1)
    ]
    assert warnings_of_cells(found.cells, records) == [
        f"1 of 2 cells: berm_{number}: {number} rocks of 1,200.5" for number in (1, 2)
    ]
    assert surer_cells(found.cells, records) == [f"2 of 2 cells (the numbers are those of {FRICTION} 29): 1.5 m"]


def test_the_command_prints_them(
    scene: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    vary, out = f"{FRICTION}=0.5,30", scene.parent / "out"
    assert call(monkeypatch, "sweep", scene, "--vary", vary, "--out", out, "--workers", 1) == 0
    printed = capsys.readouterr()
    assert f"rpf3d: note: 1 of 2 cells: `{FRICTION}` is 0.5 degrees" in printed.err
    assert "less certain than it looks:\n- 2 of 2 cells: every coefficient counts as known" in printed.out


def test_outcomes_are_figures_of_the_whole_run(scene: Path) -> None:
    text = SCENE.replace("floor: 60", "floor: 14").replace("rocks: 60, velocity: [2", "rocks: 200, velocity: [9")
    found = swept(written(scene.parent, text), {BERM: (4,)})
    run = rpf3d.simulate(with_values(read_scene(scene), {BERM: 4}))
    for outcome in Outcome:
        figure = figure_of(found.records[0], outcome.name.lower())
        assert figure is not None
        assert figure.value == run.totals.outcomes[outcome] / 200
    left = figure_of(found.records[0], "left_terrain")
    assert left is not None
    assert left.value
    (row,) = [row for row in table(scene) if row["result"] == "left_terrain"]
    assert (row["kind"], row["place"], float(row["value"])) == ("", "", left.value)


def test_cells_with_too_few_parameter_sets_are_named(scene: Path) -> None:
    written(scene.parent, UNKNOWN)
    found = swept(scene, {"sources.top.rocks": (30, 45)})
    assert [record.sets for record in found.records] == [30, 45]
    (few,) = (text for text in warnings_of_cells(found.cells, found.records) if "parameter sets" in text)
    assert few.startswith("fewer than 39 parameter sets have flown in the cells sources.top.rocks 30 (30): their")
    for record, interval in zip(found.records, ("sampling", "predictive"), strict=True):
        outcome = figure_of(record, "stopped")
        assert outcome is not None
        assert outcome.interval == interval


def words_on_places(scene: Path, key: str, values: tuple[Any, ...]) -> list[str]:
    return places_that_stay(cells_of(read_scene(scene), [Varied(key=key, values=values)]))


@pytest.mark.parametrize(
    ("key", "values"),
    [
        (BERM, (4, 5)), (ANGLE, (60, 70)), ("terrain.benches.height", (9, 10)), ("terrain.benches.number", (2, 3)),
        ("terrain", ({"benches": {"berm": 4, "number": 2}}, {"benches": {"berm": 5, "number": 2}})),
    ],
)  # fmt: skip
def test_places_with_coordinates_are_named_when_the_slope_moves(scene: Path, key: str, values: tuple[Any, ...]) -> None:
    written(scene.parent, SCENE + FENCE)
    (sentence,) = words_on_places(scene, key, values)
    assert sentence.startswith(
        f"`{key}` moves the slope, but these keep their coordinates in all cells: area road, barrier fence; compare"
    )


def test_windrows_and_sources_with_coordinates_are_named_too(scene: Path) -> None:
    windrow = "berms: [{name: heap, along: [[30, -30], [30, 30]], height: 1, width: 3}]"
    text = SCENE.replace("width: 80}}", f"width: 80}}, {windrow}}}").replace("crest: 1", "points: [[1, 0, 25]]")
    (sentence,) = words_on_places(written(scene.parent, text), BERM, (4, 5))
    assert ": area road, windrow heap, source top; compare" in sentence


def test_nothing_is_named_when_the_slope_stays(scene: Path) -> None:
    assert not words_on_places(scene, "terrain.benches.width", (70, 80))
    written(scene.parent, SCENE.replace("areas_of_interest: [{name: road, polygons: road.geojson}]\n", ""))
    assert not words_on_places(scene, BERM, (4, 5))
