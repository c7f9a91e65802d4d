"""Tests of how flights end: the ground models `none` and `sliding`, their stop rules, and the outcomes' sentences."""

import math

import numpy as np
import pytest
from flights.scenes_of_facets import (
    ENGINES,
    down_the_slope,
    engine_over,
    flight,
    floor,
    fly,
    incline,
    strip,
    surface,
    without_facets,
)

from rpf3d_core.kinetics.ground import NoGround, Sliding
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import DEPOSITED, OUTCOME_SENTENCES, Mode, Outcome

G = 9.81
ROUNDED = 1e-9
"""Largest error (m and m/s) of a dozen events over 10 m, with edges passed within 1e-11 m."""
BOTH = pytest.mark.parametrize("engine", ENGINES)


# --- ground: none -----------------------------------------------------------------------------------------------------


@BOTH
def test_a_rock_at_rest_on_flat_ground_stops_with_a_reason(engine):
    end = fly(engine_over(engine, floor()), flight(surface(), "none"), (1.0, 2.0, 0.0)).deposits
    assert end.outcome[0] == Outcome.STOPPED
    assert "stopped" in OUTCOME_SENTENCES[Outcome(end.outcome[0])]
    assert tuple(end.x[0]) == (1.0, 2.0, 0.0)


@BOTH
@pytest.mark.parametrize(("stop_speed", "outcome"), [(1.01, Outcome.STOPPED), (0.99, Outcome.UNRESOLVED_CONTACT)])
def test_without_a_ground_model_the_stop_speed_alone_decides(engine, stop_speed, outcome):
    """With R_t = 1 on level ground, the rock still has its 1 m/s along the ground after its bounces."""
    over = engine_over(engine, floor())
    end = fly(
        over, flight(surface(0.5, 1.0, stop_speed=stop_speed), "none"), (-9.0, 0.3, 2.0), (1.0, 0.0, 0.0)
    ).deposits
    assert end.outcome[0] == outcome
    assert end.ground_speed[0] == pytest.approx(1.0, rel=ROUNDED)


def test_the_sentence_of_an_unresolved_contact_says_which_ground_model_to_name():
    sentence = OUTCOME_SENTENCES[Outcome.UNRESOLVED_CONTACT]
    assert "stop_speed" in sentence and "ground: sliding" in sentence


def test_every_outcome_has_a_sentence_and_only_rocks_that_lie_on_the_terrain_are_deposits():
    assert set(OUTCOME_SENTENCES) == set(Outcome)
    assert set(DEPOSITED) == {Outcome.STOPPED, Outcome.CAUGHT}


@BOTH
def test_naming_sliding_carries_on_what_none_leaves_unresolved(engine):
    over = engine_over(engine, floor())
    ends = [
        fly(over, flight(surface(0.5, 1.0, 20.0), model), (-9.0, 0.3, 2.0), (3.0, 0.0, 0.0)).deposits
        for model in ("none", "sliding")
    ]
    assert [end.outcome[0] for end in ends] == [Outcome.UNRESOLVED_CONTACT, Outcome.STOPPED]
    way = (9.0 - 0.25) / (2 * G * math.tan(math.radians(20)))
    assert ends[1].x[0, 0] - ends[0].x[0, 0] == pytest.approx(way, rel=1e-6)


# --- the other outcomes -----------------------------------------------------------------------------------------------


@BOTH
def test_a_rock_that_flies_past_the_edge_has_left_the_terrain(engine):
    end = fly(engine_over(engine, floor(5.0)), flight(surface()), (0.0, 0.3, 10.0), (9.0, 0.0, 0.0)).deposits
    assert end.outcome[0] == Outcome.LEFT_TERRAIN
    assert end.impacts[0] == 0
    assert end.x[0, 0] == pytest.approx(5.0, abs=1e-6)


@BOTH
def test_a_rock_that_slides_over_the_edge_has_left_the_terrain(engine):
    end = fly(
        engine_over(engine, floor(5.0)), flight(surface(0.5, 0.8, 5.0)), (0.0, 0.3, 0.0), (9.0, 0.0, 0.0)
    ).deposits
    assert end.outcome[0] == Outcome.LEFT_TERRAIN
    assert end.x[0, 0] == pytest.approx(5.0, abs=1e-6)


@BOTH
def test_a_rock_that_falls_through_a_hole_has_left_the_terrain(engine):
    holed = without_facets(floor(10.0, cells=4), 5, 5 + 16)
    x = holed.vertices[floor(10.0, cells=4).triangles[5]].mean(0)
    end = fly(engine_over(engine, holed), flight(surface()), np.add(x, (0, 0, 3))).deposits
    assert end.outcome[0] == Outcome.LEFT_TERRAIN


