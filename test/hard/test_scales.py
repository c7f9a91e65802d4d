"""Tests at scales from centimetres to a mountain of 3,000 m, and far from the origin: tolerances are not absolute.

Under the same gravity, lengths are proportional to the scale and times to its square root. Powers of four scale without
rounding, so the result must scale to the last bit. A tolerance in fixed metres or seconds would break this.
"""

import math
from pathlib import Path

import numpy as np
import pytest
from flights.on_both_engines import BOTH, MODELS, G, lies_on, loses_energy, outcomes
from flights.scenes_of_facets import (
    cone,
    down_the_slope,
    engine_over,
    flight,
    fly,
    incline,
    rough_grid,
    surface,
    terrain_of,
)

import rpf3d_core as rpf3d
from rpf3d_core.results.mesh_writer import write_mesh
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.values import Outcome

SCALES = pytest.mark.parametrize("power", [-4, -2, 2, 4], ids=["6 cm", "1 m", "256 m", "4 km"])
"""Scales 4^power of a slope of 16 m; the ids are the scaled lengths."""
SURVEY = (5e5, 4.5e6, 1687.0)
"""Origin (m) of a survey: x and y in a projected grid, z of the release in the thesis (table 5-1)."""


@BOTH
@MODELS
@SCALES
def test_a_rough_slope_of_any_size_gives_the_same_answer_to_the_last_bit(engine, model, power):
    length, speed = 4.0**power, 2.0**power
    one = rough_grid(10, 16.0, 0.5, 0.4, seed=3)
    other = terrain_of(length * one.vertices, one.triangles)
    draw = np.random.default_rng(3)
    x = np.concatenate([draw.uniform(1, 15, (30, 2)), np.full((30, 1), 2.0)], 1)
    v = draw.normal(size=(30, 3))
    small, large = (
        fly(
            engine_over(engine, terrain), flight(surface(0.4, 0.8, 32.0, 0.5 * s), model, smallest_bounce=1e-3 * k),
            k * x, s * v,
        ).deposits
        for terrain, k, s in ((one, 1.0, 1.0), (other, length, speed))
    )  # fmt: skip
    np.testing.assert_array_equal(small.outcome, large.outcome)
    moved = small.impacts > 0  # a rock at rest starts at the fixed speed CREEP, which does not scale
    np.testing.assert_allclose(large.x, length * small.x, rtol=0.0, atol=1e-6 * length)
    np.testing.assert_allclose(large.t, speed * small.t, rtol=1e-6)
    if model == "none":
        np.testing.assert_array_equal(large.x[moved], length * small.x[moved])
        np.testing.assert_array_equal(large.t[moved], speed * small.t[moved])


@BOTH
@pytest.mark.parametrize("angle", [22.0, 40.0, 50.0, 59.0])
def test_a_ball_in_the_laboratory_bounces_down_a_ramp_of_half_a_metre_as_the_series_says(engine, angle):
    """R_n = 0.84 and R_t = 0.70 as in the thesis, chapter 4; here the ball drops from 5 cm only (validation 2.2)."""
    a, h, R_n, R_t = math.radians(angle), 0.05, 0.84, 0.70
    descent, _ = down_the_slope(angle, 0.0)
    over = engine_over(engine, incline(angle, down=2.0, up=0.1, half_width=0.3, cells=(40, 5), jitter=2))
    flights = fly(over, flight(surface(R_n, R_t), "none", smallest_bounce=1e-5), (0.0, 0.011, h))
    speed = math.sqrt(2 * G * h)
    w, u = R_n * speed * math.cos(a), R_t * speed * math.sin(a)
    T = 2 * w / (G * math.cos(a))
    c = R_t * G * math.sin(a) * T / (R_t - R_n)
    s = (u + c) * T / (1 - R_t * R_n) - c * T / (1 - R_n**2) + 0.5 * G * math.sin(a) * T**2 / (1 - R_n**2)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.t[0] - flights.impacts.t[0] == pytest.approx(T / (1 - R_n), rel=1e-9)
    np.testing.assert_allclose(flights.deposits.x[0], s * descent + (0, 0.011, 0), atol=1e-9)


