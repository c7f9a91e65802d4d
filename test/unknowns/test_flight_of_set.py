"""Tests that the physics of a parameter set equals that of a scene file with its values."""

from pathlib import Path

import numpy as np
import pytest
from scenes.small_pit import scene_file

from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.errors import InputError
from rpf3d_core.materials.draws import DrawnMaterials
from rpf3d_core.materials.library import Materials
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.parameter_sets import flight_of_set
from rpf3d_core.setup.prepared import Prepared, prepare, releases_in_ranges
from rpf3d_core.unknowns.parameter_sets import parameter_sets

SETS = parameter_sets(
    ["materials.default.normal_restitution", "materials.*.friction_angle_deg", "stop_speed"],
    [[0.5, 30.0, 0.5], [0.35, 41.0, 0.3]],
)
ROCKS = 12


def finals(prepared: Prepared, of: Prepared, drawn: bool | None = None, number: int = 1) -> bytes:
    """Return the bytes of the ends of some rocks of a prepared scene, with the physics of a set of the scene `of`."""
    flight = flight_of_set(of, SETS.at(number), drawn)
    releases = releases_in_ranges(prepared, [range(ROCKS), range(ROCKS)])
    return fly_ensemble(prepared.engine, flight, releases).deposits.x.tobytes()


@pytest.fixture
def prepared(tmp_path: Path) -> Prepared:
    return prepare(read_scene(scene_file(tmp_path, more="engine: reference\n")))


def test_a_set_flies_as_the_scene_with_its_values_in_both_forms(prepared: Prepared, tmp_path: Path) -> None:
    written = scene_file(tmp_path, "other.yaml", R_n=0.35, more="engine: reference\nstop_speed: 0.3\n")
    written.write_text(written.read_text().replace("{normal_res", "{friction_angle_deg: 41, normal_res"))
    other = prepare(read_scene(written))
    releases = releases_in_ranges(other, [range(ROCKS), range(ROCKS)])
    right = fly_ensemble(other.engine, other.flight, releases).deposits.x.tobytes()
    assert finals(prepared, prepared) == finals(prepared, prepared, drawn=True) == right
    assert finals(prepared, prepared, number=0) != right


def test_the_form_of_the_materials_is_that_of_the_prepared_scene(prepared: Prepared, tmp_path: Path) -> None:
    assert type(prepared.flight.materials) is type(flight_of_set(prepared, SETS.at(1)).materials) is Materials
    drawn = scene_file(tmp_path, "drawn.yaml", more="engine: reference\n")
    drawn.write_text(drawn.read_text().replace("0.5,", "{mean: 0.5, sd: 0.1, min: 0.3, max: 0.7},"))
    of_drawn = flight_of_set(prepare(read_scene(drawn)), SETS.at(1))
    assert isinstance(of_drawn.materials, DrawnMaterials)
    assert np.array_equal(of_drawn.materials.numbers[:, 0, 2], np.full(len(prepared.terrain.zones), 0.35))


def test_models_are_made_again_only_for_their_own_parameters(prepared: Prepared) -> None:
    assert flight_of_set(prepared, SETS.at(1)).models is prepared.flight.models


@pytest.mark.parametrize("name", ["rock.density", "sources.top.above_ground", "seed"])
def test_what_is_not_of_the_flight_is_refused(prepared: Prepared, name: str) -> None:
    with pytest.raises(InputError, match=f"`{name}` cannot be an unknown"):
        flight_of_set(prepared, {name: 1.0})


BODIES = """\
terrain: {pit: {triangles: 2000}}
rock: {shape: {box: [1, 1, 0.5]}}
materials: {default: {restitution: 0, slip_friction: {mu_min: 0.4, mu_max: 1.2, kappa: 2, beta: 150}}}
sources: [{name: top, zone: bench_1, above_ground: 3, rocks: 4}]
engine: reference
"""


def test_friction_along_the_slip_is_part_of_a_set(tmp_path: Path) -> None:
    """The contact model contains slip friction, so a set with another value needs a new contact model."""
    (tmp_path / "bodies.yaml").write_text(BODIES)
    (tmp_path / "other.yaml").write_text(BODIES.replace("mu_min: 0.4", "mu_min: 0.7"))
    given, other = (prepare(read_scene(tmp_path / name)) for name in ("bodies.yaml", "other.yaml"))
    changed = flight_of_set(given, {"materials.*.slip_friction.mu_min": 0.7})
    assert repr(changed.models.rebound) == repr(other.flight.models.rebound) != repr(given.flight.models.rebound)


def test_obstacles_are_the_same_for_all_sets(tmp_path: Path) -> None:
    forest = "effects: {forest: {stems_per_ha: 200, dbh_mean_cm: 30, dbh_sd_cm: 5}}\n"
    text = scene_file(tmp_path).read_text().replace("effects:", "# effects:")
    (tmp_path / "forest.yaml").write_text(text + forest.replace("200", "{prior: {min: 100, max: 300}}"))
    with pytest.raises(InputError, match=r"`effects.forest.stems_per_ha` cannot be an unknown, because all"):
        read_scene(tmp_path / "forest.yaml")
