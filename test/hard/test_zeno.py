"""Tests of coefficients at their limits: infinitely many bounces in finite time, no losses, no friction."""

import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH, MODELS, G, lies_on, loses_energy
from flights.scenes_of_facets import (
    box,
    cone,
    down_the_slope,
    engine_over,
    flight,
    floor,
    fly,
    gully,
    incline,
    specific_energy,
    strip,
    surface,
)

import rpf3d_core as rpf3d
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import Outcome


@BOTH
@MODELS
@pytest.mark.parametrize(("R_n", "impacts"), [(0.999, 3800), (0.5, 6), (0.0, 1)])
def test_infinitely_many_bounces_end_when_and_where_their_series_does(engine, model, R_n, impacts):
    """From 2 m, a rock stops at t_0 (1 + R_n) / (1 - R_n), and has moved v t_0 (1 + 2 R_n R_t / (1 - R_n R_t)).

    With R_n = 0, R_t leaves 0.32 m/s, which is below stop_speed.
    """
    flights = fly(engine_over(engine, floor(400.0)), flight(surface(R_n, 0.8, 30), model), (0.1, 0.3, 2), (0.4, 0, 0))
    t0 = math.sqrt(4.0 / G)
    x = 0.4 * t0 * (1 + 2 * R_n * 0.8 / (1 - R_n * 0.8))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.impacts[0] == pytest.approx(impacts, rel=0.01)
    assert flights.deposits.t[0] == pytest.approx(t0 * (1 + R_n) / (1 - R_n), rel=1e-9)
    assert flights.deposits.x[0, 0] == pytest.approx(0.1 + x, rel=1e-9)


@BOTH
@pytest.mark.parametrize("R_n", [0.999, 0.5, 0.0])
def test_with_all_its_speed_along_the_ground_kept_a_rock_slides_on_when_it_has_bounced_out(engine, R_n):
    """With R_t = 1, after all its bounces, the rock slides at the speed along the ground at which it was thrown."""
    flights = fly(engine_over(engine, floor(1000.0)), flight(surface(R_n, 1.0, 30.0, 0.0)), (-999, 0.3, 0.5), (2, 0, 0))
    t0, braking = math.sqrt(1.0 / G), math.tan(math.radians(30)) * G
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.ground_speed[0] == pytest.approx(2.0, rel=1e-12)
    bounced = t0 * (1 + R_n) / (1 - R_n)
    assert flights.deposits.t[0] == pytest.approx(bounced + 2.0 / braking, rel=1e-9)
    assert flights.deposits.x[0, 0] + 999.0 == pytest.approx(2.0 * bounced + 2.0 / braking, rel=1e-9)


@BOTH
@MODELS
@pytest.mark.parametrize("R_t", [0.0, 0.8, 1.0])
def test_without_normal_restitution_a_rock_stays_on_what_it_hits(engine, model, R_t):
    over = engine_over(engine, incline(35.0, cells=(10, 3)))
    flights = fly(over, flight(surface(0.0, R_t, 50.0), model), (0.3, 0.2, 5.0), (1.0, 0.0, 0.0))
    assert flights.deposits.impacts[0] == 1
    expected = Outcome.UNRESOLVED_CONTACT if model == "none" and R_t > 0.0 else Outcome.STOPPED
    assert flights.deposits.outcome[0] == expected
    assert lies_on(over, flights) and loses_energy(flights)


@BOTH
def test_an_inelastic_impact_keeps_the_speed_along_the_ground_that_r_t_leaves_it(engine):
    """With R_n = 0 there is only one impact, so R_t applies once."""
    flights = fly(engine_over(engine, floor()), flight(surface(0.0, 0.8, 30.0)), (-9.0, 0.3, 2.0), (5.0, 0.0, 0.0))
    assert flights.deposits.ground_speed[0] == pytest.approx(4.0, rel=1e-12)


