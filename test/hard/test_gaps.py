"""Tests of rocks at gaps of the terrain: they end at the level of the surrounding ground and are not counted below."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from flights.on_both_engines import ENGINES
from flights.rolling_spheres import roll, spheres
from flights.scenes_of_facets import flight, fly, surface, terrain_of

import rpf3d_core
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.simulation.engines import stepping
from rpf3d_core.values import DEPOSITED, OUTCOME_SENTENCES, Outcome

G, SLOPE, SIDE = 9.81, 0.5, 24
LOST, LEFT = Outcome.LOST_TO_HOLE, Outcome.LEFT_TERRAIN
AVA = Path(__file__).parents[3] / "shared" / "data" / "alps" / "avaKot.asc.gz"


def slope(missing=lambda i, j: False):
    """Return a plane of 1 m squares that falls eastwards by SLOPE (m/m); `missing(i, j)` is true for absent squares."""
    j, i = np.mgrid[: SIDE + 1, : SIDE + 1]
    vertices = np.stack([i.ravel(), j.ravel(), -SLOPE * i.ravel()], axis=1).astype(float)
    first = np.array([b * (SIDE + 1) + a for b in range(SIDE) for a in range(SIDE) if not missing(a, b)])[:, None]
    halves = (0, 1, SIDE + 2), (0, SIDE + 2, SIDE + 1)
    return terrain_of(vertices, np.concatenate([first + np.array(half) for half in halves]))


def hole(i, j):
    return 8 <= i < 12 and 8 <= j < 14


def strip(i, j):
    return 10 <= i < 12


def bay(i, j):
    return 8 <= i < 12 and j >= 6


def above_plane(x):
    return x[..., 2] + SLOPE * x[..., 0]


def rocks(count=120, seed=4):
    """Return the positions (count, 3) m and velocities (count, 3) m/s of rocks that fly east from the upper end."""
    rng = np.random.default_rng(seed)
    x = np.column_stack([np.full(count, 1.5), rng.uniform(7.0, 15.0, count), np.full(count, -0.5)])
    return x, np.column_stack([rng.uniform(1.0, 6.0, count), rng.uniform(-0.5, 0.5, count), rng.uniform(0, 3, count)])


@pytest.mark.parametrize(
    ("missing", "outcome"), [(hole, LOST), (strip, LOST), (bay, LEFT)], ids=["hole", "strip", "bay"]
)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_ends_where_it_passes_below_the_ground_around_a_gap(engine, missing, outcome):
    x, v = rocks()
    flights = fly(engine_over(engine, slope(missing)), flight(surface(0.4, 0.8, 20.0)), x, v)
    ends = flights.deposits
    inside = np.array([missing(math.floor(a), math.floor(b)) for a, b in ends.x[:, :2]]) | (
        np.isclose(ends.x[:, 0], 8.0) | np.isclose(ends.x[:, 0], 10.0)
    )
    at_gap = inside & (np.abs(above_plane(ends.x)) < 1e-6)
    assert at_gap.sum() > 30 and (ends.outcome[at_gap] == outcome).all()
    assert not (ends.outcome[~at_gap] == LOST).any()
    assert (above_plane(flights.paths.x) > -1e-6).all() and (above_plane(ends.x) > -1e-6).all()
    energy = (v * v).sum(axis=1) + 2.0 * G * (x[:, 2] - ends.x[:, 2])
    assert (ends.max_speed[at_gap] ** 2 <= energy[at_gap] * (1.0 + 1e-9)).all()
    assert LOST not in DEPOSITED and "hole" in OUTCOME_SENTENCES[LOST] and "hole" not in OUTCOME_SENTENCES[LEFT]


def test_both_engines_lose_the_same_rocks_to_the_last_bit():
    x, v = rocks()
    one, other = (
        fly(engine_over(name, slope(hole)), flight(surface(0.4, 0.8, 20.0)), x, v).deposits for name in ENGINES
    )
    for column in ("x", "t", "path", "outcome", "max_speed", "impacts"):
        assert np.array_equal(getattr(one, column), getattr(other, column))


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_that_flies_over_a_gap_is_that_over_whole_ground(engine):
    x, v = rocks(60)
    x[:, 0], v[:, 0], v[:, 2] = 6.0, 9.0, 5.0
    x[:, 2] = -2.5
    physics = flight(surface(0.0, 0.1, 60.0))  # rocks that land beyond the gap stay there
    holed, whole = (fly(engine_over(engine, slope(*which)), physics, x, v) for which in ((hole,), ()))
    assert (holed.deposits.outcome == Outcome.STOPPED).all() and (holed.deposits.x[:, 0] > 12.0).all()
    for column in ("x", "t", "path", "max_speed", "outcome", "impacts"):
        assert np.array_equal(getattr(holed.deposits, column), getattr(whole.deposits, column))
    assert np.array_equal(holed.paths.x, whole.paths.x) and np.array_equal(holed.impacts.x, whole.impacts.x)


@pytest.mark.parametrize("engine", ENGINES)
def test_ground_at_the_very_edge_of_a_hole_still_holds(engine):
    edges = [(8.0, 8.0), (8.0, 10.0), (8.0, 11.3), (12.0, 14.0), (9.5, 8.0), (12.0, 9.7)]
    x = np.array([(a, b, -SLOPE * a) for a, b in edges])
    held = fly(engine_over(engine, slope(hole)), flight(surface(0.4, 0.8, 60.0)), x).deposits
    assert (held.outcome == Outcome.STOPPED).all() and np.allclose(held.x, x, atol=1e-9)
    dropped = fly(engine_over(engine, slope(hole)), flight(surface(0.0, 0.0, 60.0)), x + np.array([0, 0, 1.0])).deposits
    assert (dropped.outcome == Outcome.STOPPED).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_that_slides_over_the_edge_of_a_hole_is_lost_at_the_edge(engine):
    x = np.array([(4.0, b, -SLOPE * 4.0) for b in (8.4, 9.3, 12.7)])
    v = np.array([(2.0, 0.0, -2.0 * SLOPE)] * 3)
    ends = fly(engine_over(engine, slope(hole)), flight(surface(0.4, 0.8, 10.0)), x, v).deposits
    assert (ends.outcome == LOST).all() and np.allclose(ends.x[:, 0], 8.0, atol=1e-9)
    assert np.allclose(above_plane(ends.x), 0.0, atol=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_whole_ground_has_nothing_that_looks_for_gaps(engine):
    assert engine_over(engine, slope()).caps is None


@pytest.mark.long
@pytest.mark.parametrize("engine", ENGINES)
def test_steps_do_not_lead_below_a_gap_either(engine):
    x, v = rocks(40)
    stepped = stepping(engine_over(engine, slope(hole)), 1e-3, 0.02)
    ends = fly(stepped, flight(surface(0.4, 0.8, 20.0), "none"), x, v).deposits
    lost = ends.outcome == LOST
    assert lost.sum() > 5 and (np.abs(above_plane(ends.x[lost])) < 1e-6).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_sphere_is_lost_where_its_centre_passes_below_the_ground_around(engine):
    ground = surface(0.3, 0.8, 30.0)
    x = np.array([(5.0, b, -SLOPE * 5.0 + 0.5) for b in (9.0, 11.5, 12.6)])
    flights = roll(engine_over(engine, slope(hole)), spheres(ground), 0.3, x, (1.5, 0.0, 0.0))
    ends = flights.deposits
    assert (ends.outcome == LOST).all() and np.allclose(above_plane(ends.x), 0.0, atol=1e-6)
    assert ((ends.x[:, 0] > 8.0) & (ends.x[:, 0] < 12.0)).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_small_slow_sphere_rolls_around_the_edge_and_is_lost_all_the_same(engine):
    level = slope(hole)
    level = terrain_of(level.vertices * (1.0, 1.0, 0.0), level.triangles)
    physics = spheres(surface(0.3, 0.8, 40.0, 0.0))
    flights = roll(engine_over(engine, level), physics, 0.4, (7.5, 11.0, 0.4), (0.3, 0.0, 0.0))
    assert flights.deposits.outcome[0] == LOST and abs(flights.deposits.x[0, 2]) < 1e-6


# --- a scene ----------------------------------------------------------------------------------------------------------

SCENE = """
terrain: {{files: [{{path: dem.asc, zone: slope}}]}}
materials: {{slope: {{normal_restitution: 0.4, tangential_restitution: 0.8, friction_angle_deg: 15}}}}
rock: {{density: 2700, diameter: 0.5}}
sources:
  - {{name: top, line: [[3, 14, 0], [3, 26, 0]], above_ground: 0.5, rocks: 400, velocity: [3, 0, 0]}}
