"""Tests that rocks that leave the terrain or reach a limit never have the outcome `stopped`."""

import math

import numpy as np
import pytest
from flights.obstacles_made import with_effects
from flights.on_both_engines import BOTH, MODELS, NEAR, G
from flights.scenes_of_facets import (
    box,
    down_the_slope,
    engine_over,
    flight,
    floor,
    fly,
    incline,
    joined,
    strip,
    surface,
    without_facets,
)

from rpf3d_core.effects.drag import Drag
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import DEPOSITED, Outcome

COMPILED_ONLY = pytest.mark.skipif(not HAS_NUMBA, reason="a million impacts take plain Python some minutes")


@BOTH
@MODELS
@pytest.mark.parametrize("way", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, 1.0)])
def test_a_rock_leaves_through_the_side_where_its_parabola_does(engine, model, way):
    over = engine_over(engine, floor(6.0))
    flights = fly(over, flight(surface(0.9, 1.0), model), (0.0, 0.0, 2.0), (30.0 * way[0], 30.0 * way[1], 0.0))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN and flights.deposits.impacts[0] == 0
    assert flights.deposits.t[0] == pytest.approx(0.2, rel=1e-9)
    assert flights.deposits.x[0] == pytest.approx((6.0 * way[0], 6.0 * way[1], 2.0 - 0.02 * G), abs=1e-9)


