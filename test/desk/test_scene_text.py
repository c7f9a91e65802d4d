"""Tests that an edit of a scene's text changes exactly what was edited, and comments stay."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from rpf3d_core.desk.coefficients import coefficient_of, coefficient_text, drawn_elsewhere, materials_of
from rpf3d_core.desk.scene_text import (
    AREAS,
    MATERIALS,
    SOURCES,
    free_name,
    with_item,
    with_value,
    without_item,
    without_value,
)
from rpf3d_core.desk.tables import scene_section
from rpf3d_core.errors import InputError
from rpf3d_core.formats.yaml import parse_yaml
from rpf3d_core.scene.reading import scene_of_text

pytest.importorskip("ruamel.yaml", reason="the extra `desk` is not installed")

SCENES = Path(__file__).parents[2] / "config" / "scenes"
PATHS = sorted(SCENES.glob("*.yaml"))
DEMO = SCENES / "demo.yaml"
SOURCE = {"name": "new", "points": [[-600.0, 0.25, 1687.0], [-600.5, 3.0, 1687.0]], "above_ground": 0.5, "rocks": 40}
CORNERS = [[-500.0, -50.0], [-400.0, -50.0], [-400.0, 50.25]]


def values(text: str) -> dict:
    return parse_yaml(text, DEMO).values


def comments(text: str) -> list[str]:
    return [line[line.index("#") :].rstrip() for line in text.splitlines() if "#" in line]


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_an_edit_changes_one_value_of_any_scene_and_keeps_every_comment(path: Path) -> None:
    text = path.read_text()
    edited = with_value(text, ("seed",), 77)
    assert values(edited) == {**values(text), "seed": 77}
    assert [line for line in comments(text) if line not in comments(edited)] == []


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_taking_an_edit_back_leaves_the_same_scene(path: Path) -> None:
    text = path.read_text()
    edited = without_item(with_item(text, SOURCES, SOURCE), SOURCES, "new")
    assert values(edited) == values(text)


def test_the_page_lists_every_kind_of_source_also_the_crest_of_a_slope_of_benches() -> None:
    path = SCENES / "catch_bench.yaml"
    section = scene_section(scene_of_text(path.read_text(), path), values(path.read_text()))
    assert section["sources"] == [{"name": "top_face", "rocks": 6400, "kind": "crest"}]


def test_a_source_is_added_after_the_others_and_read_back() -> None:
    scene = scene_of_text(with_item(DEMO.read_text(), SOURCES, SOURCE), DEMO)
    assert [source.name for source in scene.sources] == ["west_wall", "new"]
    assert scene.sources[1].points == ((-600.0, 0.25, 1687.0), (-600.5, 3.0, 1687.0)) and scene.sources[1].rocks == 40


def test_an_area_is_added_to_a_scene_without_areas_and_its_key_goes_with_it() -> None:
    text = DEMO.read_text()
    edited = with_item(text, AREAS, {"name": "ramp", "polygons": CORNERS})
    np.testing.assert_array_equal(scene_of_text(edited, DEMO).areas_of_interest[0].polygons, CORNERS)
    assert AREAS not in values(without_item(edited, AREAS, "ramp"))


def test_the_only_source_stays_and_a_name_that_is_not_there_is_named() -> None:
    with pytest.raises(InputError, match="'west_wall' is the only source"):
        without_item(DEMO.read_text(), SOURCES, "west_wall")
    with pytest.raises(InputError, match="`sources` has no 'east'"):
        without_item(DEMO.read_text(), SOURCES, "east")


def test_a_coefficient_becomes_a_range_and_the_default_again() -> None:
    path = ("materials", "spill", "friction_angle_deg")
    edited = with_value(DEMO.read_text(), path, coefficient_of("30 to 40"))
    assert scene_of_text(edited, DEMO).has_unknowns
    assert "friction_angle_deg" not in values(without_value(edited, path))["materials"]["spill"]
    assert without_value(edited, ("materials", "nothing", "x")) == edited


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.45", 0.45), ("30", 30), ("0.3 to 0.5", {"prior": {"min": 0.3, "max": 0.5}}),
        ("0.3-0.5", {"prior": {"min": 0.3, "max": 0.5}}), ("1e-2..0.5", {"prior": {"min": 0.01, "max": 0.5}}),
        ("{mean: 0.4, sd: 0.1, min: 0.2, max: 0.6}", {"mean": 0.4, "sd": 0.1, "min": 0.2, "max": 0.6}),
        ("per_impact", "per_impact"), ("-0.5", -0.5),
    ],
)  # fmt: skip
def test_what_the_user_types_is_a_value_and_comes_back_as_the_same_value(text: str, value: object) -> None:
    assert coefficient_of(text) == value
    assert coefficient_of(coefficient_text(value)) == value


@pytest.mark.parametrize(
    "text", ["", "  ", "[1, 2]", "{mean: 0.4", "*a", "!!python/object:x {}", "a: b: c", "{a: 1, a: 2}"]
)
def test_what_is_no_value_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(InputError, match=r"type a number, a range such as 0\.3 to 0\.5"):
        coefficient_of(text)


def test_the_usual_coefficients_are_shown_even_if_left_out() -> None:
    materials = {"a": {"normal_restitution": 0.3}, "b": {"restitution": 0.1, "friction": 1}}
    shown = dict(materials_of({"materials": materials}))
    assert [(each.key, each.text) for each in shown["a"]] == [
        ("normal_restitution", "0.3"), ("tangential_restitution", ""), ("friction_angle_deg", ""),
    ]  # fmt: skip
    assert [each.key for each in shown["b"]] == ["restitution", "friction", "rolling_resistance"]


def test_values_of_a_sample_and_of_priors_are_drawn_elsewhere_and_a_range_in_its_place_is_not(tmp_path: Path) -> None:
    names = ["materials.default.normal_restitution"]
    pq.write_table(pa.table({names[0]: [0.3, 0.4, 0.5]}), tmp_path / "sample.parquet")
    text = """\
