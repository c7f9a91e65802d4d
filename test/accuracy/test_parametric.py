"""Tests of the parametric error: the map error due to unknown values of the ground."""

from pathlib import Path

import pytest
from scenes.price_lists import price_list
from scenes.small_pit import scene_file

from rpf3d_core.accuracy.choice import errors_of_scene, largest
from rpf3d_core.accuracy.parametric import OverSets, over_sets
from rpf3d_core.accuracy.price_list import price_list_of, priced_unknowns, section
from rpf3d_core.accuracy.tables import findings, parametric_rows
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare

WIDE = OverSets(sets=32, rocks=500, of_map=0.3, distance=0.31, of_shares=0.6, seconds_per_1000=0.01)


def error_with(folder: Path, normal: str) -> OverSets | None:
    """Return the parametric error of the small pit with a normal restitution (YAML), None without unknowns."""
    path = scene_file(folder)
    text = path.read_text()
    assert "normal_restitution: 0.5" in text
    path.write_text(text.replace("normal_restitution: 0.5", f"normal_restitution: {normal}"))
    scene = read_scene(path)
    return over_sets(prepare(scene.model_copy(update={"engine": "compiled"})))


def test_a_scene_whose_values_are_all_known_has_no_parametric_error_that_could_be_told(tmp_path: Path) -> None:
    assert error_with(tmp_path, "0.5") is None


@pytest.mark.long  # half a minute, most of it compiling
def test_the_error_grows_with_the_range_and_is_near_zero_for_a_range_of_nothing(tmp_path: Path) -> None:
    errors = [error_with(tmp_path, f"{{prior: {{min: {0.5 - d}, max: {0.5 + d}}}}}") for d in (1e-9, 0.1, 0.4)]
    none, some, much = (found.of_map for found in errors if found is not None)
    assert none < 0.05 < some < much
    assert errors[0] is not None and errors[0].distance > 0.1, "chance is in the distance, and out of the error"


def test_the_largest_error_says_what_to_spend_on_next_and_what_rocks_cannot_buy() -> None:
    known, unknown = price_list(), price_list(parametric=[priced_unknowns(WIDE)])
    assert "parametric" not in errors_of_scene(known)
    assert any("parametric error: unknown" in line for line in findings(known, 0.1))
    assert errors_of_scene(unknown)["parametric"] == 0.3 and largest(unknown) == "parametric"
    told = " ".join(findings(unknown, 0.1))
    assert "the largest is the parametric one: a calibration" in told and "no number of rocks reaches 0.1" in told
    assert "no number of rocks" not in " ".join(findings(unknown, 0.5))
    assert told.index("no number of rocks") < told.index("full terrain, without the unknown ground), cheapest")
    assert "without the unknown ground" not in " ".join([*findings(unknown, 0.5), *findings(known, 0.1)])


def test_a_price_list_with_unknowns_is_read_as_it_was_written() -> None:
    prices = price_list(parametric=[priced_unknowns(WIDE)])
    again = price_list_of(section(prices))
    assert [line._asdict() for line in again.parametric] == [line._asdict() for line in prices.parametric]
    assert parametric_rows(again) == [("32", "0.3", "0.6", "0.01")] and parametric_rows(price_list()) == []


@pytest.mark.parametrize("rocks", ["parametric", "statistical"])
def test_each_group_is_defined_in_the_file(rocks: str) -> None:
    assert rocks in section(price_list())["definitions"]