@pytest.mark.long
@BOTH
@pytest.mark.parametrize("place", ["box", "gully", "cone", "level"])
def test_without_losses_ten_thousand_bounces_keep_the_energy(engine, place):
    terrain = {
        "box": box(),
        "gully": gully(40.0, 50.0, 0.0, side=50.0, length=1e4),
        "cone": cone(5, 50.0, 40.0),
        "level": floor(cells=4),
    }[place]
    start, v = {"box": ((1.0, 0.3, 3.0), (2.0, 1.0, 0.0))}.get(place, ((0.3, 0.2, 5.0), (0.0, 0.0, 0.0)))
    bounces = 10_000
    flights = fly(engine_over(engine, terrain), flight(surface(1.0, 1.0), max_impacts=bounces, max_time=1e6), start, v)
    energy, _ = specific_energy(flights)
    assert flights.deposits.outcome[0] == Outcome.MAX_IMPACTS and flights.deposits.impacts[0] == bounces
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)


@BOTH
def test_without_losses_a_rock_dropped_on_level_ground_comes_back_to_its_height(engine):
    flights = fly(engine_over(engine, floor()), flight(surface(1.0, 1.0), max_impacts=1000), (0.1, 0.3, 2.0))
    np.testing.assert_allclose(np.diff(flights.impacts.t), 2 * math.sqrt(4.0 / G), rtol=1e-9)


# --- hardly any gravity -----------------------------------------------------------------------------------------------


def test_a_scene_without_gravity_is_refused_by_name(tmp_path):
    """Without gravity no rock would fall, and a flight would end only beyond the terrain."""
    scene = tmp_path / "weightless.yaml"
    scene.write_text(
        "terrain: {pit: {}}\nmaterials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}\n"
        "rock: {mass: 1.0}\nsources: [{name: a, points: [[0, 0, 1]], rocks: 1}]\ngravity: 0\n"
    )
    with pytest.raises(rpf3d.InputError, match=r"`gravity` is 0, but must be a number above 0"):
        rpf3d.read_scene(scene)


@BOTH
@pytest.mark.parametrize("gravity", [1e-6, 1e-12])
def test_with_next_to_no_gravity_a_rock_moves_straight_from_wall_to_wall(engine, gravity):
    """The rock flies at 3 m/s between walls 10 m apart and falls by g t^2 / 2."""
    flights = fly(
        engine_over(engine, box()), flight(surface(1.0, 1.0), "none", gravity=gravity, max_impacts=100), (0, 0.3, 5.0),
        (3.0, 0.0, 0.0),
    )  # fmt: skip
    t = (5.0 + 10.0 * np.arange(100)) / 3.0
    np.testing.assert_allclose(flights.impacts.t, t, rtol=1e-12)
    np.testing.assert_allclose(flights.impacts.x[:, 0], np.where(np.arange(100) % 2 == 0, 5.0, -5.0), atol=1e-11)
    np.testing.assert_allclose(flights.impacts.x[:, 2], 5.0 - 0.5 * gravity * t * t, atol=1e-11)
    np.testing.assert_allclose(flights.impacts.speed_out, 3.0, rtol=1e-6)