@BOTH
@pytest.mark.parametrize("max_time", [0.1, 1.0, 2.7])
def test_a_flight_ends_at_max_time_in_mid_air(engine, max_time):
    over = engine_over(engine, floor())
    end = fly(over, flight(surface(1.0, 1.0), max_time=max_time), (0.0, 0.3, 3.0), (1.0, 0.0, 0.0)).deposits
    assert end.outcome[0] == Outcome.MAX_TIME
    assert end.t[0] == pytest.approx(max_time, abs=1e-12)
    assert end.x[0, 0] == pytest.approx(max_time, abs=ROUNDED)


@BOTH
def test_a_slide_that_lasts_longer_than_max_time_is_not_called_stopped(engine):
    over = engine_over(engine, floor(50.0))
    end = fly(over, flight(surface(0.5, 0.8, 5.0), max_time=2.0), (-40.0, 0.3, 0.0), (9.0, 0.0, 0.0)).deposits
    assert end.outcome[0] == Outcome.MAX_TIME
    assert end.t[0] == pytest.approx(2.0, abs=1e-9)


@BOTH
@pytest.mark.parametrize("most", [1, 2, 17])
def test_a_flight_ends_after_max_impacts(engine, most):
    end = fly(engine_over(engine, floor()), flight(surface(1.0, 1.0), max_impacts=most), (0.1, 0.3, 1.0)).deposits
    assert end.outcome[0] == Outcome.MAX_IMPACTS
    assert end.impacts[0] == most


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        (Outcome.STOPPED, "stopped"), (Outcome.LEFT_TERRAIN, "edge"), (Outcome.MAX_TIME, "raise max_time"),
        (Outcome.MAX_IMPACTS, "raise max_impacts"), (Outcome.UNRESOLVED_CONTACT, "ground: sliding"),
    ],
)  # fmt: skip
def test_the_sentence_of_an_outcome_says_what_to_do(outcome, words):
    assert words in OUTCOME_SENTENCES[outcome]


# --- friction ---------------------------------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize(("friction", "stays"), [(30.1, True), (29.9, False)])
def test_a_rock_laid_on_a_slope_of_30_degrees_stays_where_friction_is_more_than_that(engine, friction, stays):
    descent, _ = down_the_slope(30.0)
    over = engine_over(engine, incline(30.0, cells=(6, 3)))
    flights = fly(over, flight(surface(friction_angle=friction, stop_speed=0.0)), 1.3 * descent + (0, 0.2, 0))
    end = flights.deposits
    assert end.outcome[0] == (Outcome.STOPPED if stays else Outcome.LEFT_TERRAIN)
    assert (end.path[0] < 1e-6) == stays


@BOTH
@pytest.mark.parametrize("angle", [10.0, 30.0, 45.0, 89.0])
def test_a_slope_at_exactly_the_friction_angle_holds_a_rock(engine, angle):
    descent, _ = down_the_slope(angle)
    end = fly(
        engine_over(engine, incline(angle)), flight(surface(friction_angle=angle)), 2.0 * descent + (0, 1, 0)
    ).deposits
    assert end.outcome[0] == Outcome.STOPPED
    assert end.path[0] < 1e-6


@BOTH
def test_a_rock_slower_than_the_stop_speed_does_not_stop_where_friction_does_not_hold_it(engine):
    descent, _ = down_the_slope(35.0)
    over = engine_over(engine, incline(35.0, down=20.0))
    flights = fly(over, flight(surface(friction_angle=25.0, stop_speed=3.0)), np.add(descent, (0, 1, 0)))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    a = G * (math.sin(math.radians(35)) - math.tan(math.radians(25)) * math.cos(math.radians(35)))
    slide = flights.paths.mode == Mode.SLIDING
    assert np.linalg.norm(flights.paths.v_end[slide], axis=1).max() == pytest.approx(math.sqrt(2 * a * 19.0), rel=1e-6)


@BOTH
def test_a_rock_thrown_up_a_slope_that_does_not_hold_it_comes_down_again(engine):
    descent, _ = down_the_slope(40.0)
    over = engine_over(engine, incline(40.0, cells=(9, 2)))
    start = 10.0 * descent + (0, 0.3, 0)
    flights = fly(over, flight(surface(0.5, 1.0, 20.0, 0.1)), start, -5.0 * descent)
    s, mu = math.sin(math.radians(40)), math.tan(math.radians(20)) * math.cos(math.radians(40))
    highest = ((flights.paths.x - start) @ descent).min()
    assert -highest == pytest.approx(25.0 / (2 * G * (s + mu)), rel=1e-6)
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN


