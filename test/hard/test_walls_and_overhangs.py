"""Tests of vertical faces, cliffs, overhangs and an arch, which a height grid cannot represent."""

import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH, MODELS, NEAR, G, along_flights, lies_on, loses_energy, outcomes
from flights.scenes_of_facets import (
    box,
    engine_over,
    flight,
    floor,
    fly,
    joined,
    specific_energy,
    strip,
    surface,
    terrain_of,
)

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.values import Outcome

CLIFF = [(-20.0, 60.0), (0.0, 60.0), (0.0, 0.0), (600.0, 0.0)]


@BOTH
@MODELS
@pytest.mark.parametrize("speed", [0.5, 5.0, 40.0])
def test_a_rock_thrown_over_a_cliff_of_60_m_lands_where_galilei_says(engine, model, speed):
    flights = fly(engine_over(engine, strip(CLIFF, across=3)), flight(surface(0.5, 0.8), model), (-1.0, 0.3, 60.5),
                  (speed, 0.0, math.sqrt(2 * G * 0.5)))  # fmt: skip
    on_top = math.sqrt(1.0 / G) + math.sqrt(2.0 / G)
    if speed * on_top > 1.0:  # the rock is past the crest before it can land on the top
        fall = math.sqrt(1.0 / G) + math.sqrt(2 * 61.0 / G)
        hit = flights.impacts
        assert (hit.t[0], *hit.x[0]) == pytest.approx((fall, speed * fall - 1.0, 0.3, 0.0), rel=1e-12, abs=1e-12)
        assert hit.speed_in[0] == pytest.approx(math.hypot(speed, math.sqrt(2 * G * 61.0)), rel=1e-12)
    assert outcomes(flights) == {Outcome.STOPPED} and loses_energy(flights)
    points = along_flights(flights)
    assert np.all((points[:, 2] >= 60.0 - NEAR) | (points[:, 0] >= -NEAR)), "never inside the cliff"


@BOTH
@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_a_rock_that_slides_over_the_crest_of_a_cliff_takes_off_with_the_speed_it_has_left(engine, speed):
    flights = fly(
        engine_over(engine, strip(CLIFF, across=3)), flight(surface(0.4, 0.8, 2.0, 0.0)), (-1, 0.3, 60), (speed, 0, 0)
    )
    left = math.sqrt(speed**2 - 2 * math.tan(math.radians(2)) * G * 1.0)
    hit = flights.impacts
    assert hit.x[0] == pytest.approx((left * math.sqrt(120 / G), 0.3, 0.0), rel=1e-9, abs=1e-9)
    assert hit.speed_in[0] == pytest.approx(math.hypot(left, math.sqrt(120 * G)), rel=1e-12)


@BOTH
@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-9, 1e-3])
def test_a_rock_that_falls_down_a_vertical_face_without_a_speed_towards_it_reaches_the_foot_freely(engine, gap):
    """The rock starts on the face, or 1e-12, 1e-9 or 1e-3 m away from it."""
    flights = fly(engine_over(engine, strip(CLIFF, across=3)), flight(surface(0.5, 0.8)), (gap, 0.3, 59.0))
    hit = flights.impacts
    assert (hit.t[0], hit.x[0, 2]) == pytest.approx((math.sqrt(118 / G), 0.0), rel=1e-12, abs=1e-10)
    assert hit.speed_in[0] == pytest.approx(math.sqrt(118 * G), rel=1e-12)
    assert tuple(hit.normal[0]) == (0.0, 0.0, 1.0)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0] == pytest.approx((gap, 0.3, 0.0), abs=1e-10)


@BOTH
def test_a_rock_thrown_at_a_vertical_wall_comes_back_from_it(engine):
    flights = fly(engine_over(engine, box()), flight(surface(0.5, 0.8)), (0.0, 0.3, 8.0), (10.0, 0.0, 0.0))
    hit = flights.impacts
    assert (hit.t[0], *hit.x[0]) == pytest.approx((0.5, 5.0, 0.3, 8.0 - 0.125 * G), rel=1e-12)
    assert tuple(flights.paths.v[1]) == pytest.approx((-5.0, 0.0, -0.5 * G * 0.8), rel=1e-12)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0, 2] == pytest.approx(0.0, abs=NEAR)