terrain: {pit: {triangles: 6000}}
materials:
  default: {normal_restitution: 0.4, tangential_restitution: {prior: {min: 0.6, max: 0.8}}, friction_angle_deg: 30}
  spill: {normal_restitution: 0.2, tangential_restitution: 0.5}
sources: [{name: top, zone: bench_1, rocks: 100}]
unknowns: {sample: sample.parquet, priors: {materials.spill.normal_restitution: {min: 0.1, max: 0.2}}}
"""
    path = tmp_path / "s.yaml"
    fixed = drawn_elsewhere(scene_of_text(text, path), parse_yaml(text, path).values)
    assert fixed == {
        ("materials", "default", "normal_restitution"): "drawn from the sample sample.parquet; change it there",
        ("materials", "spill", "normal_restitution"):
            "drawn from `unknowns.priors`, key path `materials.spill.normal_restitution`; change it there",
    }  # fmt: skip


def test_a_free_name_is_not_taken() -> None:
    assert free_name([], "source") == "source_1"
    assert free_name(["source_2", "source_1", "x"], "source") == "source_3"


ANCHOR = """\
materials:
  spill: &loose {normal_restitution: 0.3, tangential_restitution: 0.7}
  berm: *loose
  face: {normal_restitution: &hard 0.4, tangential_restitution: *hard}
"""


@pytest.mark.parametrize("name", ["spill", "berm"])
def test_an_edit_of_a_value_that_an_anchor_repeats_is_refused(name: str) -> None:
    other = "berm" if name == "spill" else "spill"
    with pytest.raises(InputError, match=rf"also change `materials\.{other}\.normal_restitution`; .* anchor \(&name\)"):
        with_value(ANCHOR, (MATERIALS, name, "normal_restitution"), 0.5)
    with pytest.raises(InputError, match=rf"also change `materials\.{other}\.friction`"):
        with_value(ANCHOR, (MATERIALS, name, "friction"), 0.5)
    with pytest.raises(InputError, match=rf"also change `materials\.{other}\.normal_restitution`"):
        without_value(ANCHOR, (MATERIALS, name, "normal_restitution"))


def test_other_values_of_a_file_with_anchors_are_edited() -> None:
    edited = with_value(ANCHOR, (MATERIALS, "face", "tangential_restitution"), 0.9)
    wanted = values(ANCHOR)
    wanted["materials"]["face"]["tangential_restitution"] = 0.9
    assert values(edited) == wanted
    assert values(with_value(edited, ("seed",), 3)) == {**wanted, "seed": 3}
