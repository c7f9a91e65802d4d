"""Tests that the inputs of a report state the source of each value: scene, library, sample or default."""

from dataclasses import replace
from pathlib import Path

import pytest
from input_files.terrain_files import grid, write_binary_stl

from rpf3d_core.report.elements import Table, Text
from rpf3d_core.report.inputs_part import DEFAULT, GROUND, STATED, inputs_part
from rpf3d_core.report.run_files import read_run
from rpf3d_core.results.inputs import CALIBRATED, ELSEWHERE, PARTLY
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.unknowns.parameter_sets import parameter_sets, write_parameter_sets
from rpf3d_core.unknowns.places import Surroundings

RANGE = "range stated in the scene"
SAMPLE = "calibration sample posterior.parquet"
SCENE = """\
terrain: {{files: [{{path: slope.stl, zone: rock}}]}}
materials: {{default: {material}}}
sources: [{{name: a, points: [[1.3, 1.2, 9]]}}]
outputs: {{pictures: false, recording: false}}
{more}
"""


def flown(folder: Path, material: str, more: str = "", sample: tuple[str, ...] = (), place: Surroundings | None = None):
    """Return the run of a small scene; sample : key paths of a sample that the scene names; place : of the sample."""
    vertices, triangles = grid(5, 6)
    write_binary_stl(folder / "slope.stl", vertices[triangles])
    if sample:
        sets = parameter_sets(sample, [[0.4] * len(sample), [0.5] * len(sample)])
        write_parameter_sets(folder / "posterior.parquet", replace(sets, place=place))
        more += "\nunknowns: {sample: posterior.parquet}"
    (folder / "scene.yaml").write_text(SCENE.format(material=material, more=more))
    run_scene(
        read_scene(folder / "scene.yaml"), folder / "out", 64 if "prior" in material or sample else 4, "reference"
    )
    return read_run(folder / "out")


def sources(run, table: int) -> dict[str, str]:
    """Return name -> source of each input, from table 0 or 1 of the part on inputs."""
    found = [element for element in inputs_part(run) if isinstance(element, Table)][table]
    return {row[-3] if table else row[0]: row[-1] for row in found.rows}


BOTH = ("materials.default.normal_restitution", "materials.default.tangential_restitution")


@pytest.mark.parametrize(("sample", "tangential", "ground"), [(BOTH[:1], RANGE, PARTLY), (BOTH, SAMPLE, CALIBRATED)])
def test_only_what_a_sample_holds_is_called_calibrated(tmp_path: Path, sample, tangential, ground) -> None:
    prior = "{prior: {min: 0.6, max: 0.9}}"
    run = flown(tmp_path, f"{{normal_restitution: 0.5, tangential_restitution: {prior}}}", sample=sample)
    found = sources(run, 1)
    assert found["normal restitution"] == SAMPLE
    assert found["tangential restitution"] == tangential
    assert run.inputs["ground"] == ground
    assert Text(f"Ground: {GROUND[ground]}") in inputs_part(run)


@pytest.mark.parametrize(
    ("place", "ground"),
    [(Surroundings(0, 0, 6, 5), CALIBRATED), (Surroundings(400, 0, 406, 5), ELSEWHERE), (None, CALIBRATED)],
)
def test_a_calibration_of_another_slope_is_named(tmp_path: Path, place: Surroundings | None, ground: str) -> None:
    run = flown(tmp_path, "{normal_restitution: 0.5, tangential_restitution: 0.8}", sample=BOTH, place=place)
    assert run.inputs["ground"] == ground
    named = [words for words in run.inputs["surer_than_it_may_be"] if "place where the sample was calibrated" in words]
    assert len(named) == (ground == ELSEWHERE)


def test_a_range_that_replaces_one_of_the_library_is_not_called_published(tmp_path: Path) -> None:
    run = flown(tmp_path, "{library: bedrock, normal_restitution: {prior: {min: 0.3, max: 0.4}}}")
    found = sources(run, 1)
    assert found["normal restitution"] == RANGE
    assert found["tangential restitution"].startswith("library bedrock: ")


def test_a_range_that_no_source_states_is_not_called_published(tmp_path: Path) -> None:
    found = sources(flown(tmp_path, "{library: bedrock}"), 1)
    assert found["tangential restitution"].startswith("library bedrock: ")
    assert found["friction angle (degrees)"] == "range assumed by rpf3d, because the entry bedrock has none"


