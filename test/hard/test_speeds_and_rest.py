"""Tests of rocks at speeds from 1e-6 to 300 m/s, and at rest."""

import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH, MODELS, NEAR, G, along_flights, lies_on, loses_energy, outcomes
from flights.scenes_of_facets import (
    box,
    down_the_slope,
    engine_over,
    flight,
    floor,
    fly,
    incline,
    joined,
    rough_grid,
    strip,
    surface,
)

from rpf3d_core.materials.library import Surface
from rpf3d_core.values import Mode, Outcome

SLOW, FAST = 1e-6, 300.0


@BOTH
def test_a_rock_that_creeps_over_level_ground_without_friction_is_still_moving_when_time_is_up(engine):
    """At 1e-6 m/s the rock moves 3.6 mm in an hour, across an edge between two facets."""
    over = engine_over(engine, floor(4.0, cells=8))
    flights = fly(over, flight(Surface(0.5, 0.8, 0.0, 0.0)), (-1e-3, 0.3, 0.0), (SLOW, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.MAX_TIME
    assert flights.deposits.x[0] == pytest.approx((2.6e-3, 0.3, 0.0), abs=1e-10)


@BOTH
def test_a_rock_of_a_micrometre_a_second_stops_after_its_braking_way(engine):
    """The braking distance v^2 / (2 mu g) = 1e-13 m is less than the contact tolerance."""
    flights = fly(
        engine_over(engine, floor(4.0, cells=8)), flight(surface(stop_speed=0.0)), (0.3, 0.1, 0), (SLOW, 0, 0)
    )
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.t[0] == pytest.approx(SLOW / (math.tan(math.radians(30)) * G), rel=0.01)
    assert flights.deposits.x[0] == pytest.approx((0.3, 0.1, 0.0), abs=1e-12)


@BOTH
@MODELS
def test_a_rock_dropped_from_a_micrometre_a_second_falls_as_from_rest(engine, model):
    over = engine_over(engine, floor(4.0, cells=8))
    flights = fly(over, flight(surface(0.6, 0.8), model), (0.3, 0.1, 2.0), (SLOW, 0.0, 0.0))
    t0 = math.sqrt(4.0 / G)
    assert flights.deposits.t[0] == pytest.approx(t0 * 1.6 / 0.4, rel=1e-12)
    assert flights.deposits.x[0, 0] - 0.3 == pytest.approx(SLOW * t0 * (1 + 2 * 0.48 / 0.52), rel=1e-6)


@BOTH
def test_a_rock_that_creeps_over_a_crest_falls_down_the_cliff_behind_it(engine):
    over = engine_over(engine, strip([(-20.0, 60.0), (0.0, 60.0), (0.0, 0.0), (200.0, 0.0)]))
    flights = fly(over, flight(Surface(0.5, 0.8, 0.0, 0.0)), (-1e-6, 0.3, 60.0), (SLOW, 0.0, 0.0))
    assert flights.impacts.x[0] == pytest.approx((SLOW * math.sqrt(120 / G), 0.3, 0.0), abs=1e-9)
    assert flights.impacts.speed_in[0] == pytest.approx(math.sqrt(120 * G), rel=1e-12)


@BOTH
def test_a_rock_of_300_m_per_s_meets_a_wall_when_and_where_it_must(engine):
    over = engine_over(engine, strip([(-110.0, 0.0), (100.0, 0.0), (100.0, 60.0), (120.0, 60.0)], across=2))
    flights = fly(over, flight(surface(0.5, 0.8), "none"), (-100.0, 0.3, 30.0), (FAST, 0.0, 0.0))
    t = 200.0 / FAST
    hit = flights.impacts
    assert (hit.t[0], *hit.x[0]) == pytest.approx((t, 100.0, 0.3, 30.0 - 0.5 * G * t * t), rel=1e-12)
    assert tuple(flights.paths.v[1]) == pytest.approx((-0.5 * FAST, 0.0, -0.8 * G * t), rel=1e-12)


@BOTH
def test_a_rock_of_300_m_per_s_passes_through_no_sheet_however_thin(engine):
    """Rocks fly steeply and at grazing angles towards two sheets 1e-6 m apart; they always hit the upper sheet."""
    over = engine_over(engine, joined(floor(5.0, cells=3), floor(5.0, z=1e-6, cells=4)))
    draw = np.random.default_rng(3)
    aim, off = draw.uniform(-4, 4, (40, 2)), draw.normal(size=(40, 3))
    off[:, 2] = -np.abs(off[:, 2]) * np.where(np.arange(40) < 20, 1.0, 1e-3) - 1e-4
    v = FAST * off / np.linalg.norm(off, axis=1, keepdims=True)
    x = np.concatenate([aim, np.full((40, 1), 1e-6)], 1) - 0.01 * v
    flights = fly(over, flight(surface(), "none", max_impacts=1), x, v)
    inside = np.abs(flights.impacts.x[:, :2]).max(axis=1) <= 5.0
    assert inside.sum() == len(flights.impacts.t) >= 30
    np.testing.assert_allclose(flights.impacts.x[:, 2], 1e-6, atol=1e-12)


@BOTH
@MODELS
def test_rocks_of_300_m_per_s_shot_at_rough_ground_never_get_below_it(engine, model):
    terrain = rough_grid(8, 16.0, 0.5, 0.5, seed=2)
    draw = np.random.default_rng(2)
    x = np.concatenate([draw.uniform((1, 4), (5, 12), (40, 2)), np.full((40, 1), 1.0)], 1)
    v = draw.normal(size=(40, 3))
    v[:, 2] = -np.abs(v[:, 2]) - 2.0
    v *= FAST / np.linalg.norm(v, axis=1, keepdims=True)
    over = engine_over(engine, terrain)
    flights = fly(over, flight(surface(0.5, 0.8), model), x, v)
    assert np.all(flights.deposits.impacts >= 1) and loses_energy(flights)
    events = flights.paths.x[(flights.paths.mode != Mode.FLIGHT) & (flights.paths.mode != Mode.END)]
    hits = np.concatenate([flights.impacts.x, events])
    below = over.ground_below(np.add(hits, (0, 0, 1e-6)))
    on = ((hits[:, :2] > 1e-5) & (hits[:, :2] < 16 - 1e-5)).all(1)
    assert np.all(below[on, 1] >= 0) and np.all(below[on, 0] < 2e-6), "on the ground, and nowhere under it"


@BOTH
def test_a_rock_of_300_m_per_s_in_a_small_box_stays_in_it_until_it_is_slow(engine):
    flights = fly(engine_over(engine, box(5.0, 5000.0)), flight(surface(0.9, 0.9)), (0.0, 0.3, 5.0), (FAST, 200, 50))
    points = along_flights(flights)
    assert flights.deposits.outcome[0] == Outcome.STOPPED and flights.deposits.impacts[0] > 50
    assert np.all(np.abs(points[:, :2]) <= 5.0 + NEAR) and np.all(points[:, 2] >= -NEAR)
    assert loses_energy(flights)


@BOTH
@MODELS
@pytest.mark.parametrize("angle", [0.0, 1e-7, 1e-3, 10.0])
def test_a_vertical_drop_leaves_a_rock_at_rest_where_the_series_ends(engine, model, angle):
    """The speed along the ground is zero or almost zero; the direction of motion must not be divided by zero."""
    over = engine_over(engine, incline(angle, cells=(7, 3)))
    flights = fly(over, flight(surface(0.5, 0.8, 30.0), model), (0.3, 0.2, 3.0))
    a, h = math.radians(angle), 3.0 + 0.3 * math.tan(math.radians(angle))
    speed = math.sqrt(2 * G * h)
    w, u, R_n, R_t = 0.5 * speed * math.cos(a), 0.8 * speed * math.sin(a), 0.5, 0.8
    T = 2 * w / (G * math.cos(a))
    c = R_t * G * math.sin(a) * T / (R_t - R_n)
    s = (u + c) * T / (1 - R_t * R_n) - c * T / (1 - R_n**2) + 0.5 * G * math.sin(a) * T**2 / (1 - R_n**2)
    along = math.cos(a) * (flights.deposits.x[0, 0] - 0.3) - math.sin(a) * (
        flights.deposits.x[0, 2] + 0.3 * math.tan(a)
    )
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.t[0] == pytest.approx(speed / G + T / (1 - R_n), rel=1e-9)
    assert along == pytest.approx(s, rel=1e-9, abs=1e-14)
    assert flights.deposits.x[0, 1] == pytest.approx(0.2, abs=1e-14)


@BOTH
@MODELS
def test_a_rock_released_at_rest_on_flat_ground_has_stopped_before_any_time_has_passed(engine, model):
    flights = fly(engine_over(engine, floor(4.0, cells=8)), flight(surface(), model), (0.3, 0.1, 0.0))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert (flights.deposits.t[0], flights.deposits.path[0], flights.deposits.impacts[0]) == (0.0, 0.0, 0)
    assert flights.deposits.ground_speed[0] == 0.0


@BOTH
@pytest.mark.parametrize("strike", [0.0, 33.0, 90.0, 123.0])
@pytest.mark.parametrize(("slope", "friction"), [(20.0, 30.0), (30.0, 20.0), (60.0, 59.0), (1.0, 2.0), (0.01, 0.0)])
def test_a_rock_released_at_rest_on_a_slope_stays_below_the_friction_angle_and_slides_above_it(
    engine, slope, friction, strike
):
    descent, _ = down_the_slope(slope, strike)
    over = engine_over(engine, incline(slope, strike, cells=(9, 3)))
    flights = fly(over, flight(surface(0.5, 0.8, friction, 0.5), max_time=1e5), 0.37 * descent)
    if friction > slope:
        assert flights.deposits.outcome[0] == Outcome.STOPPED and flights.deposits.path[0] < 1e-12
    else:
        a = G * (math.sin(math.radians(slope)) - math.tan(math.radians(friction)) * math.cos(math.radians(slope)))
        assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
        assert flights.deposits.t[0] == pytest.approx(math.sqrt(2 * (60.0 - 0.37) / a), rel=1e-6)
        assert flights.deposits.max_speed[0] == pytest.approx(math.sqrt(2 * (60.0 - 0.37) * a), rel=1e-6)


@BOTH
def test_a_rock_that_no_ground_model_carries_on_stays_where_the_thesis_stops_it(engine):
    """With `ground: none` only the speed decides (thesis, section 3.5), so a rock at rest stays even on 60 degrees."""
    descent, _ = down_the_slope(60.0, 0.0)
    over = engine_over(engine, incline(60.0))
    flights = fly(over, flight(surface(), "none"), [0.37 * descent] * 2, [(0.0, 0.0, 0.0), 3.0 * descent])
    assert list(flights.deposits.outcome) == [Outcome.STOPPED, Outcome.UNRESOLVED_CONTACT]
    assert lies_on(over, flights) and outcomes(flights) == {Outcome.STOPPED, Outcome.UNRESOLVED_CONTACT}
