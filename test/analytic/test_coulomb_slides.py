"""Tests of flights that only slide, on planes and in gullies, against closed forms."""

import math

import numpy as np
import pytest
from flights.scenes_of_facets import ENGINES, down_the_slope, engine_over, flight, floor, fly, gully, incline, surface

from rpf3d_core.materials.library import Surface
from rpf3d_core.values import Mode, Outcome

G = 9.81
OVER_EDGES = 1e-6
"""Largest relative error: at each edge a slide is within the contact tolerance, about 1e-10 m, of the plane."""
PLACES = (0.0, 1.0, 2.3, 4.1, 7.77)
"""Distances (m) down the slope; in float64 these places lie above, on and below the computed plane."""


@pytest.mark.parametrize("strike", [0.0, 37.0, 90.0])
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_set_sliding_down_a_slope_of_20_degrees_stops_after_the_printed_way(engine, place, strike):
    """physics-9.5: slope 20 degrees, mu 0.5, v0 10 m/s: 39.87 m. The rock starts in contact, moving along the slope."""
    descent, normal = down_the_slope(20.0, strike)
    over = engine_over(engine, incline(20.0, strike, cells=(7, 3)))
    start = place * descent + 0.3 * np.cross(normal, descent)
    end = fly(over, flight(Surface(0.5, 0.8, 0.5, 0.0)), start, 10.0 * descent).deposits
    exact = 100.0 / (2 * G * (0.5 * math.cos(math.radians(20)) - math.sin(math.radians(20))))
    assert exact == pytest.approx(39.87, abs=5e-3)
    assert end.impacts[0] == 0
    assert (end.x[0] - start) @ descent == pytest.approx(exact, rel=OVER_EDGES)
    assert end.t[0] == pytest.approx(2 * exact / 10.0, rel=OVER_EDGES)
    assert end.path[0] == pytest.approx(exact, rel=OVER_EDGES)


