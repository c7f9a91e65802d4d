"""Tests of rotational energies in tables and maps: present for rocks that spin, absent otherwise."""

from dataclasses import replace

import numpy as np
import pyarrow.parquet as parquet
import pytest
from flights import scenes_of_facets as made
from flights.models_by_name import models_called
from flights.rolling_spheres import spheres
from hazards.hazard_tallied import MASS, over, rocks_above, rough

from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.sizes import diameter_of
from rpf3d_core.kinetics.rebounds.pfeiffer_bowen import PfeifferBowen
from rpf3d_core.materials.library import Surface
from rpf3d_core.results.tables import impacts_table, with_energies, with_spins
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.simulation.engines import spins_of
from rpf3d_core.values import Mode

RADIUS, DENSITY = 0.5, MASS / (4.0 / 3.0 * np.pi * 0.5**3)
MODEL = PfeifferBowen(9.144, 6.096, 76.2)
SCENE = """\
terrain: {pit: {triangles: 20000, seed: 1}}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.85, friction_angle_deg: 30}}
rock: {density: 2700, diameter: 1.0}
sources: [{name: crest, points: [[-606, 0, 1687]], above_ground: 0.5, rocks: 12, velocity: [4, 0, 0]}]
rebound: REBOUND
ground: sliding
engine: reference
outputs: {pictures: false, recording: false}
seed: 1
"""


def flown(engine="reference", spins=True, count=25, model="none"):
    """Fly rocks over rough ground; return their flights and hazard maps. spins : CRSP's sphere, else a lumped mass"""
    terrain = rough()
    tallies = replace(over(terrain, compiled=engine == "compiled"), spins=spins)
    physics = made.flight(made.surface(0.6, 0.85, 25.0), model)
    if spins:
        physics = replace(physics, models=physics.models._replace(rebound=MODEL))
    x, v = rocks_above(count)
    flights = made.fly(made.engine_over(engine, terrain), physics, x, v, watch=tallies)
    return flights, tallies.maps(count, ())


def test_models_say_whether_rocks_spin():
    assert not spins_of(models_called("constant", "none"))
    assert spins_of(models_called("constant", "none")._replace(rebound=MODEL))


def test_a_sphere_leaves_each_impact_rolling_and_comes_to_the_next_with_that_spin():
    flights, _ = flown()
    struck, paths = flights.impacts, flights.paths
    assert len(struck.row) > 50
    same = struck.row[1:] == struck.row[:-1]
    np.testing.assert_array_equal(struck.spin_in[1:][same], struck.spin_out[:-1][same])
    assert (struck.spin_in[np.append(True, ~same)] == 0.0).all(), "no rock is released with a spin"
    columns = (struck.row, struck.t, struck.normal, struck.spin_in, struck.spin_out)
    for row, t, n, before, spin in zip(*columns, strict=True):
        after = np.flatnonzero((paths.row == row) & (paths.t == t) & (paths.mode == 0))
        if len(after):
            v = paths.v[after[-1]]
            rolling = np.linalg.norm(v - (v @ n) * n) / RADIUS
            assert spin >= rolling * (1.0 - 1e-9), "what it spins about the normal stays"
            assert before > 0.0 or spin == pytest.approx(rolling, rel=1e-9, abs=1e-9)


def test_the_largest_total_energy_is_in_deposits_and_maps_and_translation_is_less():
    flights, maps = flown()
    ends, struck = flights.deposits, flights.impacts
    rolling = 0.5 * 0.4 * MASS * (RADIUS * struck.spin_in) ** 2
    coming = 0.5 * MASS * struck.speed_in**2 + rolling
    largest = np.zeros(len(ends.rock))
    np.maximum.at(largest, struck.row, coming)
    sound = largest > 0.0
    assert (ends.max_total_energy >= ends.max_energy).all()
    assert (ends.max_total_energy[sound] >= largest[sound] * (1.0 - 1e-12)).all()
    assert maps.spins and maps.energy_kind == "translational and rotational"
    assert maps.zones.energy.largest.max() == pytest.approx(ends.max_total_energy.max(), rel=1e-6)
    assert maps.cells.energy.largest.max() == pytest.approx(ends.max_total_energy.max(), rel=1e-6)
    speed = maps.cells.speed.largest.astype(float)
    assert (maps.cells.energy.largest >= 0.5 * MASS * speed**2 * (1.0 - 1e-6)).all()
    assert (maps.cells.energy.largest > 1.05 * 0.5 * MASS * speed**2).any()


