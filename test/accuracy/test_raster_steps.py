"""Tests of fixed steps over a raster: order of convergence, facet below a point, terrain sampled as heights."""

import numpy as np
import pytest
from flights.scenes_of_facets import down_the_slope, engine_over, flight, fly, incline, rough_grid, surface

from rpf3d_core.accuracy.numerical import under_ground
from rpf3d_core.accuracy.on_raster import rastered
from rpf3d_core.detection.stepped_raster import facet_over
from rpf3d_core.simulation.engines import engine_of, stepping_over_squares
from rpf3d_core.terrain.facets import facets_of
from rpf3d_core.values import STANDARD_GRAVITY, Outcome

G = STANDARD_GRAVITY
STEPS = (0.02, 0.01, 0.005, 0.0025, 0.00125)
ORDER, ORDER_WITHIN = 1.0, 0.1
"""Expected order of convergence and its tolerance: mean errors of 64 rocks scatter by about a tenth."""
ROCKS = 64
NAME = "reference"
"""Engine of most tests, which needs no compilation; one test uses the compiled engine as well."""


def over_squares(terrain, cell: float, dt: float, name: str = NAME):
    raster, squares = rastered(terrain, engine_over(name, terrain), cell)
    engine = engine_of(name, facets_of(raster))
    return stepping_over_squares(engine, squares.x, squares.y, squares.cell, squares.there, dt), raster


def drops() -> tuple[np.ndarray, np.ndarray]:
    k = np.arange(ROCKS)
    x = np.stack([np.full(ROCKS, 2.0), np.linspace(-1, 1, ROCKS), 3.0 + 5.0 * ((k * 0.7548776662) % 1.0)], 1)
    return x, np.stack([1.0 + (k * 0.6180339887) % 1.0, np.zeros(ROCKS), np.zeros(ROCKS)], 1)


@pytest.mark.long
@pytest.mark.parametrize("angle", [0.0, 30.0])
def test_the_first_impact_on_a_plane_converges_with_order_one(angle: float) -> None:
    terrain, normal = incline(angle, half_width=20.0), down_the_slope(angle)[1]
    x, v = drops()
    a, b, c = -0.5 * G * normal[2], v @ normal, x @ normal
    t = (-b - np.sqrt(b * b - 4 * a * c)) / (2 * a)
    exact = x + v * t[:, None] - np.array([0.0, 0.0, 0.5 * G]) * (t**2)[:, None]
    errors = []
    for dt in STEPS:
        impacts = fly(over_squares(terrain, 1.0, dt)[0], flight(surface()), x, v).impacts
        first = impacts.x[np.unique(impacts.row, return_index=True)[1]]
        assert (first @ normal < 0.0).all(), "an impact is seen below the ground"
        errors.append(np.linalg.norm(first - exact, axis=1).mean())
    slope = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert slope == pytest.approx(ORDER, abs=ORDER_WITHIN), errors


def test_the_facet_over_which_a_point_lies_is_the_one_that_contains_it_in_plan() -> None:
    terrain = rough_grid(6, 12.0, 0.3, 0.5, seed=2)
    engine, raster = over_squares(terrain, 2.0, 0.01)
    for x, y in np.random.default_rng(2).uniform(0.01, 11.9, (200, 2)):
        f = facet_over(engine.method, float(x), float(y))
        a, b, c = raster.vertices[raster.triangles[f]][:, :2]
        weights = np.linalg.solve(np.column_stack([b - a, c - a]), np.array([x, y]) - a)
        assert weights.min() >= -1e-9 and weights.sum() <= 1.0 + 1e-9
    assert facet_over(engine.method, -0.1, 5.0) == facet_over(engine.method, 5.0, 12.5) == -1


def test_a_raster_has_the_heights_and_the_zones_of_the_ground_under_its_corners() -> None:
    terrain = rough_grid(6, 12.0, 0.3, 0.5, seed=2)
    engine = engine_over(NAME, terrain)
    raster, _ = rastered(terrain, engine, 2.0)
    above = raster.vertices + np.array([0.0, 0.0, 5.0])
    heights = engine.ground_below(above)[:, 0]
    assert heights == pytest.approx(5.0, abs=1e-9)
    assert set(raster.zone) == set(terrain.zone)


def test_no_rock_falls_through_a_raster_and_both_engines_fly_alike() -> None:
    terrain = rough_grid(10, 20.0, 0.2, 0.3, seed=6)
    x = np.random.default_rng(6).uniform((2, 5, 4), (8, 15, 8), (40, 3))
    both = []
    for name in ("reference", "compiled"):
        engine, _ = over_squares(terrain, 1.0, 0.01, name)
        deposits = fly(engine, flight(surface(), "none"), x).deposits
        assert not under_ground(deposits, engine).any()
        assert (deposits.outcome == Outcome.STOPPED).mean() > 0.5
        both.append(deposits.x)
    np.testing.assert_array_equal(*both)


def test_of_a_terrain_smaller_than_a_cell_a_raster_leaves_nothing() -> None:
    terrain = rough_grid(4, 2.0, 0.2, 0.1, seed=6)
    assert len(rastered(terrain, engine_over(NAME, terrain), 5.0)[0].triangles) == 0