@pytest.mark.parametrize("stop_speed", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_slide_ends_at_the_stop_speed(engine, stop_speed):
    over = engine_over(engine, floor(cells=3))
    flights = fly(over, flight(Surface(0.5, 0.8, 0.4, stop_speed)), (-9.0, 0.7, 0.0), (5.0, 0.0, 0.0))
    end = flights.deposits
    assert end.x[0, 0] + 9.0 == pytest.approx((25.0 - stop_speed**2) / (2 * 0.4 * G), rel=OVER_EDGES)
    assert end.outcome[0] == Outcome.STOPPED


@pytest.mark.parametrize("cells", [(1, 1), (9, 4), (80, 30)], ids=str)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_slide_across_a_slope_is_the_same_on_one_facet_or_on_thousands(engine, cells):
    """The reference is Runge-Kutta with 20,000 steps on the plane without facets."""
    descent, normal = down_the_slope(25.0)
    across = np.cross(normal, descent)
    jitter = 4 if cells[0] > 1 else None
    over = engine_over(engine, incline(25.0, cells=cells, jitter=jitter, half_width=30.0))
    mu, start, v = 0.6, 5.0 * descent - 20.0 * across, 9.0 * across - 4.0 * descent
    end = fly(over, flight(Surface(0.5, 0.8, mu, 0.5)), start, v).deposits
    s, c, t = stepped(G * math.sin(math.radians(25)), mu * G * math.cos(math.radians(25)), -4.0, 9.0, 0.5)
    assert end.outcome[0] == Outcome.STOPPED
    moved = end.x[0] - start
    assert (moved @ descent, moved @ across, end.t[0]) == pytest.approx((s, c, t), abs=1e-5)


def stepped(pull, k, v_down, v_across, stop):
    """Return the ways (m) down and across and the time (s) until the speed is `stop`, by Runge-Kutta steps.

    Bisection shortens the last step.
    """

    def rate(state):
        u = math.hypot(state[2], state[3])
        return np.array([state[2], state[3], pull - k * state[2] / u, -k * state[3] / u])

    def ahead(state, h):
        a = rate(state)
        b = rate(state + h / 2 * a)
        c = rate(state + h / 2 * b)
        return state + h / 6 * (a + 2 * b + 2 * c + rate(state + h * c))

    state, t, h = np.array([0.0, 0.0, v_down, v_across]), 0.0, 1e-3
    while h > 1e-12:
        following = ahead(state, h)
        if math.hypot(*following[2:]) > stop:
            state, t = following, t + h
        else:
            h /= 2
    return state[0], state[1], t


# --- gullies ----------------------------------------------------------------------------------------------------------


def gully_motion(left, right, dip, mu_left, mu_right):
    """Return gravity along the line (m/s2), friction (m/s2), and the unit vector of the line, from the force balance.

    left, right, dip : angles (degrees) of the walls and of the line; mu_left, mu_right : friction
    """
    line = np.array([math.cos(math.radians(dip)), 0.0, -math.sin(math.radians(dip))])
    normals = []
    for angle, sign in ((left, 1.0), (right, -1.0)):
        out = np.cross(line, np.array([0.0, sign, math.tan(math.radians(angle))]))
        normals.append(math.copysign(1.0, out[2]) * out / np.linalg.norm(out))
    gravity = np.array([0.0, 0.0, -G])
    across = gravity - (gravity @ line) * line
    pushes, *_ = np.linalg.lstsq(np.array(normals).T, -across, rcond=None)
    return gravity @ line, mu_left * pushes[0] + mu_right * pushes[1], line


GULLIES = [
    (40.0, 25.0, 10.0, 0.3, 0.5),
    (60.0, 60.0, 5.0, 0.2, 0.1),
    (20.0, 35.0, 15.0, 0.7, 0.4),
    (30.0, 10.0, 0.0, 0.3, 0.2),
]


@pytest.mark.parametrize("strike", [0.0, 200.0])
@pytest.mark.parametrize("cells", [1, 12])
@pytest.mark.parametrize("case", GULLIES, ids=str)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_slides_along_a_gully_against_the_friction_of_both_sides(engine, case, cells, strike):
    pull, friction, line = gully_motion(*case)
    assert friction > pull, "the case must stop"
    length = 1.2 * 25.0 / (2 * (friction - pull)) + 2.0
    over = engine_over(engine, gully(*case[:3], length=length, cells=cells, strike=strike))
    a = math.radians(strike)
    line = np.array([math.cos(a) * line[0], math.sin(a) * line[0], line[2]])
    sides = [Surface(0.5, 0.8, mu, 0.0) for mu in case[3:]]
    flights = fly(over, flight(sides), (0.0, 0.0, 0.0), 5.0 * line)
    end = flights.deposits
    way = 25.0 / (2 * (friction - pull))
    assert end.outcome[0] == Outcome.STOPPED
    assert end.x[0] @ line == pytest.approx(way, rel=OVER_EDGES)
    assert np.linalg.norm(end.x[0] - (end.x[0] @ line) * line) < 1e-6
    assert end.t[0] == pytest.approx(2 * way / 5.0, rel=OVER_EDGES)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_at_rest_in_a_steep_gully_accelerates_by_pull_less_friction(engine):
    case = (50.0, 35.0, 30.0, 0.2, 0.3)
    pull, friction, line = gully_motion(*case)
    over = engine_over(engine, gully(*case[:3], length=40.0, cells=6))
    flights = fly(over, flight([Surface(0.5, 0.8, mu, 0.0) for mu in case[3:]]), (0.0, 0.0, 0.0))
    sliding = flights.paths.mode == Mode.SLIDING
    t, way = flights.paths.t[sliding], flights.paths.x[sliding] @ line
    assert way[-1] > 20.0
    np.testing.assert_allclose(way, 0.5 * (pull - friction) * t**2, rtol=OVER_EDGES, atol=1e-6)


@pytest.mark.parametrize("engine", ENGINES)
def test_friction_holds_a_rock_in_a_gully_that_would_slide_on_either_side_alone(engine):
    """Wedging: both sides dip at 40 degrees, the line at 10; the normal forces add up to more than the weight."""
    over = engine_over(engine, gully(40.0, 40.0, 10.0))
    end = fly(
        over, flight(surface(friction_angle=25.0, stop_speed=0.0)), (1.0, 0.0, -math.tan(math.radians(10)))
    ).deposits
    assert end.outcome[0] == Outcome.STOPPED
    assert end.path[0] < 1e-6
