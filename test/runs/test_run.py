"""Tests of runs in Python: choices, distribution of rocks among sources, materials by zone, refusals."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import grid, write_binary_stl
from programs.command_line import python

import rpf3d_core as rpf3d
from rpf3d_core.scene.model import LARGEST_SEED
from rpf3d_core.scene.releases import RockSpec
from rpf3d_core.setup.choices import with_choices
from rpf3d_core.setup.prepared import scene_flight
from rpf3d_core.setup.sources import rock_of
from rpf3d_core.values import Outcome

SCENES = Path(__file__).parents[2] / "config" / "scenes"
SCENE = """\
terrain:
  files:
    - {path: slope.stl, zone: rock}
materials:
  rock: {normal_restitution: 0.5, tangential_restitution: 0.8, friction_angle_deg: 45}
sources:
  - {name: a, points: [[1.3, 1.2, 9]], rocks: 6}
  - {name: b, points: [[2.3, 1.2, 9], [3.3, 2.2, 9]], rocks: 3}
stop_speed: 0.4
rebound: constant
ground: none
"""
ROUNDING = 1e-12
"""Largest relative rounding error of a few operations."""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    vertices, triangles = grid(5, 6)
    write_binary_stl(tmp_path / "slope.stl", vertices[triangles])
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path / "scene.yaml"


def test_a_scene_may_be_given_as_a_path_a_string_or_a_scene(scene: Path) -> None:
    runs = [rpf3d.simulate(given) for given in (scene, str(scene), rpf3d.read_scene(scene))]
    for run in runs:
        np.testing.assert_array_equal(run.flights.deposits.x, runs[0].flights.deposits.x)
    assert len(runs[0].flights.deposits.x) == 9 and runs[0].flights.engine == "reference"


@pytest.mark.parametrize(("rocks", "shares"), [(9, [6, 3]), (1, [1, 0]), (3, [2, 1]), (10, [7, 3]), (300, [200, 100])])
def test_a_total_of_rocks_is_dealt_to_the_sources_in_proportion(scene: Path, rocks: int, shares: list[int]) -> None:
    sources = with_choices(rpf3d.read_scene(scene), rocks, None, None).sources
    assert [source.rocks for source in sources] == shares


def test_a_source_that_is_dealt_no_rock_takes_no_part(scene: Path) -> None:
    deposits = rpf3d.simulate(scene, rocks=1).flights.deposits
    assert (deposits.source.tolist(), deposits.rock.tolist()) == ([0], [0])


def test_rocks_are_dealt_to_the_points_of_a_source_in_turn(scene: Path) -> None:
    run = rpf3d.simulate(scene)
    released = run.terrain.frame.points_to_input(run.flights.deposits.release)[6:]
    np.testing.assert_allclose(released, [[2.3, 1.2, 9], [3.3, 2.2, 9], [2.3, 1.2, 9]], rtol=ROUNDING)


@pytest.mark.parametrize(
    ("choice", "sentence"),
    [
        ({"rocks": 0}, "the number of rocks is 0; it must be from 1 to"),
        ({"engine": "fast"}, "the engine is 'fast'; it must be auto, reference or compiled"),
        ({"seed": -1}, "the seed is -1; it must be a whole number from 0"),
        ({"seed": LARGEST_SEED + 1}, "it must be a whole number from 0 to"),
    ],
)
def test_a_choice_that_makes_no_sense_is_refused(scene: Path, choice: dict[str, object], sentence: str) -> None:
    with pytest.raises(rpf3d.InputError, match=sentence):
        rpf3d.simulate(scene, **choice)  # type: ignore[arg-type]


def test_no_choice_leaves_the_scene_as_it_is(scene: Path) -> None:
    as_written = rpf3d.read_scene(scene)
    assert with_choices(as_written, None, None, None) == as_written


def test_materials_become_numbers_by_zone_with_the_scenes_stop_speed_where_they_have_none(scene: Path) -> None:
    read = rpf3d.read_scene(scene)
    flight = scene_flight(read, rpf3d.read_terrain(read)[0])
    assert flight.materials.R_n.tolist() == [0.5] and flight.materials.R_t.tolist() == [0.8]
    assert flight.materials.mu.tolist() == pytest.approx([1.0], rel=ROUNDING)
    assert flight.materials.stop_speed.tolist() == [0.4]
    talus = "talus: {normal_restitution: 0.3, tangential_restitution: 0.7, stop_speed: 0.1}"
    text = SCENE.replace("zone: rock", "zone: talus")
    scene.write_text(text.replace("rock: {normal_restitution: 0.5", f"{talus}\n#"))
    read = rpf3d.read_scene(scene)
    flight = scene_flight(read, rpf3d.read_terrain(read)[0])
    assert flight.materials.stop_speed.tolist() == [0.1]
    assert flight.materials.mu.tolist() == pytest.approx([math.tan(math.radians(30.0))], rel=ROUNDING)


@pytest.mark.parametrize(
    ("spec", "mass", "radius"),
    [
        (RockSpec(density=2700.0, diameter=1.0), 2700.0 * math.pi / 6.0, 0.5),
        (RockSpec(density=2700.0, mass=2700.0 * math.pi / 6.0), 2700.0 * math.pi / 6.0, 0.5),
        (RockSpec(density=1000.0, mass=4000.0 * math.pi / 3.0), 4000.0 * math.pi / 3.0, 1.0),
    ],
)
def test_a_rock_is_the_sphere_of_its_density_and_its_diameter_or_mass(
    spec: RockSpec, mass: float, radius: float
) -> None:
    assert rock_of(spec) == pytest.approx((mass, radius), rel=ROUNDING)


def test_progress_is_told_the_total_and_then_every_rock(scene: Path) -> None:
    told: list[int] = []

    def begin(rocks: int):  # type: ignore[no-untyped-def]
        told.append(rocks)
        return told.append

    rpf3d.simulate(scene, rocks=40, progress=begin)
    assert told[0] == 40 == sum(told[1:])


def test_a_damaged_file_of_points_is_refused_before_the_terrain_is_read(
    scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rpf3d_core.setup.prepared.read_terrain", lambda _: pytest.fail("it read the terrain first"))
    (scene.parent / "points.xyz").write_text("1 2 3\n1 nan 3\n")
    scene.write_text(SCENE.replace("points: [[1.3, 1.2, 9]]", "points_file: points.xyz"))
    with pytest.raises(rpf3d.InputError, match=r"points\.xyz, line 2, column 2: y must be a plain, finite number"):
        rpf3d.simulate(scene)


def test_the_times_of_a_run_add_up(scene: Path) -> None:
    run = rpf3d.simulate(scene)
    prepared, flights = run.prepared, run.flights
    assert prepared.read_s > 0.0 and prepared.index_s > 0.0 and flights.fly_s > 0.0 and flights.compile_s >= 0.0


def test_a_run_without_recording_is_written_without_rerun(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rpf3d_core.results.folder._write_pictures", lambda *_: None)
    run = rpf3d.simulate(scene)
    folder = rpf3d.write_run(run, tmp_path / "out", recording=False)
    assert folder == tmp_path / "out" and not (folder / "run.rrd").exists()
    facts = json.loads((folder / "summary.json").read_text())
    assert facts["rocks"] == 9 and facts["rocks_per_s"] == pytest.approx(9 / facts["fly_s"])
    assert facts["wall_s"] >= facts["read_s"] + facts["index_s"] + facts["fly_s"]


def test_the_package_has_the_names_it_announces_and_no_others() -> None:
    for name in rpf3d.__all__:
        assert getattr(rpf3d, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        rpf3d.simulat  # noqa: B018


@pytest.mark.long
@pytest.mark.parametrize("angle", [22, 59])
def test_the_package_imports_and_the_reference_engine_runs_without_numba(tmp_path: Path, angle: int) -> None:
    done = python(
        "import sys; sys.modules['numba'] = None\n"
        "import rpf3d_core as rpf3d\n"
        f"run = rpf3d.simulate({str(SCENES / f'lab_{angle}.yaml')!r})\n"
        "print(run.flights.engine, run.flights.deposits.outcome[0], repr(run.flights.deposits.path[0].item()))\n"
        f"try:\n    rpf3d.simulate({str(SCENES / 'lab_22.yaml')!r}, engine='compiled')\n"
        "except rpf3d.InputError as fault:\n    print(fault)\n"
        f"print(rpf3d.simulate({str(SCENES / 'lab_22.yaml')!r}, rocks=300).flights.engine)\n"
    )
    assert done.returncode == 0, done.stderr
    flown, refused, many = done.stdout.splitlines()
    engine, outcome, path = flown.split()
    assert (engine, int(outcome)) == ("reference", Outcome.STOPPED)
    here = rpf3d.simulate(SCENES / f"lab_{angle}.yaml", engine="reference").flights.deposits.path[0]
    assert float(path) == here, "the same bits with numba and without"
    assert refused.endswith("engine 'compiled' cannot be used: numba is not installed")
    assert many == "reference", "`auto` takes what there is"
