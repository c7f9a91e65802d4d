"""Rocks without restitution (R_n = 0): one impact and no bounce, on facets of any direction."""

import math

import numpy as np
import pytest
from flights.rebounds_named import MODELS, falling_rock, flight_with
from flights.scenes_of_facets import ENGINES, down_the_slope, engine_over, fly, incline, same_bits, surface

from rpf3d_core.kinetics.rebound import rest_of_bounces
from rpf3d_core.values import ZERO, Motion, Outcome

G, ANGLE, FRICTION, R_T, SPEED = 9.81, 20.0, 30.0, 0.8, 8.0
STRIKES = np.random.default_rng(60002).uniform(0.0, 360.0, 20)
GEOMETRIC = pytest.mark.parametrize("name", ["constant", "velocity_scaled", "mass_scaled"])
"""The models whose bounces are summed as a geometric series, and which keep speed along the ground at R_n = 0."""


@GEOMETRIC
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_without_restitution_keeps_R_t_of_its_speed_in_its_only_impact_and_slides_on(engine, name):
    """Whatever the strike: the rounding of the normal must not decide whether there is another impact."""
    a = math.radians(ANGLE)
    braking = G * (math.cos(a) * math.tan(math.radians(FRICTION)) - math.sin(a))
    physics = flight_with(MODELS[name], surface(0.0, R_T, FRICTION, 0.0))
    for strike in STRIKES:
        descent, normal = down_the_slope(ANGLE, strike)
        over = engine_over(engine, incline(ANGLE, strike, down=200.0))
        flights = fly(over, physics, descent + normal, SPEED * descent)
        fall = math.sqrt(2.0 * 1.0 / (G * math.cos(a)))
        u = R_T * (SPEED + G * math.sin(a) * fall)
        end = flights.deposits
        assert end.outcome[0] == Outcome.STOPPED and end.impacts[0] == 1
        assert np.linalg.norm(end.x[0] - flights.impacts.x[0]) == pytest.approx(u * u / (2.0 * braking), rel=1e-9)
        assert end.t[0] == pytest.approx(fall + u / braking, rel=1e-9)


@GEOMETRIC
def test_both_engines_agree_to_the_last_bit_without_restitution(name):
    physics = flight_with(MODELS[name], surface(0.0, R_T, FRICTION, 0.0))
    for strike in STRIKES[:5]:
        descent, normal = down_the_slope(ANGLE, strike)
        both = [engine_over(engine, incline(ANGLE, strike, down=200.0)) for engine in ENGINES]
        assert same_bits(*(fly(over, physics, descent + normal, SPEED * descent) for over in both))


@GEOMETRIC
@pytest.mark.parametrize("R_t", [0.0, 0.8, 1.0])
def test_a_rock_that_a_tilted_normal_sends_off_the_facet_has_exactly_one_more_bounce(name, R_t):
    a = math.radians(ANGLE)
    descent, normal = down_the_slope(ANGLE, 37.0)
    across = np.cross(normal, descent)
    u, w = 1.5 * descent + 0.4 * across, 0.1
    motion = Motion(0.0, ZERO, tuple(u + w * normal), ZERO)
    rest = rest_of_bounces(MODELS[name], surface(0.0, R_t), motion, tuple(normal), G, falling_rock())
    t, pull = 2.0 * w / (G * math.cos(a)), G * math.sin(a) * descent
    assert rest.ends and rest.t == pytest.approx(t, rel=1e-12)
    assert np.add(rest.along, rest.down) == pytest.approx(u * t + 0.5 * t * t * pull, abs=1e-12)
    assert rest.v == pytest.approx(R_t * (u + t * pull), abs=1e-12)