def test_where_nothing_spins_energies_are_translational_to_the_bit():
    flights, maps = flown(spins=False)
    assert maps.energy_kind == "translational" and not maps.spins
    np.testing.assert_array_equal(flights.deposits.max_total_energy, flights.deposits.max_energy)
    assert not flights.deposits.max_rotational_energy.any() and not flights.impacts.spin_in.any()


@pytest.mark.long
def test_both_engines_have_the_same_spins_and_maps():
    (one, maps), (other, others) = flown("reference"), flown("compiled")
    assert made.same_bits(one, other)
    for name in ("largest", "mean"):
        np.testing.assert_array_equal(getattr(maps.cells.energy, name), getattr(others.cells.energy, name))
        np.testing.assert_array_equal(getattr(maps.zones.speed, name), getattr(others.zones.speed, name))


def test_tables_have_what_rotation_adds():
    flights, _ = flown()
    terrain, struck, ends = rough(), flights.impacts, flights.deposits
    table = with_spins(impacts_table(["a"], terrain, ends, struck), ends, struck, DENSITY)
    rotational = table["rotational_energy_in_j"].to_numpy()
    assert diameter_of(ends.mass, DENSITY) == pytest.approx(2 * RADIUS)
    assert rotational == pytest.approx(0.2 * MASS * (RADIUS * struck.spin_in) ** 2)
    assert table["total_energy_in_j"].to_numpy() == pytest.approx(table["energy_in_j"].to_numpy() + rotational)
    assert table.schema.field("spin_in").metadata == {b"unit": b"rad/s"}
    assert with_energies(table.slice(0, 0), replace_rows(ends)).column_names[-1] == "max_total_energy_j"


def replace_rows(ends):
    """Return the deposits `ends` with zero rows."""
    return type(ends)(**{name: column[:0] for name, column in vars(ends).items() if column is not None})


@pytest.mark.parametrize(("rebound", "spins"), [("constant", False), ("pfeiffer_bowen", True)])
def test_a_run_writes_rotation_where_rocks_spin_and_nowhere_else(tmp_path, rebound, spins):
    path = tmp_path / "pit.yaml"
    path.write_text(SCENE.replace("REBOUND", rebound))
    run = run_scene(read_scene(path), tmp_path / "out")
    columns = parquet.read_schema(tmp_path / "out" / "impacts.parquet").names
    header = (tmp_path / "out" / "deposits.csv").read_text().splitlines()[0]
    facts = (tmp_path / "out" / "summary.json").read_text()
    assert run.maps.spins == spins
    assert ("total_energy_in_j" in columns) == ("max_total_energy_j" in header) == spins
    assert ("max_rotational_energy_j" in facts) == spins
    assert f'"energy": "{run.maps.energy_kind}"' in facts


def test_a_sphere_that_rolls_has_seven_fifths_of_its_translational_energy():
    """A solid sphere that rolls from rest has v^2 = 10/7 g h, and its total energy is m g h."""
    terrain = made.incline(20.0, down=40.0)
    _, normal = made.down_the_slope(20.0)
    tallies = replace(over(terrain, compiled=False), spins=True)
    physics = spheres(Surface(0.0, 0.8, 0.9, 0.0, 0.0))
    releases = made.released(0.5 * normal)
    flights = fly_ensemble(made.engine_over("reference", terrain), physics, releases, watch=tallies)
    maps, paths, ends = tallies.maps(1, ()), flights.paths, flights.deposits
    rolls = np.flatnonzero(paths.mode == Mode.SLIDING)
    last = rolls[-1]
    drop = paths.x[0, 2] - paths.x[last + 1, 2]
    assert drop > 10.0
    assert (paths.v_end[last] ** 2).sum() == pytest.approx(10.0 / 7.0 * 9.81 * drop, rel=1e-6)
    cell = maps.cells.cell == _square(tallies.ground.raster, paths.x[rolls[len(rolls) // 2]])
    ratio = maps.cells.energy.largest[cell] / (0.5 * MASS * maps.cells.speed.largest[cell].astype(float) ** 2)
    assert ratio == pytest.approx(1.4, rel=1e-5)
    assert ends.max_rotational_energy[0] == pytest.approx(0.2 * MASS * (paths.v_end[last] ** 2).sum(), rel=1e-6)


def _square(raster, x):
    return int((x[1] - raster.y) // raster.cell) * raster.nx + int((x[0] - raster.x) // raster.cell)