@BOTH
def test_a_rock_leaves_a_terrain_sideways_after_bounces_at_its_very_edge(engine):
    over = engine_over(engine, floor(6.0))
    flights = fly(over, flight(surface(0.9, 1.0)), (0.0, 0.3, 2.0), (7.0, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert flights.deposits.x[0, 0] == pytest.approx(6.0, abs=NEAR)


@BOTH
@MODELS
def test_a_rock_that_falls_past_a_rim_is_not_followed_below_the_terrain(engine, model):
    """The terrain is a bench without a floor: a rock that crosses its border has the outcome `left_terrain`."""
    over = engine_over(engine, strip([(-20.0, 60.0), (0.0, 60.0)]))
    flights = fly(over, flight(surface(0.4, 0.9, 10.0), model), (-1.0, 0.3, 61.0), (5.0, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert Outcome.LEFT_TERRAIN not in DEPOSITED and flights.deposits.x[0, 2] >= 60.0 - NEAR


@BOTH
@pytest.mark.parametrize("start", ["flying", "sliding"])
def test_a_rock_leaves_through_a_hole(engine, start):
    """Two facets of a 2 m square are missing: one rock falls into the hole, another slides into it."""
    holed = without_facets(floor(6.0, cells=6), 14, 14 + 36)
    hole = floor(6.0, cells=6).vertices[floor(6.0, cells=6).triangles[14]].mean(0)
    over = engine_over(engine, holed)
    x, v = (np.add(hole, (0, 0, 2)), (0, 0, 0)) if start == "flying" else (np.add(hole, (-3, 0, 0)), (8, 0, 0))
    flights = fly(over, flight(surface(friction_angle=10.0)), x, v)
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert np.abs(flights.deposits.x[0, :2] - hole[:2]).max() < 2.0 and flights.deposits.impacts[0] == 0


@BOTH
def test_a_rock_in_a_hole_above_a_second_terrain_lands_on_that(engine):
    holed = without_facets(floor(6.0, z=4.0, cells=6), 14, 14 + 36)
    hole = floor(6.0, cells=6).vertices[floor(6.0, cells=6).triangles[14]].mean(0)
    flights = fly(engine_over(engine, joined(floor(), holed)), flight(surface()), np.add(hole, (0, 0, 6)))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    np.testing.assert_allclose(flights.deposits.x[0], hole, atol=1e-10)


@BOTH
@pytest.mark.parametrize("spot", [(6.0, 0.7), (6.0, 2.0), (6.0, 6.0)], ids=["edge", "vertex", "corner"])
@pytest.mark.parametrize("slide", [True, False])
def test_a_rock_at_the_very_edge_leaves_if_it_moves_outwards_and_stays_if_it_does_not(engine, spot, slide):
    over = engine_over(engine, floor(6.0, cells=6))
    up = 0.0 if slide else 2.0
    for direction, outcome in ((1.0, Outcome.LEFT_TERRAIN), (-1.0, Outcome.STOPPED), (0.0, Outcome.STOPPED)):
        end = fly(over, flight(surface()), (*spot, up), (direction, -0.1, 0.0)).deposits
        assert end.outcome[0] == outcome
        assert abs(end.x[0, 2]) < NEAR or not slide


@BOTH
@pytest.mark.parametrize("aside", [1e-9, 1e-8, 1e-7, 1e-5, 1e-3])
def test_a_rock_that_slides_out_along_the_rim_leaves_with_air_drag_as_without(engine, aside):
    """The rock on the rim is outside the terrain's box by a rounding error, so its flight through the air is over."""
    over, (descent, _) = engine_over(engine, incline(35.0, cells=(6, 4))), down_the_slope(35.0)
    physics = flight(surface(0.3, 0.8, 20.0, 0.0))
    x, v = np.add(descent, (0.0, 8.0, 0.0)), np.add(2.0 * descent, (0.0, aside, 0.0))
    for each in (physics, with_effects(physics, Drag(0.5, 1.2, 0.01, G))):
        end = fly(over, each, x, v).deposits
        assert end.outcome[0] == Outcome.LEFT_TERRAIN
        assert end.x[0, 1] == pytest.approx(8.0, abs=NEAR)


@BOTH
def test_a_rock_at_its_limit_of_time_is_where_it_would_be_then(engine):
    flights = fly(engine_over(engine, floor()), flight(surface(), max_time=0.5), (0.3, 0.1, 5.0), (2.0, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.MAX_TIME and flights.deposits.t[0] == 0.5
    assert flights.deposits.x[0] == pytest.approx((1.3, 0.1, 5.0 - 0.125 * G), rel=1e-14)


@BOTH
@pytest.mark.parametrize("limit", [1, 7, 500])
def test_a_rock_at_its_limit_of_impacts_has_made_exactly_so_many(engine, limit):
    flights = fly(engine_over(engine, box()), flight(surface(1.0, 1.0), max_impacts=limit), (0.3, 0.1, 5.0), (2, 1, 0))
    assert flights.deposits.outcome[0] == Outcome.MAX_IMPACTS and flights.deposits.impacts[0] == limit


@COMPILED_ONLY
def test_a_million_impacts_without_loss_end_at_their_limit_when_they_must():
    """Dropped from 2 m, the rock has impact n at t_0 (2 n - 1). The reference engine would take two minutes."""
    physics = flight(surface(1.0, 1.0), max_impacts=1_000_000, max_time=1e9)
    over = engine_over("compiled", floor(cells=3))
    end = fly(over, physics, (0.1, 0.3, 2.0), record=False).deposits
    assert end.outcome[0] == Outcome.MAX_IMPACTS and end.impacts[0] == 1_000_000
    assert end.t[0] == pytest.approx(math.sqrt(4.0 / G) * 1_999_999, rel=1e-9)
    assert end.max_speed[0] == pytest.approx(math.sqrt(4.0 * G), rel=1e-9)
    np.testing.assert_allclose(end.x[0], (0.1, 0.3, 0.0), atol=1e-10)


@COMPILED_ONLY
def test_after_a_million_impacts_in_a_box_a_rock_is_still_in_it():
    physics = flight(surface(1.0, 1.0), max_impacts=1_000_000, max_time=1e9)
    end = fly(engine_over("compiled", box()), physics, (1.0, 0.3, 3.0), (2.0, 1.0, 0.0), record=False).deposits
    assert end.outcome[0] == Outcome.MAX_IMPACTS and end.impacts[0] == 1_000_000
    assert np.all(np.abs(end.x[0, :2]) <= 5.0 + 1e-9) and -1e-9 <= end.x[0, 2] <= 3.0 + 2.5 / G + 1e-6
    assert end.max_speed[0] <= math.sqrt(5.0 + 6.0 * G) * (1 + 1e-9), "energy is kept to 1e-9"


@COMPILED_ONLY
def test_a_million_dying_bounces_end_at_rest_when_their_series_does():
    """R_n is so near 1 that the height falls from 2 m to the smallest bounce, 1 mm, in a million bounces."""
    R_n = math.exp(-math.log(2000.0) / 2e6)
    physics = flight(Surface(R_n, 1.0, 0.5, 0.5), max_impacts=1_100_000, max_time=1e9)
    end = fly(engine_over("compiled", floor(cells=3)), physics, (0.1, 0.3, 2.0), record=False).deposits
    assert end.outcome[0] == Outcome.STOPPED and end.impacts[0] == pytest.approx(1_000_000, rel=1e-3)
    assert end.t[0] == pytest.approx(math.sqrt(4.0 / G) * (1 + R_n) / (1 - R_n), rel=1e-8)