@BOTH
def test_a_rock_thrown_up_a_slope_that_holds_it_stays_up(engine):
    descent, _ = down_the_slope(15.0)
    over = engine_over(engine, incline(15.0, cells=(9, 2)))
    start = 10.0 * descent + (0, 0.3, 0)
    end = fly(over, flight(surface(0.5, 1.0, 20.0, 0.0)), start, -5.0 * descent).deposits
    s, mu = math.sin(math.radians(15)), math.tan(math.radians(20)) * math.cos(math.radians(15))
    assert end.outcome[0] == Outcome.STOPPED
    assert -((end.x[0] - start) @ descent) == pytest.approx(25.0 / (2 * G * (s + mu)), rel=1e-6)


# --- zones ------------------------------------------------------------------------------------------------------------

TWO_ZONES = [(-20.0, 0.0), (0.0, 0.0), (20.0, 0.0)]


@BOTH
@pytest.mark.parametrize("side", [0, 1])
def test_a_rock_rebounds_with_the_coefficients_of_the_zone_it_hits(engine, side):
    zones = [Surface(0.9, 0.5, 0.5, 0.5), Surface(0.2, 0.8, 0.5, 0.5)]
    x = (-10.0, 10.0)[side]
    flights = fly(engine_over(engine, strip(TWO_ZONES)), flight(zones), (x, 0.3, 5.0), (2.0, 0.0, 0.0))
    before = math.sqrt(2 * G * 5.0)
    assert tuple(flights.paths.v[1]) == pytest.approx((2.0 * zones[side].R_t, 0.0, before * zones[side].R_n), rel=1e-12)


@BOTH
def test_friction_changes_where_a_slide_crosses_from_zone_to_zone(engine):
    zones = [Surface(0.5, 0.8, 0.2, 0.0), Surface(0.5, 0.8, 0.7, 0.0)]
    flights = fly(engine_over(engine, strip(TWO_ZONES)), flight(zones), (-6.0, 0.3, 0.0), (6.0, 0.0, 0.0))
    left = 36.0 - 2 * 0.2 * G * 6.0
    assert flights.deposits.x[0, 0] == pytest.approx(left / (2 * 0.7 * G), rel=1e-6)


@BOTH
@pytest.mark.parametrize("model", ["none", "sliding"])
def test_each_zone_stops_rocks_at_its_own_speed(engine, model):
    """With R_t = 1 and no friction, rocks keep 1 m/s in both zones; only one zone has a higher stop speed."""
    zones = [Surface(0.5, 1.0, 1e-3, 1.5), Surface(0.5, 1.0, 1e-3, 0.5)]
    over = engine_over(engine, strip(TWO_ZONES))
    ends = fly(over, flight(zones, model), [(-15.0, 0.3, 0.2), (5.0, 0.3, 0.2)], (1.0, 0.0, 0.0)).deposits
    assert ends.outcome[0] == Outcome.STOPPED and ends.facet[0] in (0, 2)
    assert ends.outcome[1] == {"none": Outcome.UNRESOLVED_CONTACT, "sliding": Outcome.LEFT_TERRAIN}[model]


# --- edges ------------------------------------------------------------------------------------------------------------


@BOTH
def test_a_rock_that_slides_over_a_brow_flies_off_it(engine):
    """The rock leaves a level bench horizontally, at the speed that remains after friction."""
    over = engine_over(engine, strip([(-10.0, 0.0), (0.0, 0.0), (2.0, -20.0), (40.0, -20.0)]))
    flights = fly(over, flight(surface(0.3, 0.8, 20.0)), (-5.0, 0.3, 0.0), (8.0, 0.0, 0.0))
    brow = np.flatnonzero(np.abs(flights.paths.x[:, 0]) < 1e-6)[-1]
    speed = math.sqrt(64.0 - 2 * math.tan(math.radians(20)) * G * 5.0)
    assert flights.paths.mode[brow] == Mode.FLIGHT
    assert tuple(flights.paths.v[brow]) == pytest.approx((speed, 0.0, 0.0), abs=1e-6)
    hit = speed * math.sqrt(40.0 / G)
    assert hit > 2.0
    assert tuple(flights.impacts.x[0]) == pytest.approx((hit, 0.3, -20.0), abs=1e-5)


