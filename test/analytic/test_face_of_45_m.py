"""Tests of the worked example of the transition from bouncing to sliding.

A face of 45 m at 75 degrees, toe at x = 12.0577, then level ground; R_n 0.5, R_t 0.9, friction 30 degrees, from rest.
"""

import math

import numpy as np
import pytest
from flights.scenes_of_facets import ENGINES, engine_over, flight, fly, specific_energy, strip, surface

from rpf3d_core.values import Mode, Outcome

TOE = 45.0 / math.tan(math.radians(75.0))
START = (0.1, 0.37, 45.5)
GROUND = surface(0.5, 0.9, 30.0, 0.0)
SIX, FOUR = 5.1e-7, 5.1e-5
"""Half a unit of the last of six or four printed decimals, and a little for the rounding of the reference itself."""

MESHES = {
    "two_cells": {"across": 1, "strike": 0.0},
    "three_across": {"across": 3, "strike": 0.0},
    "striking_200": {"across": 2, "strike": 200.0},
}


@pytest.fixture(scope="module", params=[(e, m) for e in ENGINES for m in MESHES], ids=lambda p: f"{p[0]}-{p[1]}")
def flown(request):
    """Return the flights, and the unit vector (3,) along the profile in plan."""
    engine, mesh = request.param
    over = engine_over(engine, strip([(0, 45), (TOE, 0), (200, 0)], **MESHES[mesh]))
    a = math.radians(MESHES[mesh]["strike"])
    along = np.array([math.cos(a), math.sin(a), 0.0])
    start = np.array([START[0] * along[0] - START[1] * along[1], START[0] * along[1] + START[1] * along[0], START[2]])
    return fly(over, flight(GROUND), start), along


def test_the_toe_is_where_the_reference_has_it():
    assert pytest.approx(12.0577, abs=FOUR) == TOE


@pytest.mark.parametrize(
    ("number", "t", "x", "z", "before", "after"),
    [
        (0, 0.421928, 0.1, 44.626795, 4.139116, 3.637921),
        (1, 0.843857, 0.711244, 42.345603, 7.615212, 6.841959),
        (2, 1.054821, 1.139114, 40.748769, 8.839813, 7.953307),
    ],
    ids=["validation-2.3-impact-1", "validation-2.3-impact-2", "validation-2.3-impact-3"],
)
def test_the_first_impacts_are_as_printed(flown, number, t, x, z, before, after):
    flights, along = flown
    hit = flights.impacts
    found = (hit.t[number], hit.x[number] @ along, hit.x[number, 2], hit.speed_in[number], hit.speed_out[number])
    assert found == pytest.approx((t, x, z, before, after), abs=SIX)


def test_bouncing_on_the_face_dies_out_at_rest_where_the_reference_says(flown):
    flights, along = flown
    begins = np.flatnonzero(flights.paths.mode == Mode.SLIDING)[0]
    x = flights.paths.x[begins]
    assert (flights.paths.t[begins], x @ along) == pytest.approx((1.265785, 1.581803), abs=SIX)
    assert np.linalg.norm(flights.paths.v[begins]) == 0.0
    assert flights.deposits.ground_speed[0] == 0.0


def test_the_slide_down_the_face_reaches_the_toe_at_the_printed_speed(flown):
    flights, along = flown
    slides = np.flatnonzero((flights.paths.mode == Mode.SLIDING) & (flights.paths.x[:, 2] > 1.0))
    first, last = slides[0], slides[-1]
    speed, t = np.linalg.norm(flights.paths.v_end[last]), flights.paths.t[last + 1]
    assert flights.paths.x[last + 1] @ along == pytest.approx(TOE, abs=1e-9)
    assert (speed, t) == pytest.approx((25.463874, 4.444862), abs=SIX)
    assert speed / (t - flights.paths.t[first]) == pytest.approx(8.009831, abs=SIX)


def test_the_rock_stops_where_and_when_the_exact_rule_says(flown):
    flights, along = flown
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert (flights.deposits.x[0] @ along, flights.deposits.t[0]) == pytest.approx((39.0973, 9.4594), abs=FOUR)


def test_energy_never_rises_from_the_release_to_the_stop(flown):
    after, end = specific_energy(flown[0])
    rounding = 1e-9  # of 450 J/kg, over some twenty events
    assert np.all(end[:-1] <= after[:-1] + rounding) and np.all(after[1:] <= end[:-1] + rounding)


@pytest.mark.parametrize("engine", ENGINES)
def test_without_a_ground_model_the_rock_stops_on_the_face(engine):
    over = engine_over(engine, strip([(0, 45), (TOE, 0), (200, 0)]))
    end = fly(over, flight(GROUND, "none"), START).deposits
    assert end.outcome[0] == Outcome.STOPPED
    assert (end.t[0], end.x[0, 0]) == pytest.approx((1.265785, 1.581803), abs=SIX)