@BOTH
@pytest.mark.parametrize("R_n", [0.0, 0.5, 1.0])
def test_a_rock_in_a_box_never_leaves_it(engine, R_n):
    draw = np.random.default_rng(1)
    x, v = draw.uniform(-4.9, 4.9, (20, 3)), draw.normal(size=(20, 3)) * 6
    x[:, 2] = draw.uniform(0.1, 2.0, 20)
    v[:, 2] = draw.uniform(-5, 5, 20)
    over = engine_over(engine, box())
    flights = fly(over, flight(surface(R_n, 0.9 if R_n < 1 else 1.0), max_impacts=200), x, v)
    assert outcomes(flights) == ({Outcome.STOPPED} if R_n < 1 else {Outcome.MAX_IMPACTS})
    points = along_flights(flights)
    assert np.all(np.abs(points[:, :2]) <= 5.0 + NEAR) and np.all(points[:, 2] >= -NEAR)
    assert loses_energy(flights)


@BOTH
def test_a_rock_thrown_up_at_an_overhang_rebounds_from_its_underside(engine):
    roof = terrain_of([(-5, -5, 4), (5, -5, 4), (5, 5, 4), (-5, 5, 4)], [(0, 2, 1), (0, 3, 2)])  # faces down
    over = engine_over(engine, joined(floor(), roof))
    flights = fly(over, flight(surface(0.5, 0.8)), (0.2, 0.3, 1.0), (0.0, 0.0, 9.0))
    up = math.sqrt(81.0 - 2 * G * 3.0)
    assert (flights.impacts.x[0, 2], flights.impacts.normal[0, 2]) == pytest.approx((4.0, -1.0))
    assert flights.paths.v[1, 2] == pytest.approx(-0.5 * up, rel=1e-12)
    assert flights.impacts.speed_in[1] == pytest.approx(math.sqrt(0.25 * up**2 + 8 * G), rel=1e-12)
    assert flights.deposits.outcome[0] == Outcome.STOPPED and abs(flights.deposits.x[0, 2]) < NEAR


@BOTH
def test_a_rock_that_flies_up_into_the_back_of_a_sheet_rebounds_from_it(engine):
    """Contact is two-sided (docs/explanation/physics.md), also with a sheet without thickness."""
    over = engine_over(engine, joined(floor(), floor(5.0, z=4.0)))
    flights = fly(over, flight(surface(0.5, 0.8)), (0.2, 0.3, 1.0), (0.0, 0.0, 9.0))
    assert flights.impacts.x[0, 2] == pytest.approx(4.0) and flights.impacts.normal[0, 2] == -1.0
    assert flights.deposits.outcome[0] == Outcome.STOPPED and abs(flights.deposits.x[0, 2]) < NEAR


@BOTH
def test_a_rock_bounces_on_an_underside_again_and_again_as_time_reversal_demands(engine):
    """Without losses, the rock flies to a roof at 4 m and back 500 times, each way in (9 - sqrt(81 - 8 g)) / g."""
    roof = terrain_of([(-5, -5, 4), (5, -5, 4), (5, 5, 4), (-5, 5, 4)], [(0, 2, 1), (0, 3, 2)])
    over = engine_over(engine, joined(floor(), roof))
    flights = fly(over, flight(surface(1.0, 1.0), "none", max_impacts=1000), (0.2, 0.3, 0.0), (0.0, 0.0, 9.0))
    way = (9.0 - math.sqrt(81.0 - 8 * G)) / G
    np.testing.assert_allclose(flights.impacts.t, way * np.arange(1, 1001), rtol=1e-10)
    np.testing.assert_allclose(flights.impacts.x[:, 2], np.tile((4.0, 0.0), 500), atol=1e-10)


ARCH = 5.0
SPANS = 16


def arch():
    """Return a floor and a vault along y over it: SPANS flat strips inscribed in a half-circle of radius ARCH (m)."""
    angles = np.linspace(math.pi, 0.0, SPANS + 1)
    return joined(floor(30.0), strip([(ARCH * math.cos(a), ARCH * math.sin(a)) for a in angles], half_width=30.0))