rebound: constant
ground: sliding
hazard: {{cell: 1}}
areas_of_interest: [{{name: ramp, polygons: ramp.geojson}}]
engine: {engine}
"""


def ran(folder, engine, there):
    """Run a scene with a height grid that falls eastwards; return the run and its summary.

    there : (rows, columns) bool, False for the points that are missing
    """
    rows, columns = there.shape
    z = 100.0 - 0.6 * np.arange(columns) + np.zeros((rows, 1))
    lines = [f"ncols {columns}", f"nrows {rows}", "xllcenter 0", "yllcenter 0", "cellsize 1", "NODATA_value -9999"]
    lines += [" ".join(map(str, row)) for row in np.where(there, z, -9999)]
    (folder / "dem.asc").write_text("\n".join(lines) + "\n")
    ring = [[30, 5], [36, 5], [36, 35], [30, 35], [30, 5]]
    (folder / "ramp.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    (folder / "scene.yaml").write_text(SCENE.format(engine=engine))
    run = rpf3d_core.simulate(folder / "scene.yaml")
    rpf3d_core.write_run(run, folder / "out")
    return run, json.loads((folder / "out" / "summary.json").read_text())


@pytest.mark.long
@pytest.mark.parametrize("engine", ENGINES)
def test_nothing_downhill_of_a_hole_is_counted_and_the_summary_says_how_many_were_lost(tmp_path, engine):
    there = np.ones((41, 41), bool)
    there[2:39, 12:16] = False
    run, facts = ran(tmp_path, engine, there)
    lost = run.totals.outcomes[LOST]
    assert lost == 400
    raster = run.maps.raster
    x = raster.x + raster.cell * (run.maps.cells.cell % raster.nx) + run.terrain.frame.origin[0]
    assert 11.0 <= x.max() < 16.0, "no rock came out of the hole, so no cell beyond it"
    highest = float(np.sqrt(3.0**2 + 2.0 * G * (0.5 + 0.6 * 13.0)))  # fall from x = 3 m to x = 16 m
    assert run.flights.deposits.max_speed[run.flights.deposits.outcome == LOST].max() <= highest
    assert facts["lost_to_holes"]["rocks"] == lost
    ramp = facts["areas_of_interest"]["ramp"]
    assert ramp["lost_to_holes"]["rocks"] == lost
    assert ramp["reached_at_most"]["rocks"] == min(ramp["reached"]["rocks"] + lost, 400)
    assert f"{lost} of 400 rocks" in facts["lost_to_holes"]["meaning"]
    zones = json.loads((tmp_path / "out" / "hazard" / "zones.geojson").read_text())
    assert zones["rocks_lost_to_holes"] == lost
    assert ",lost_to_holes_rocks,reached_at_most_share" in (tmp_path / "out" / "hazard" / "benches.csv").read_text()
    assert (tmp_path / "out" / "deposits.csv").read_text().count(',"lost_to_hole",') == lost


def test_a_run_without_holes_says_so(tmp_path):
    run, facts = ran(tmp_path, "compiled", np.ones((41, 41), bool))
    assert facts["lost_to_holes"]["rocks"] == 0 and facts["lost_to_holes"]["meaning"] is None
    assert "reached_at_most" not in facts["areas_of_interest"]["ramp"]
    assert run.maps.lost == 0


@pytest.mark.skipif(not AVA.exists(), reason="the survey of an avalanche path is not there: ../shared/data/alps")
def test_over_a_real_survey_no_rock_is_followed_below_the_ground_around(tmp_path):
    (tmp_path / "scene.yaml").write_text(
        f"""
terrain: {{files: [{{path: {AVA}, zone: rock}}]}}
materials: {{rock: {{normal_restitution: 0.5, tangential_restitution: 0.9, friction_angle_deg: 20}}}}
rock: {{density: 2700, diameter: 1.0}}
sources: [{{name: everywhere, zone: rock, above_ground: 1.0, rocks: 2000, velocity: [4, 0, 0]}}]
rebound: constant
ground: sliding
engine: compiled
"""
    )
    run = rpf3d_core.simulate(tmp_path / "scene.yaml")
    ends, vertices = run.flights.deposits, run.terrain.vertices
    gone = np.isin(ends.outcome, (LOST, LEFT))
    assert gone.sum() > 50
    for x in ends.x[gone]:
        near = np.hypot(*(vertices[:, :2] - x[:2]).T) < 60.0
        assert x[2] >= vertices[near, 2].min() - 1e-6
    hardest = max(run.flights.impacts.speed_in.max(), 4.0)
    assert run.maps.cells.speed.largest.max() <= 1.02 * hardest