@BOTH
def test_a_rock_on_a_mountain_of_3000_m_bounces_from_summit_to_foot_as_the_series_says(engine):
    """The slope has 37 degrees, 5 km and 400 facets; with R_n = 0.5 and R_t = 1 the rock reaches its foot."""
    a = math.radians(37.0)
    descent, _ = down_the_slope(37.0, 0.0)
    over = engine_over(engine, incline(37.0, down=5000.0, cells=(100, 2), jitter=5, half_width=100.0))
    flights = fly(over, flight(surface(0.5, 1.0, 20.0)), (0.0, 0.3, 50.0))
    speed = math.sqrt(2 * G * 50.0)
    first, bouncing = speed / G, 2 * 0.5 * speed / G / 0.5
    u = speed * math.sin(a) + G * math.sin(a) * bouncing
    s = speed * math.sin(a) * bouncing + 0.5 * G * math.sin(a) * bouncing**2
    pull = G * (math.sin(a) - math.tan(math.radians(20)) * math.cos(a))
    left = (math.sqrt(u * u + 2 * pull * (5000.0 - s)) - u) / pull
    assert flights.deposits.ground_speed[0] == pytest.approx(u, rel=1e-9)
    leaves = flights.paths.x[-1] if len(flights.paths.t) else flights.deposits.x[0]
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert flights.deposits.t[0] == pytest.approx(first + bouncing + left, rel=1e-8)
    np.testing.assert_allclose(leaves, 5000.0 * descent + (0, 0.3, 0), atol=1e-6)


@BOTH
@MODELS
def test_rocks_from_the_summit_of_a_mountain_never_go_below_its_flanks(engine, model):
    over = engine_over(engine, cone(12, radius=4000.0, height=-3000.0))
    draw = np.random.default_rng(6)
    x = np.concatenate([draw.uniform(-5, 5, (20, 2)), np.full((20, 1), 2.0)], 1)
    x[0, :2] = 0.0
    flights = fly(over, flight(surface(0.5, 0.95, 30.0), model), x, (1.0, 0.2, 0.0))
    heights = (flights.paths.x @ np.asarray(over.facets.normals).T).max(axis=1)
    assert heights.min() > -1e-8, "above at least one of the planes: a convex mountain"
    assert loses_energy(flights) and lies_on(over, flights)
    if model == "sliding":
        assert outcomes(flights) == {Outcome.LEFT_TERRAIN}


SCENE = """\
terrain: {files: [{path: slope.vtp}]}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8}}
sources: [{name: top, points: [[0, 0, 1]]}]
"""


def flown_at(folder: Path, origin: tuple[float, float, float], engine: str):
    """Fly 12 rocks over a terrain that is read from a survey file with this origin (m).

    Return the first impacts (12, 3) m and the ends (12, 3) m, both relative to the origin, and the outcomes (12,).
    """
    folder.mkdir()
    mesh = rough_grid(10, 16.0, 0.5, 0.2, seed=3)
    write_mesh(folder / "slope.vtp", Terrain(mesh.vertices, mesh.triangles, mesh.zone, mesh.zones, Frame(origin)))
    (folder / "scene.yaml").write_text(SCENE)
    terrain = rpf3d.read_terrain(rpf3d.read_scene(folder / "scene.yaml"))[0]
    assert np.abs(terrain.vertices).max() < 100.0, "one local origin is taken off at load"
    draw = np.random.default_rng(4)
    x = np.concatenate([draw.uniform(2, 10, (12, 2)), np.full((12, 1), 1.5)], 1) + origin
    flights = fly(
        engine_over(engine, terrain), flight(surface(0.4, 0.8, 32.0)), terrain.frame.points_to_local(x), (1.0, 0.2, 0.0)
    )
    first = [flights.impacts.row.tolist().index(i) for i in range(12)]
    places = (terrain.frame.points_to_input(p) - origin for p in (flights.impacts.x[first], flights.deposits.x))
    return *places, flights.deposits.outcome


@BOTH
def test_a_scene_in_survey_coordinates_has_the_outcome_of_the_same_scene_at_the_origin(engine, tmp_path):
    """Coordinates such as 5e5, 4.5e6 and 1687 m: float64 resolves them to 1e-9 m.

    A few impacts on rough ground amplify this rounding error.
    """
    here, there = (flown_at(tmp_path / name, at, engine) for name, at in (("here", (0.0, 0.0, 0.0)), ("there", SURVEY)))
    np.testing.assert_array_equal(there[2], here[2])
    np.testing.assert_allclose(there[0], here[0], atol=2e-9)
    np.testing.assert_allclose(there[1], here[1], atol=1e-5)