@BOTH
@MODELS
def test_a_rock_under_an_arch_never_comes_out_through_it(engine, model):
    draw = np.random.default_rng(7)
    x = np.stack([draw.uniform(-3, 3, 20), draw.uniform(-2, 2, 20), draw.uniform(0.2, 2.5, 20)], 1)
    v = draw.normal(size=(20, 3)) * (8.0, 0.5, 8.0)
    over = engine_over(engine, arch())
    flights = fly(over, flight(surface(0.6, 0.9), model), x, v)
    points = along_flights(flights)
    assert np.all(np.hypot(points[:, 0], points[:, 2]) <= ARCH + NEAR)
    assert (flights.impacts.normal[:, 2] < 0.0).sum() >= 20, "the underside is hit from below"
    assert outcomes(flights) == {Outcome.STOPPED} and np.abs(flights.deposits.x[:, 2]).max() < NEAR
    assert loses_energy(flights)


@BOTH
def test_without_losses_a_rock_under_an_arch_keeps_its_energy(engine):
    flights = fly(
        engine_over(engine, arch()), flight(surface(1.0, 1.0), "none", max_impacts=1000), (0.4, 0, 1), (7, 0.01, 9)
    )
    energy, _ = specific_energy(flights)
    assert flights.deposits.outcome[0] == Outcome.MAX_IMPACTS
    np.testing.assert_allclose(energy, energy[0], rtol=1e-10)


@BOTH
def test_a_rock_dropped_on_an_arch_rolls_off_it_on_the_outside(engine):
    over = engine_over(engine, arch())
    flights = fly(over, flight(surface(0.3, 0.8, 5.0)), [(0.5, 0.2, 7.0), (-2.0, 0.2, 7.0), (0.0, 0.2, 7.0)])
    inside = np.hypot(*along_flights(flights)[:, ::2].T) < ARCH * math.cos(0.5 * math.pi / SPANS) - NEAR
    assert not inside.any(), "the polygon's sides come no nearer to the axis than this"
    assert outcomes(flights) == {Outcome.STOPPED}
    assert np.all(np.abs(flights.deposits.x[:2, 0]) > ARCH) and lies_on(over, flights)


@BOTH
@pytest.mark.parametrize(("start", "end"), [(5.0, 4.0), (3.0, 0.0)])
def test_of_two_terrains_one_above_another_a_rock_lands_on_the_one_below_it(engine, start, end):
    over = engine_over(engine, joined(floor(), floor(5.0, z=4.0)))
    flights = fly(over, flight(surface()), (0.2, 0.3, start))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0, 2] == pytest.approx(end, abs=NEAR)


@BOTH
@pytest.mark.parametrize("apart", [1e-6, 1e-3])
def test_two_terrains_a_hair_apart_hold_a_rock_on_the_upper_one(engine, apart):
    """Two surveys of the same place lie one above the other; the rock never gets between them."""
    over = engine_over(engine, joined(floor(5.0, cells=3), floor(5.0, z=apart, cells=4)))
    draw = np.random.default_rng(8)
    x = np.stack([draw.uniform(-4, 4, 20), draw.uniform(-4, 4, 20), np.full(20, 2.0)], 1)
    flights = fly(over, flight(surface()), x, (0.3, 0.0, 0.0))
    assert outcomes(flights) == {Outcome.STOPPED}
    np.testing.assert_allclose(flights.deposits.x[:, 2], apart, atol=1e-10)


def notch(angle_deg: float) -> Terrain:
    """Return a level square of 8 m with an upright triangular pit, 5 m deep; angle_deg : angle at its corner (2, 4)."""
    half = 3.0 * math.tan(math.radians(0.5 * angle_deg))
    top = [(2.0, 4.0, 0.0), (5.0, 4.0 - half, 0.0), (5.0, 4.0 + half, 0.0)]
    corners = [*top, *((x, y, -5.0) for x, y, _ in top), (0, 0, 0), (8, 0, 0), (8, 8, 0), (0, 8, 0)]
    walls = [each for i, j in ((0, 1), (1, 2), (2, 0)) for each in ((i, j, 3 + j), (i, 3 + j, 3 + i))]
    around = [(6, 7, 1), (6, 1, 0), (7, 8, 2), (7, 2, 1), (8, 9, 2), (9, 0, 2), (9, 6, 0)]
    return terrain_of(corners, [*walls, (3, 4, 5), *around])


