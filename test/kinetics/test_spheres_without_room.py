"""Spheres that are released in a place with too little room for them."""

import numpy as np
import pytest
from flights.on_both_engines import BOTH
from flights.rolling_spheres import clearance, roll, spheres
from flights.scenes_of_facets import engine_over, strip

from rpf3d_core.materials.library import Surface
from rpf3d_core.values import Outcome

RADIUS, DEEP = 0.5, 2.0
GROUND = Surface(0.3, 0.8, 0.5, 0.05, 0.1)


def slot(width: float, lean: float):
    """Return level ground with a slot along y, DEEP m deep; lean : m, by which each side leans outwards at its top."""
    low = 0.5 * width
    return strip(
        [(-5, 0), (-low - lean, 0), (-low, -DEEP), (low, -DEEP), (low + lean, 0), (5, 0)], half_width=6.0, across=3
    )


@BOTH
@pytest.mark.parametrize("width", [0.6, 0.9, 0.99])
@pytest.mark.parametrize("lean", [0.0, 0.02])
@pytest.mark.parametrize("x", [0.0, 0.02, -0.1])
def test_a_sphere_in_a_slot_that_is_too_narrow_has_not_stopped(engine, width, lean, x):
    over = engine_over(engine, slot(width, lean))
    flights = roll(over, spheres(GROUND, max_time=20.0), RADIUS, (x, 0.0, -0.5 * DEEP), (0.0, 0.5, 0.0))
    overlaps = clearance(over, flights.paths.x)[-1] < RADIUS - 1e-6
    assert (flights.deposits.outcome[0] == Outcome.UNRESOLVED_CONTACT) == overlaps
    assert overlaps or lean > 0.0, "no way leads out of an upright slot"


@BOTH
def test_a_sphere_in_a_slot_that_is_wide_enough_is_set_free_and_stops(engine):
    over = engine_over(engine, slot(1.2, 0.0))
    flights = roll(over, spheres(GROUND, max_time=20.0), RADIUS, (0.3, 0.0, -0.5 * DEEP))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert clearance(over, flights.paths.x).min() > RADIUS - 1e-9


@BOTH
@pytest.mark.parametrize("radius", [0.1, 0.5])
def test_no_sphere_is_moved_through_a_wall_to_below_the_ground(engine, radius):
    """The centres are above a ditch and a ridge with walls of 89 degrees, nearer to the ground than the radius."""
    x, z = np.array([(-5, 1.0), (0.0, 1.0), (0.02, -1.0), (0.2, 0.5), (0.21, -0.5), (5, -0.5)]).T
    over = engine_over(engine, strip(list(zip(x, z, strict=True)), half_width=6.0, across=3))
    random, count = np.random.default_rng(5), 200
    at = random.uniform(-0.3, 0.5, count)
    places = np.column_stack([at, np.zeros(count), np.interp(at, x, z) + radius * 10.0 ** random.uniform(-3, 0, count)])
    flights = roll(over, spheres(GROUND, max_time=1e-4), radius, places)
    released = flights.paths.x[np.searchsorted(flights.paths.row, np.arange(count))]
    stuck = flights.deposits.outcome == Outcome.UNRESOLVED_CONTACT
    assert (stuck | (released[:, 2] > np.interp(released[:, 0], x, z) - 1e-6)).all()
    assert np.array_equal(released[stuck], places[stuck]), "a sphere that has no room stays where it is"
