"""Tests of flights that touch at very small angles: along a wall, over a floor, over a crest, up to a roof.

At an angle of 1e-9 rad the speed into the ground is 1e-8 m/s; a tolerance in time or speed would lose this impact.
"""

import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH, G, along_flights, loses_energy
from flights.scenes_of_facets import engine_over, flight, floor, fly, incline, joined, strip, surface, terrain_of

from rpf3d_core.simulation.settings import Settings
from rpf3d_core.values import Outcome

ANGLES = pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9])
WALL = 3.0
"""Coordinate x (m) of the wall: not 0, so that distances to the wall are rounded as on any terrain."""
ROUNDED = 4e-15
"""Rounding error (m) of a small distance between two coordinates of about 3 m."""
ALMOST = pytest.mark.parametrize("off", [1e-9, -1e-9])


def wall():
    """Return a vertical face, 60 m high with its free side towards -x, on a level floor that continues behind it."""
    face = terrain_of([(WALL, -9, 0), (WALL, 9, 0), (WALL, 9, 60), (WALL, -9, 60)], [(0, 2, 1), (0, 3, 2)])
    return joined(floor(), face)


@BOTH
@ANGLES
def test_a_rock_that_falls_along_a_wall_touches_it_at_the_angle_it_has(engine, angle):
    """After 1 s the rock falls at g * 1 s and reaches the wall; its velocity becomes (-R_n v_x, 0, R_t v_z)."""
    towards = angle * G
    flights = fly(
        engine_over(engine, wall()), flight(surface(0.5, 0.8), "none"), (WALL - towards, 0.3, 59.0), (towards, 0, 0)
    )
    known = 1e-12 + ROUNDED / towards
    assert flights.impacts.t[0] == pytest.approx(1.0, rel=known)
    assert tuple(flights.impacts.normal[0]) == (-1.0, 0.0, 0.0)
    assert flights.impacts.x[0, 0] == pytest.approx(WALL, abs=ROUNDED)
    assert flights.impacts.x[0, 2] == pytest.approx(59.0 - 0.5 * G, rel=2 * known)
    assert tuple(flights.paths.v[1]) == pytest.approx((-0.5 * towards, 0.0, -0.8 * G), rel=2 * known)
    assert np.all(along_flights(flights)[:, 0] <= WALL + ROUNDED) and loses_energy(flights)


@BOTH
@ANGLES
@pytest.mark.parametrize("slope", [0.0, 35.0])
def test_a_rock_that_leaves_the_ground_at_a_grazing_angle_comes_back_to_it(engine, angle, slope):
    """R_n = 0.5, and R_t = 1 keeps the speed along the ground: bounces for 2 v_n / (g_n (1 - R_n)), then friction."""
    descent, normal = (math.cos(a := math.radians(slope)), 0.0, -math.sin(a)), (math.sin(a), 0.0, math.cos(a))
    v = 6.0 * np.array(descent) + 6.0 * angle * np.array(normal)
    over = engine_over(engine, incline(slope, down=60.0, up=20.0))
    flights = fly(over, flight(surface(0.5, 1.0, 50.0, 0.0)), (0.0, 0.0, 0.0), v)
    pull, braking = G * math.sin(a), G * math.tan(math.radians(50)) * math.cos(a)
    bouncing = 12.0 * angle / (G * math.cos(a) * 0.5)
    speed = 6.0 + pull * bouncing
    way = (6.0 + 0.5 * pull * bouncing) * bouncing + speed * speed / (2 * (braking - pull))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0] @ np.array(descent) == pytest.approx(way, rel=1e-8)
    assert flights.deposits.x[0] @ np.array(normal) == pytest.approx(0.0, abs=1e-12)


CREST = [(-10.0, -17.5), (0.0, 0.0), (10.0, -17.5)]
"""Profile (x, z) in m of a ridge along y through the origin; its flanks fall by 1.75 m per metre."""
TOSS = {"x": (-4.0, 0.3, -4.0), "v": (4.0, 0.0, 8.0)}
"""Release of the parabola z = -x^2 / 4 for g = 8 m/s2: its apex is the origin, and all numbers are exact in float64."""