@BOTH
@pytest.mark.parametrize("angle_deg", [20.0, 45.0, 60.0])
@pytest.mark.parametrize("v", [(-10.0, 1.0, 20.0), (-10.0, 0.5, 8.0), (-3.0, 0.2, 2.0)])
def test_a_rock_that_rises_in_a_sharp_corner_of_upright_walls_does_not_pass_between_them(engine, angle_deg, v):
    physics = flight(surface(0.05, 0.9, 5.71), rebound="coulomb_limited")
    flights = fly(engine_over(engine, notch(angle_deg)), physics, (2.5, 4.0, -4.0), v)
    x, y, z = along_flights(flights).T
    below = z < -NEAR
    assert outcomes(flights) <= {Outcome.STOPPED, Outcome.LEFT_TERRAIN}
    assert np.all(x[below] >= 2.0 - NEAR)
    assert np.all(np.abs(y[below] - 4.0) <= (x[below] - 2.0) * math.tan(math.radians(0.5 * angle_deg)) + NEAR)


@BOTH
def test_a_rock_that_slides_off_an_upper_sheet_lands_on_the_lower_one(engine):
    over = engine_over(engine, joined(floor(), floor(5.0, z=4.0)))
    flights = fly(over, flight(surface(0.3, 0.8, 10.0)), (0.0, 0.3, 4.0), (7.0, 0.0, 0.0))
    speed = math.sqrt(49.0 - 2 * math.tan(math.radians(10)) * G * 5.0)
    assert flights.impacts.x[0, 0] == pytest.approx(5.0 + speed * math.sqrt(8.0 / G), rel=1e-6)
    assert flights.deposits.outcome[0] == Outcome.STOPPED


@BOTH
def test_a_profile_of_vertical_risers_and_level_treads_lets_no_rock_through(engine):
    stairs = [(0.0, 10.0), (5.0, 10.0), (5.0, 7.0), (10.0, 7.0), (10.0, 3.0), (15.0, 3.0), (15.0, 0.0), (40.0, 0.0)]
    over = engine_over(engine, strip(stairs, across=3))
    draw = np.random.default_rng(11)
    x = np.stack([draw.uniform(0.5, 14, 60), draw.uniform(-4, 4, 60), np.full(60, 12.0)], 1)
    x[:4, 0] = (5.0, 10.0, 15.0, 5.0)
    flights = fly(over, flight(surface(0.5, 0.8, 25.0)), x, (1.0, 0.0, 0.0))
    assert outcomes(flights) <= {Outcome.STOPPED, Outcome.LEFT_TERRAIN}
    points = along_flights(flights)
    inside = points[points[:, 0] < 40.0]
    tread = np.array([10.0, 7.0, 3.0, 0.0])[np.searchsorted([5.0, 10.0, 15.0], inside[:, 0] + NEAR)]
    assert np.all(inside[:, 2] >= tread - NEAR)
    assert lies_on(over, flights) and loses_energy(flights)


@BOTH
@pytest.mark.parametrize("into", [0.0, 3e-10, 3e-9])
def test_a_rock_that_flies_along_a_wall_meets_the_next_one_however_slightly_it_turns_into_the_first(engine, into):
    """At a wall, 5e-9 of the way counts as rounding: over 1 m, a thousand times the distance that counts as contact."""
    plan = [(0, 0), (1, 0), (2, 1)]
    corners = [(x, y, z) for z in (0.0, 1.0) for x, y in plan] + [(0, 2, 0), (2, 2, 0)]
    corners += [(0, -2, 1), (3, -2, 1), (3, 1, 1)]
    below, walls = [(0, 1, 6), (1, 2, 7), (1, 7, 6)], [(1, 0, 3), (1, 3, 4), (2, 1, 4), (2, 4, 5)]
    ground = terrain_of(corners, [*below, *walls, (3, 8, 4), (4, 8, 9), (4, 9, 5), (5, 9, 10)])
    flights = fly(engine_over(engine, ground), flight(surface(0.0, 1.0, 25.0, 0.0)), (0.2, 0.0, 0.1), (5.0, -into, 1.0))
    assert 5 in flights.impacts.facet, "the second wall"
    assert lies_on(engine_over(engine, ground), flights)
    x, y = along_flights(flights)[:, :2].T
    assert np.all(y >= np.maximum(x - 1.0, 0.0) - NEAR), "never behind the walls"
