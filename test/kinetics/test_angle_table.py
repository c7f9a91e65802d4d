"""Tests of restitution by the angle of the impact: the table, Wyllie's law, and limits on R_n above 1."""

import math

import numpy as np
import pytest
from flights.any_rock import ANY_ROCK
from flights.rebounds_named import MODELS, ROWS, energy, flight_with, struck, table_of
from flights.scenes_of_facets import engine_over, floor, fly, incline, surface

from rpf3d_core.kinetics.rebound import rest_of_bounces
from rpf3d_core.kinetics.rebounds.angle_table import impact_angle
from rpf3d_core.values import ZERO, Motion, Outcome

UP = (0.0, 0.0, 1.0)
WYLLIE = MODELS["wyllie"]


def coming_in(angle: float, speed: float = 10.0):
    """Return a velocity (3,) m/s into level ground at an angle (degrees) to it; speed in m/s."""
    a = math.radians(angle)
    return speed * math.cos(a), 0.0, -speed * math.sin(a)


def R_n_of(model, angle: float, R_t: float = 0.8) -> float:
    """Return the share of the normal speed that remains after an impact at an angle (degrees)."""
    v = coming_in(angle)
    return struck(model, surface(0.5, R_t), v).v[2] / -v[2]


@pytest.mark.parametrize("angle", [0.0, 1e-7, 13.0, 45.0, 89.999, 90.0])
def test_the_angle_is_that_between_velocity_and_surface(angle):
    assert impact_angle(Motion(0.0, ZERO, coming_in(angle), ZERO), UP) == pytest.approx(angle, abs=1e-13)


@pytest.mark.parametrize(
    ("angle", "R_n", "digits"),
    [(10, 1.82, 5e-3), (15, 1.20, 5e-3), (20, 0.89, 5e-3), (30, 0.587, 5e-4), (45, 0.387, 5e-4), (60, 0.287, 5e-4),
     (90, 0.189, 5e-4)],
    ids=lambda value: f"physics-1.6-{value}deg" if isinstance(value, int) else "",
)  # fmt: skip
def test_wyllies_law_has_its_printed_values(angle, R_n, digits):
    assert R_n_of(WYLLIE, float(angle)) == pytest.approx(R_n, abs=digits)


def test_wyllies_law_is_cut_off_at_2_for_flat_impacts():
    assert [R_n_of(WYLLIE, angle) for angle in (9.0, 5.0, 0.5)] == pytest.approx([2.0, 2.0, 2.0], rel=1e-12)
    assert R_n_of(WYLLIE, 9.2) < 2.0
    assert struck(WYLLIE, surface(), coming_in(0.0)).v == pytest.approx((8.0, 0.0, 0.0), rel=1e-14)


def test_wyllies_r_t_is_the_materials():
    assert struck(WYLLIE, surface(0.5, 0.6), coming_in(40.0)).v[0] == pytest.approx(0.6 * coming_in(40.0)[0], rel=1e-14)


@pytest.mark.parametrize(("angle", "R_n", "R_t"), [*ROWS, (45.0, 0.525, 0.775), (1.0, 1.6, 0.6), (17.5, 1.15, 0.65)])
def test_between_two_rows_the_table_is_linear_and_beyond_them_constant(angle, R_n, R_t):
    v = coming_in(angle)
    after = struck(table_of(ROWS), surface(), v)
    assert after.v[2] == pytest.approx(-R_n * v[2], rel=1e-12)
    assert after.v[0] == pytest.approx(R_t * v[0], rel=1e-12, abs=1e-14)


def test_a_table_of_one_row_is_constant_restitution():
    for angle in (0.0, 20.0, 77.0, 90.0):
        v = coming_in(angle)
        assert struck(table_of([(30.0, 0.5, 0.8)]), surface(), v).v == struck(MODELS["constant"], surface(), v).v


def test_below_90_degrees_a_table_may_end_and_its_last_row_holds():
    assert R_n_of(table_of(ROWS[:2]), 80.0) == pytest.approx(ROWS[1][1], rel=1e-14)


@pytest.mark.parametrize("R_t", [0.0, 0.9, 1.0])
def test_r_n_above_1_gives_no_more_than_was_lost_along_the_ground(R_t):
    """At 40 degrees, R_n = 3 would make the normal speed three times as large."""
    v = coming_in(40.0)
    after = struck(table_of([(0.0, 3.0, R_t)]), surface(), v)
    before = energy(Motion(0.0, ZERO, v, ZERO))
    assert after.v[0] == pytest.approx(R_t * v[0], rel=1e-14)
    limit = math.sqrt(v[2] ** 2 + (1.0 - R_t**2) * v[0] ** 2)
    assert after.v[2] == pytest.approx(min(limit, -3.0 * v[2]), rel=1e-12)
    assert energy(after) <= before * (1.0 + 1e-15)


def test_a_flat_impact_may_turn_speed_along_the_ground_into_height():
    v = coming_in(10.0)
    after = struck(WYLLIE, surface(), v)
    assert after.v[2] > 1.8 * -v[2]
    assert energy(after) < energy(Motion(0.0, ZERO, v, ZERO))


@pytest.mark.parametrize("R_n", [1.0, 3.0])
def test_a_rock_that_loses_nothing_comes_to_an_end_by_its_impacts_and_is_told_so(R_n):
    physics = flight_with(table_of([(0.0, R_n, 1.0)]), surface(), max_impacts=500)
    ends = fly(engine_over("reference", floor(50.0)), physics, (0.1, 0.3, 2.0)).deposits
    assert ends.outcome[0] == Outcome.MAX_IMPACTS


def test_on_level_ground_bounces_tend_to_the_angle_where_both_coefficients_are_alike_and_die_out():
    """Where R_n(angle) = R_t, the angle stays the same from bounce to bounce: for R_t = 0.8, at 22.2 degrees."""
    physics = flight_with(WYLLIE, surface(0.5, 0.8, 35.0))
    flights = fly(engine_over("reference", floor(400.0)), physics, (-90, 0.3, 2), (9, 0, 0))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    shrinks = np.diff(flights.impacts.t)[-12:-1]
    np.testing.assert_allclose(shrinks[1:] / shrinks[:-1], 0.8, rtol=1e-3)


def test_bounces_are_not_summed_for_flat_ones_may_grow_again():
    motion = Motion(0.0, ZERO, (5.0, 0.0, 0.05), ZERO)
    assert not rest_of_bounces(WYLLIE, surface(), motion, UP, 9.81, ANY_ROCK).ends


@pytest.mark.parametrize("name", ["wyllie", "angle_table"])
def test_half_of_smallest_bounce_moves_the_stop_by_micrometres(name):
    """Bounces are flown down to a millionth of smallest_bounce; after this, a slow rock moves less than 0.1 mm."""
    over = engine_over("reference", incline(3.0, down=200.0))
    physics = [flight_with(MODELS[name], surface(0.5, 0.6, 35.0), smallest_bounce=h) for h in (1e-3, 5e-4)]
    ends = [fly(over, one, (0.5, 0.2, 2.0), (3.0, 0.0, 0.0)).deposits for one in physics]
    assert {int(end.outcome[0]) for end in ends} == {Outcome.STOPPED}
    assert float(np.linalg.norm(ends[0].x[0] - ends[1].x[0])) < 1e-4
