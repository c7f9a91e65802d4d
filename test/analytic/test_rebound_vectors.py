"""Tests of the rebound of one velocity from one facet, alone and as part of a flight."""

import math

import numpy as np
import pytest
from flights.any_rock import ANY_ROCK
from flights.scenes_of_facets import ENGINES, down_the_slope, engine_over, flight, fly, incline, surface

from rpf3d_core.kinetics.rebound import ConstantRestitution, rebound
from rpf3d_core.values import ZERO, Motion

N = (0.5, 0.0, math.sqrt(0.75))
V = (3.0, 2.0, -10.0)
PRINTED = 5.1e-5
"""Half a unit of the fourth printed decimal, and a little for rounding."""
ROWS = pytest.mark.parametrize(
    ("R_n", "R_t", "after", "squared"),
    [(1.0, 1.0, (10.1603, 2.0, 2.4019), 113.0), (0.5, 0.8, (7.0542, 1.6, 0.0613), 52.325)],
    ids=["physics-9.1-elastic", "physics-9.1-Arturo"],
)


@ROWS
def test_constant_restitution_turns_the_vector_as_printed(R_n, R_t, after, squared):
    v = rebound(ConstantRestitution(), surface(R_n, R_t), Motion(1.0, (2.0, 3.0, 4.0), V, ZERO), N, ANY_ROCK).v
    assert v == pytest.approx(after, abs=PRINTED)
    assert np.dot(v, v) == pytest.approx(squared, abs=5e-4)


@ROWS
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_released_on_a_slope_with_that_velocity_leaves_as_printed(engine, R_n, R_t, after, squared):
    _, normal = down_the_slope(30.0)
    assert tuple(normal) == pytest.approx(N)
    flights = fly(engine_over(engine, incline(30.0)), flight(surface(R_n, R_t), max_impacts=1), (0.0, 0.2, 0.0), V)
    assert flights.impacts.t[0] == pytest.approx(0.0, abs=1e-15)
    assert flights.paths.v[1] == pytest.approx(after, abs=PRINTED)
    assert flights.impacts.speed_out[0] ** 2 == pytest.approx(squared, abs=5e-4)


def test_a_rebound_moves_neither_the_clock_nor_the_rock_nor_its_spin():
    motion = Motion(1.0, (2.0, 3.0, 4.0), V, (5.0, 6.0, 7.0))
    after = rebound(ConstantRestitution(), surface(), motion, N, ANY_ROCK)
    assert (after.t, after.x, after.w) == (motion.t, motion.x, motion.w)
