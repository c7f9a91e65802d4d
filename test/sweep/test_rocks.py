"""Tests that cells have as many rocks as a scene file with their values; numbers without effect are refused."""

from pathlib import Path
from typing import Any

import pytest
from scenes.sweeps import BERM, SCENE, Here, road, written

from rpf3d_core.errors import InputError
from rpf3d_core.scene.reading import read_scene, scene_digest
from rpf3d_core.setup.choices import Rocks, with_choices
from rpf3d_core.sweep.cells import Cell, cells_of
from rpf3d_core.sweep.sweep import sweep
from rpf3d_core.sweep.varied import Varied

OF_TOP, POINTS = "sources.top.rocks", "sources.top.points"
TOP = "{name: top, crest: 1, above_ground: 0.5, rocks: 60, velocity: [2, 0, 0]}"
WITH_POINTS = "{name: top, points: [[1, 0, 25]], velocity: [2, 0, 0]}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "road.geojson").write_text(road(20.0, 24.0))
    return tmp_path


def cells(folder: Path, text: str, varied: dict[str, tuple[Any, ...]], rocks: Rocks = None) -> list[Cell]:
    keys = [Varied(key=key, values=varied[key]) for key in varied]
    return cells_of(read_scene(written(folder, text)), keys, rocks)


def digest(folder: Path, text: str, rocks: Rocks = None) -> str:
    """Return the digest of a scene file without the outputs that cells of a sweep omit."""
    plain = f"{text}outputs: {{pictures: false, recording: false, impacts: false}}\n"
    return scene_digest(with_choices(read_scene(written(folder, plain)), rocks, None, None))


def test_a_source_has_a_rock_for_each_varied_point_as_in_a_scene_file(folder: Path) -> None:
    points = (((1, 0, 25),), ((1, 0, 25), (1, 5, 25), (1, 9, 25)))
    found = cells(folder, SCENE.replace(TOP, WITH_POINTS), {POINTS: points})
    assert [cell.scene.sources[0].rocks for cell in found] == [1, 3]
    for cell, some in zip(found, points, strict=True):
        text = SCENE.replace(TOP, WITH_POINTS.replace("[[1, 0, 25]]", str([list(point) for point in some])))
        assert cell.digest == digest(folder, text)


def test_a_stated_number_of_rocks_stays_when_the_points_vary(folder: Path) -> None:
    text = SCENE.replace(TOP, WITH_POINTS.replace("points", "rocks: 7, points"))
    found = cells(folder, text, {POINTS: (((1, 0, 25),), ((1, 0, 25), (1, 5, 25)))})
    assert [cell.scene.sources[0].rocks for cell in found] == [7, 7]


@pytest.mark.parametrize("total", [None, 50])
def test_a_varied_total_is_dealt_as_in_a_scene_file(folder: Path, total: int | None) -> None:
    text = SCENE.replace(TOP, f"{TOP}, {TOP.replace('top', 'more').replace('60', '7')}")
    base = text if total is None else f"{text}rocks: {total}\n"
    for cell in cells(folder, base, {"rocks": (11, 100)}):
        assert cell.digest == digest(folder, f"{text}rocks: {cell.values['rocks']}\n")
    for cell in cells(folder, base, {BERM: (4, 5)}, rocks=33):
        assert cell.digest == digest(folder, base.replace("berm: 4", f"berm: {cell.values[BERM]}"), 33)


@pytest.mark.parametrize(
    ("varied", "total", "rocks", "sentence"),
    [
        ({OF_TOP: (20, 40)}, "", 30, "`sources.top.rocks` is varied, but the total `rocks: 30` is dealt to the"),
        ({OF_TOP: (20, 40)}, "rocks: 30\n", None, "`sources.top.rocks` is varied, but the total `rocks: 30` is dealt"),
        ({OF_TOP: (20, 40), "rocks": (50,)}, "", None, "`sources.top.rocks` is varied, but the total `rocks: 50` is"),
        ({"sources.0.rocks": (20, 40)}, "", "auto", "`sources.0.rocks` is varied, but the total `rocks: auto` is"),
        ({"rocks": (20, 40)}, "", 30, "`rocks` is varied, and the number of rocks of each cell is given too"),
    ],
)  # fmt: skip
def test_numbers_that_the_total_replaces_are_refused(
    folder: Path, varied: dict[str, tuple[Any, ...]], total: str, rocks: Rocks, sentence: str
) -> None:
    with pytest.raises(InputError) as caught:
        cells(folder, SCENE + total, varied, rocks)
    assert sentence in str(caught.value)


def test_sources_that_a_total_makes_alike_are_the_same_run(folder: Path) -> None:
    top = {"name": "top", "crest": 1, "above_ground": 0.5, "velocity": [2, 0, 0]}
    with pytest.raises(InputError, match="two cells are the same run"):
        cells(folder, SCENE, {"sources.top": ({**top, "rocks": 20}, {**top, "rocks": 40})}, rocks=30)


def test_numbers_of_rocks_vary_without_a_total(folder: Path) -> None:
    found = sweep(written(folder, SCENE), {OF_TOP: (5, 9)}, folder / "out", Here())
    assert [record.rocks for record in found.records] == [5, 9]