@BOTH
@pytest.mark.parametrize("gravity", [1e-6, 1e-12])
def test_with_next_to_no_gravity_a_rock_that_moves_along_the_ground_keeps_its_speed(engine, gravity):
    """Friction is proportional to gravity: over 25 m, a rock at 3 m/s loses mu g 25 m / (3 m/s)."""
    over = engine_over(engine, floor(cells=4))
    flights = fly(over, flight(surface(friction_angle=45.0), gravity=gravity), (-5.0, 0.3, 0.0), (3.0, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert flights.deposits.t[0] == pytest.approx(25.0 / 3.0, rel=10 * gravity + 1e-11)
    assert flights.deposits.x[0, 2] == pytest.approx(0.0, abs=1e-10)


@BOTH
def test_on_level_ground_nothing_pulls_a_rock_along(engine):
    """Gravity has no component along the ground: without friction, direction and speed are kept to 1e-13."""
    over = engine_over(engine, floor(50.0, cells=10))
    flights = fly(over, flight(Surface(0.5, 0.8, 0.0, 0.0)), (-40.0, -3.3, 0.0), (3.0, 0.1, 0.0))
    moving = flights.paths.v[np.hypot(*flights.paths.v[:, :2].T) > 0.0]
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    np.testing.assert_allclose(moving[:, :2], np.tile((3.0, 0.1), (len(moving), 1)), rtol=1e-13)
    np.testing.assert_allclose(flights.deposits.x[0, :2], (50.0, -3.3 + 9.0 / 3.0), rtol=1e-10)


# --- friction ---------------------------------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("facets", [1, 500])
def test_a_slide_of_10_km_without_friction_is_not_cut_short(engine, facets):
    """The rock slides at 1 m/s for 10,000 s on level ground of two or of a thousand facets."""
    ground = strip([(x, 0.0) for x in np.linspace(0.0, 10_000.0, facets + 1)])
    flights = fly(
        engine_over(engine, ground), flight(Surface(0.5, 0.8, 0.0, 0.0), max_time=1e5), (0.0, 0.3, 0.0), (1.0, 0.0, 0.0)
    )
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert flights.deposits.t[0] == pytest.approx(1e4, rel=1e-11)
    assert flights.deposits.path[0] == pytest.approx(1e4, rel=1e-11)


@BOTH
@pytest.mark.parametrize("facets", [1, 500])
def test_a_slide_of_10_km_down_a_slope_reaches_the_speed_of_its_fall(engine, facets):
    """From rest on 5 degrees without friction: v^2 = 2 g h and t = sqrt(2 s / (g sin a))."""
    a = math.radians(5.0)
    over = engine_over(engine, incline(5.0, down=10_000.0, cells=(facets, 1)))
    flights = fly(over, flight(Surface(0.5, 0.8, 0.0, 0.0)), (0.0, 0.3, 0.0))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN and flights.deposits.impacts[0] == 0
    assert flights.deposits.t[0] == pytest.approx(math.sqrt(2e4 / (G * math.sin(a))), rel=1e-8)
    assert flights.deposits.max_speed[0] == pytest.approx(math.sqrt(2e4 * G * math.sin(a)), rel=1e-9)


@BOTH
@pytest.mark.parametrize("angle", [5.0, 20.0, 33.7, 45.0, 71.0])
@pytest.mark.parametrize("strike", [0.0, 37.0])
def test_friction_exactly_at_the_angle_of_the_slope_holds_a_rock_at_rest_and_keeps_the_speed_of_one_that_moves(
    engine, angle, strike
):
    """Pull and friction cancel; rounding must not set the rock in motion, and must not stop a moving rock."""
    descent, _ = down_the_slope(angle, strike)
    over = engine_over(engine, incline(angle, strike, cells=(7, 3)))
    physics = flight(surface(0.5, 0.8, angle, 0.0))
    rest = fly(over, physics, 0.37 * descent).deposits
    assert rest.outcome[0] == Outcome.STOPPED
    np.testing.assert_allclose(rest.x[0], 0.37 * descent, atol=1e-11)
    moving = fly(over, physics, 0.37 * descent, 3.0 * descent).deposits
    assert moving.outcome[0] == Outcome.LEFT_TERRAIN
    assert moving.t[0] == pytest.approx((60.0 - 0.37) / 3.0, rel=1e-6)


@BOTH
@pytest.mark.parametrize("more", [-0.01, 0.01])
def test_friction_a_hundredth_of_a_degree_off_the_slope_decides(engine, more):
    descent, _ = down_the_slope(33.7, 0.0)
    over = engine_over(engine, incline(33.7, cells=(7, 3)))
    ends = fly(over, flight(surface(0.5, 0.8, 33.7 + more, 0.0)), 0.37 * descent).deposits
    assert ends.outcome[0] == (Outcome.STOPPED if more > 0 else Outcome.LEFT_TERRAIN)