@BOTH
def test_a_flight_tangent_to_a_crest_is_an_impact_on_one_of_its_flanks_there(engine):
    flights = fly(
        engine_over(engine, strip(CREST)), flight(surface(0.5, 0.8), "none", gravity=8.0), TOSS["x"], TOSS["v"]
    )
    hit = flights.impacts
    assert (hit.t[0], *hit.x[0]) == (1.0, 0.0, 0.3, 0.0)
    assert hit.normal[0] == pytest.approx((-1.75 / math.hypot(1.75, 1), 0, 1 / math.hypot(1.75, 1)))
    into = 4.0 * 1.75 / math.hypot(1.75, 1.0)
    assert hit.speed_out[0] == pytest.approx(math.hypot(0.5 * into, 0.8 * math.sqrt(16 - into * into)), rel=1e-12)
    assert loses_energy(flights, 8.0)


@BOTH
def test_a_flight_a_nanometre_above_a_crest_passes_it_and_one_below_does_not(engine):
    over = engine_over(engine, strip(CREST))
    for off, landing in ((1e-9, (7.0, 0.3, -12.25)), (-1e-9, (0.0, 0.3, 0.0))):
        flights = fly(
            over, flight(surface(), "none", gravity=8.0, max_impacts=1), np.add(TOSS["x"], (0, 0, off)), TOSS["v"]
        )
        np.testing.assert_allclose(flights.impacts.x[0], landing, atol=2e-9)


@BOTH
@pytest.mark.parametrize("tilt", [0.0, 30.0])
def test_a_parabola_that_touches_a_roof_just_at_its_apex_flies_on_as_if_it_had_not(engine, tilt):
    """The speed normal to the roof is zero, and R_t = 1 keeps the speed along the roof."""
    roof = terrain_of([(-5, -5, 6), (5, -5, 6), (5, 5, 6), (-5, 5, 6)], [(0, 2, 1), (0, 3, 2)])
    strike = (math.cos(math.radians(tilt)), math.sin(math.radians(tilt)), 8.0)  # across the facets' diagonal, or not
    flights = fly(
        engine_over(engine, joined(floor(), roof)), flight(surface(0.5, 1.0), "none", gravity=8.0), (-1.0, 0.25, 2.0),
        strike,
    )  # fmt: skip
    down = 1.0 + math.sqrt(2 * 6.0 / 8.0)
    landing = np.flatnonzero(flights.impacts.normal[:, 2] > 0.0)[0]
    assert flights.impacts.t[landing] == pytest.approx(down, rel=1e-12)
    assert flights.impacts.x[landing] == pytest.approx((strike[0] * down - 1, 0.25 + strike[1] * down, 0), abs=1e-12)
    assert along_flights(flights, 8.0)[:, 2].max() == 6.0 and loses_energy(flights, 8.0)


@BOTH
@ALMOST
def test_a_parabola_whose_apex_is_a_nanometre_off_a_roof_changes_as_little_as_that(engine, off):
    """A rock 1 nm too high meets the roof at sqrt(2 g 1e-9) = 1.3e-4 m/s, and loses at most this speed."""
    roof = terrain_of([(-5, -5, 6), (5, -5, 6), (5, 5, 6), (-5, 5, 6)], [(0, 2, 1), (0, 3, 2)])
    flights = fly(
        engine_over(engine, joined(floor(), roof)), flight(surface(0.5, 1.0), "none", gravity=8.0),
        (-1.0, 0.25, 2.0 + off), (1.0, 0.0, 8.0),
    )  # fmt: skip
    assert flights.impacts.normal[0, 2] == (-1.0 if off > 0 else 1.0)
    landing = np.flatnonzero(flights.impacts.normal[:, 2] > 0.0)[0]
    assert flights.impacts.x[landing, 0] == pytest.approx(math.sqrt(1.5), abs=4e-5)
    assert along_flights(flights, 8.0)[:, 2].max() <= 6.0 + 1e-10


@BOTH
@ANGLES
def test_grazing_impacts_on_every_facet_of_a_long_incline_cost_what_the_angle_says(engine, angle):
    """A rock thrown along a plane of 200 facets meets the plane where its parabola does, on whichever facet."""
    a = math.radians(20.0)
    descent, normal = np.array((math.cos(a), 0, -math.sin(a))), np.array((math.sin(a), 0, math.cos(a)))
    over = engine_over(engine, incline(20.0, cells=(50, 2), jitter=3))
    flights = fly(over, flight(surface(0.5, 0.8), "none"), 0.01 * normal, 9.0 * (descent + angle * normal))
    g_n = Settings().gravity * math.cos(a)
    t = (9.0 * angle + math.sqrt((9.0 * angle) ** 2 + 2 * g_n * 0.01)) / g_n
    assert flights.impacts.t[0] == pytest.approx(t, rel=1e-9)
    assert flights.impacts.x[0] @ descent == pytest.approx(9.0 * t + 0.5 * G * math.sin(a) * t * t, rel=1e-9)
