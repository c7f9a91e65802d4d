"""Spheres that are released in a place with too little room for them."""

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