@BOTH
@pytest.mark.parametrize("angle", [0.5, 3.0, 20.0])
def test_a_rock_that_slides_over_a_slight_brow_flies_a_little_and_comes_down_on_the_slope_beyond(engine, angle):
    """After t = 2 u tan(angle) / g from the brow, the parabola meets the slope."""
    over = engine_over(engine, strip([(-10.0, 0.0), (0.0, 0.0), (30.0, -30.0 * math.tan(math.radians(angle)))]))
    flights = fly(over, flight(Surface(0.3, 0.9, 0.1, 0.0)), (-1.0, 0.3, 0.0), (3.0, 0.0, 0.0))
    speed = math.sqrt(9.0 - 2 * 0.1 * G)
    brow = np.flatnonzero((flights.paths.mode == Mode.FLIGHT) & (np.abs(flights.paths.x[:, 0]) < 1e-6))[-1]
    assert tuple(flights.paths.v[brow]) == pytest.approx((speed, 0.0, 0.0), abs=1e-6)
    t = flights.paths.t[brow + 1] - flights.paths.t[brow]
    assert t == pytest.approx(2.0 * speed * math.tan(math.radians(angle)) / G, rel=1e-5)


@BOTH
def test_a_rock_that_slides_into_a_concave_edge_hits_it(engine):
    """At the toe of a slope of 40 degrees, the rock hits the level ground at 40 degrees, with R_n and R_t."""
    a = math.radians(40.0)
    over = engine_over(engine, strip([(-20.0, 20.0 * math.tan(a)), (0.0, 0.0), (60.0, 0.0)]))
    start = 10.0 * np.array([-math.cos(a), 0.0, math.sin(a)]) + (0, 0.3, 0)
    flights = fly(over, flight(surface(0.4, 0.7, 20.0, 0.1)), start)
    speed = math.sqrt(2 * G * (math.sin(a) - math.tan(math.radians(20)) * math.cos(a)) * 10.0)
    toe = np.flatnonzero(np.linalg.norm(flights.impacts.x - (0, 0.3, 0), axis=1) < 1e-6)
    assert len(toe) == 1
    assert flights.impacts.speed_in[toe[0]] == pytest.approx(speed, rel=1e-6)
    out = math.hypot(0.7 * speed * math.cos(a), 0.4 * speed * math.sin(a))
    assert flights.impacts.speed_out[toe[0]] == pytest.approx(out, rel=1e-6)


@BOTH
def test_a_slide_over_nearly_coplanar_facets_does_not_depend_on_how_many_there_are(engine):
    """The rock slides up the side of a dish of 300 m radius, made of 17, 65 or 257 plane strips."""
    ways = []
    for segments in (17, 65, 257):
        x = np.linspace(-40.0, 40.0, segments + 1)
        x = 0.5 * (x - x[::-1])
        z = np.sqrt(300.0**2 - 0.0**2) - np.sqrt(300.0**2 - x**2)
        over = engine_over(engine, strip(list(zip(x, z - z[segments // 2], strict=True))))
        end = fly(over, flight(surface(0.5, 0.8, 6.0, 0.0)), (0.0, 0.3, 0.0), (8.0, 0.0, 0.0)).deposits
        assert end.outcome[0] == Outcome.STOPPED
        ways.append(end.x[0, 0])
    assert ways[2] > 15.0
    # A kink of angle k turns the velocity by k and costs speed^2 k^2 / 2, so twice as many facets cost half as much.
    assert abs(ways[1] - ways[2]) < 0.005 * ways[2] and abs(ways[0] - ways[2]) < 0.02 * ways[2]


@BOTH
@pytest.mark.parametrize("cells", [(2, 1), (33, 7), (200, 40)], ids=str)
def test_a_slide_over_a_plane_does_not_depend_on_how_many_facets_it_is_cut_into(engine, cells):
    descent, _ = down_the_slope(28.0, 33.0)
    over = engine_over(engine, incline(28.0, 33.0, cells=cells, jitter=7))
    start = np.array([0.0, 0.0, 0.5])
    end = fly(over, flight(surface(0.4, 0.8, 40.0, 0.0)), start, 6.0 * descent).deposits
    assert end.outcome[0] == Outcome.STOPPED
    one = fly(
        engine_over("reference", incline(28.0, 33.0, half_width=40.0)),
        flight(surface(0.4, 0.8, 40.0, 0.0)),
        start,
        6.0 * descent,
    )
    np.testing.assert_allclose(end.x[0], one.deposits.x[0], atol=1e-6)


def test_the_ground_models_have_no_hidden_parameters():
    assert NoGround() == () and Sliding() == ()
