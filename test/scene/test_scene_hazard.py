"""Tests that the scene's key `hazard` accepts valid values and refuses others with a sentence."""

from pathlib import Path

import pytest
from flights.flights_on_a_floor import SCENE
from pydantic import ValidationError, create_model

from rpf3d_core.errors import SceneError
from rpf3d_core.hazard.maps import PERCENTILES
from rpf3d_core.scene import faults as scene_faults
from rpf3d_core.scene import reading as scene
from rpf3d_core.scene.hazard import REACH_LEVELS, HazardSpec, matrix_of
from rpf3d_core.scene.model import Scene

MATRIX = "matrix: {energy_levels_kj: [30, 300], probability_levels: [0.1], classes: [[a, a], [a, b], [null, b]]}"


@pytest.fixture(autouse=True)
def scenes_have_the_key(monkeypatch):
    wider = create_model("Scene", __base__=Scene, hazard=(HazardSpec, HazardSpec()))
    monkeypatch.setattr(scene, "Scene", wider)
    monkeypatch.setattr(scene_faults, "Scene", wider)


def read(folder, hazard):
    path = folder / "scene.yaml"
    path.write_text(f"{SCENE}hazard: {{{hazard}}}\n")
    return scene.read_scene(path).hazard


def test_what_is_left_out_has_no_thresholds_but_round_levels_of_reach(tmp_path):
    spec = read(tmp_path, "")
    assert spec == HazardSpec()
    assert (spec.cell, spec.reach_levels, spec.energy_percentile, spec.memory_gb) == (None, REACH_LEVELS, 95, 1.0)
    assert spec.matrix is None and matrix_of(spec) is None


def test_a_matrix_is_read_with_its_energies_in_joule(tmp_path):
    matrix = matrix_of(read(tmp_path, f"cell: 2, reach_levels: [0.5], energy_percentile: 99, {MATRIX}"))
    assert matrix.energy_levels == (30e3, 300e3) and matrix.probability_levels == (0.1,)
    assert matrix.classes == (("a", "a"), ("a", "b"), (None, "b"))
    assert matrix.percentile == 99 and matrix.names == ["b", "a"]


def test_the_example_in_the_documentation_is_a_right_one(tmp_path):
    example = (
        (Path(__file__).parents[2] / "docs" / "reference" / "outputs.md").read_text().partition("```yaml\nhazard:")[2]
    )
    path = tmp_path / "scene.yaml"
    path.write_text(f"{SCENE}hazard:{example.partition('```')[0]}")
    spec = scene.read_scene(path).hazard
    assert matrix_of(spec).names == ["high", "medium", "low"] and spec.cell == 2.0


def test_every_percentile_of_the_maps_can_be_asked_for():
    for percentile in PERCENTILES:
        assert HazardSpec(energy_percentile=percentile).energy_percentile == percentile


@pytest.mark.parametrize(
    ("hazard", "sentence"),
    [
        ("cell: 0.009", "`hazard.cell` is 0.009, but must be a length of at least 0.01"),
        ("cell: two", "`hazard.cell` is 'two', but must be a length of at least 0.01"),
        ("reach_levels: []", "`hazard.reach_levels` is [], but must be a list of shares above 0"),
        ("reach_levels: [0.1, 0.01]", "`hazard.reach_levels` is [0.1, 0.01], but must rise"),
        ("reach_levels: [0.1, 0.1]", "must rise from each number to the next"),
        ("reach_levels: [0, 0.1]", "`hazard.reach_levels` is [0, 0.1], but must be a list of shares above 0"),
        ("reach_levels: [50]", "`hazard.reach_levels` is [50], but must be a list of shares above 0 and up to 1"),
        ("energy_percentile: 75", "`hazard.energy_percentile` is 75, but must be 50, 90, 95 or 99"),
        ("memory_gb: -1", "`hazard.memory_gb` is -1, but must be a number above 0 (GB"),
        ("cel: 2", "`hazard.cel` is not a key of a scene; did you mean `cell`?"),
        (MATRIX.replace("30, 300", "300, 30"), "`hazard.matrix.energy_levels_kj` is [300.0, 30.0], but must rise"),
        (MATRIX.replace("[[a, a], ", "["), "has rows of 2, 2 names, but must have 3 rows of 2 names"),
        (MATRIX.replace("[a, b], ", "[a, b, c], "), "`hazard.matrix.classes` has rows of 2, 3, 2 names"),
        (MATRIX.replace("[a, b], ", "a, "), "`hazard.matrix.classes` must be a table of class names"),
        (MATRIX.replace("[a, b], ", "[a, 3], "), "`hazard.matrix.classes` has 3 in its row 2, but must have names"),
        ("matrix: {energy_levels_kj: [30]}", "`hazard.matrix.probability_levels` is missing; it must be a list"),
    ],
)
def test_what_is_wrong_is_refused_by_name_with_what_would_be_right(tmp_path, hazard, sentence):
    with pytest.raises(SceneError) as refused:
        read(tmp_path, hazard)
    assert sentence in str(refused.value)
    assert "scene.yaml, line 8" in str(refused.value)


def test_a_spec_is_frozen():
    with pytest.raises(ValidationError, match="frozen"):
        HazardSpec().cell = 2.0