def test_a_default_is_not_called_stated(tmp_path: Path) -> None:
    material = "{normal_restitution: 0.5, tangential_restitution: 0.8}"
    run = flown(tmp_path, material, "effects: {drag: {}}\nrebound: constant\nstop_speed: 0.4")
    rows = next(element for element in inputs_part(run) if isinstance(element, Table)).rows
    found = {name: source for name, _, source in rows}
    assert found["rock density"] == found["rock size"] == found["rock shape"] == DEFAULT
    assert found["gravity"] == found["upward axis"] == found["reference system"] == DEFAULT
    assert found["terrain"] == found["stop speed"] == STATED
    assert {value.split()[0]: source for name, value, source in rows if name == "effect drag"} == {
        "acts": STATED, "coefficient": DEFAULT, "density": DEFAULT, "accuracy": DEFAULT,
    }  # fmt: skip
    assert {name: source for name, value, source in rows if value in ("constant", "sliding")} == {
        "rebound": STATED, "ground": DEFAULT,
    }  # fmt: skip
    assert sources(run, 1) == {
        "normal restitution": STATED, "tangential restitution": STATED, "friction angle (degrees)": DEFAULT,
    }  # fmt: skip


def test_what_a_scene_states_is_called_stated(tmp_path: Path) -> None:
    material = "{normal_restitution: 0.5, tangential_restitution: 0.8, friction_angle_deg: 30}"
    more = "effects: {drag: {density: 1.2}}\nrock: {density: 2700, diameter: 1}\ngravity: 9.81"
    run = flown(tmp_path, material, more)
    rows = next(element for element in inputs_part(run) if isinstance(element, Table)).rows
    found = {name: source for name, _, source in rows}
    assert found["rock density"] == found["rock size"] == found["gravity"] == STATED
    assert found["rock shape"] == found["stop speed"] == DEFAULT
    assert {value.split()[0]: source for name, value, source in rows if name == "effect drag"}["density"] == STATED
    assert sources(run, 1)["friction angle (degrees)"] == STATED


def test_rocks_with_a_shape_have_no_coefficients_of_points(tmp_path: Path) -> None:
    run = flown(tmp_path, "{restitution: 0.3, friction: 0.6}", "rock: {shape: {box: [1, 1, 1]}}")
    assert sources(run, 1) == {"restitution": STATED, "friction": STATED}


def test_a_range_is_that_of_the_scene_and_not_of_the_parameter_sets(tmp_path: Path) -> None:
    """The ends of the 64 sets, 0.202 to 0.399, must not be shown as those of the scene."""
    priors = "{prior: {min: 0.2, max: 0.4}}, tangential_restitution: {prior: {min: 0.6, max: 0.9, mean: 0.7, sd: 0.05}}"
    run = flown(tmp_path, f"{{normal_restitution: {priors}}}")
    found = [element for element in inputs_part(run) if isinstance(element, Table)][1]
    shown = {row[1]: row[2] for row in found.rows}
    assert shown["normal restitution"] == "0.2 to 0.4"
    assert shown["tangential restitution"] == "0.6 to 0.9 (mean 0.7, sd 0.05)"


def test_measured_sizes_have_their_number_and_range(tmp_path: Path) -> None:
    (tmp_path / "blocks.csv").write_text("Length (mm),note\n400,a\n1500,b\n700,c\n")
    rock = "rock: {density: 2700, diameter: {measured: blocks.csv, column: Length (mm)}}"
    run = flown(tmp_path, "{normal_restitution: 0.5, tangential_restitution: 0.8}", rock)
    found = next(element for element in inputs_part(run) if isinstance(element, Table))
    size = next(row[1] for row in found.rows if row[0] == "rock size")
    assert size == "diameter measured blocks.csv, column Length (mm): 3 values from 0.4 to 1.5 m"


def test_a_material_that_no_zone_has_is_not_listed_as_ground(tmp_path: Path) -> None:
    """The report listed R_n 0.2 as ground, although `*` comes first and no triangle has the material of `ro*`."""
    material = "{normal_restitution: 0.5, tangential_restitution: 0.8}"
    others = "'*': {normal_restitution: 0.3, tangential_restitution: 0.7}, 'ro*': {normal_restitution: 0.2, "
    run = flown(tmp_path, f"{material}, {others}tangential_restitution: 0.6}}")
    (found,) = [element for element in inputs_part(run) if isinstance(element, Table)][1:]
    assert {row[0] for row in found.rows} == {"*"}
    assert any("`materials.ro*` is not used" in sentence for sentence in run.inputs["warnings"])
