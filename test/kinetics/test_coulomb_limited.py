"""Tests of the Coulomb-limited rebound: formula, bound, and the sum of its bounces compared with single bounces."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from flights.rebounds_named import energy, falling_rock, flight_with, struck
from flights.scenes_of_facets import ENGINES, down_the_slope, engine_over, fly, incline, same_bits, surface
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from suite.property_budget import examples

from rpf3d_core.kinetics.rebound import ConstantRestitution, RemainingBounces, rest_of_bounces
from rpf3d_core.kinetics.rebounds.coulomb_limited import CoulombLimited
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import ZERO, Motion, Outcome, Vec

G = 9.81
MODEL = CoulombLimited()
ROUNDING = 1e-13
"""Relative error of a speed after some dozens of rounded operations."""
STATED = 1e-10
"""Largest error of `coulomb_limited_rest`: of speeds, over the largest speed; of places, over that speed times time."""


# --- one impact -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("R_n", "R_t", "mu", "v", "after"),
    [
        (0.5, 0.8, 0.2, (10.0, 0.0, -1.0), (9.7, 0.0, 0.5)),  # friction removes 0.2 * 1.5 * 1 = 0.3, R_t would remove 2
        (0.5, 0.8, 0.2, (0.0, -10.0, -1.0), (0.0, -9.7, 0.5)),
        (0.5, 0.8, 0.2, (6.0, 8.0, -1.0), (5.82, 7.76, 0.5)),
        (0.5, 0.8, 2.0, (10.0, 0.0, -1.0), (8.0, 0.0, 0.5)),  # friction would remove 3, R_t removes 2
        (0.5, 0.8, 0.0, (10.0, 0.0, -1.0), (10.0, 0.0, 0.5)),
        (0.5, 1.0, 5.0, (10.0, 0.0, -9.0), (10.0, 0.0, 4.5)),
        (0.0, 0.0, 0.5, (3.0, 0.0, -8.0), (0.0, 0.0, 0.0)),
        (0.0, 0.0, 0.5, (3.0, 0.0, -4.0), (1.0, 0.0, 0.0)),
        (1.0, 0.0, 0.5, (3.0, 0.0, -2.0), (1.0, 0.0, 2.0)),
        (0.5, 0.0, 0.5, (0.0, 0.0, -4.0), (0.0, 0.0, 2.0)),
    ],
)
def test_an_impact_takes_the_smaller_of_both_losses_along_the_ground(R_n, R_t, mu, v, after):
    assert struck(MODEL, Surface(R_n, R_t, mu, 0.5), v).v == pytest.approx(after, rel=1e-14, abs=1e-15)


SHARES = st.floats(0.0, 1.0)
SPEEDS = st.floats(-200.0, 200.0)


@given(SHARES, SHARES, st.floats(0.0, 6.0), st.tuples(SPEEDS, SPEEDS, SPEEDS), st.tuples(SPEEDS, SPEEDS, SPEEDS))
@examples(300)
def test_no_impact_takes_more_along_the_ground_than_coulomb_friction_allows(R_n, R_t, mu, v, normal):
    size = np.linalg.norm(normal)
    n = np.array(normal) / size if size > 1e-3 else np.array((0.0, 0.0, 1.0))
    v_in = np.array(v) - 2.0 * max(np.dot(v, n), 0.0) * n
    after = struck(MODEL, Surface(R_n, R_t, mu, 0.5), tuple(v_in.tolist()), ZERO, tuple(n.tolist()))
    into, speed = -v_in @ n, np.linalg.norm(v_in)
    along, kept = v_in + into * n, np.array(after.v) - np.dot(after.v, n) * n
    loss, slack = np.linalg.norm(along - kept), ROUNDING * speed
    assert loss <= mu * (1.0 + R_n) * into + slack
    assert loss <= (1.0 - R_t) * np.linalg.norm(along) + slack
    assert kept @ along >= -slack * speed
    assert energy(after) <= energy(Motion(0.0, ZERO, tuple(v_in.tolist()), ZERO)) * (1.0 + ROUNDING)


# --- the sum of the bounces, against single bounces in 40 digits ------------------------------------------------------


class Case(NamedTuple):
    """Bounces on a plane after an impact.

    r, q, mu : R_n, R_t and friction; slope : of the plane (degrees)
    w, u : speeds (m/s) normal to the plane and along it; way : direction of u (degrees from downhill)
    """

    r: float
    q: float
    mu: float
    slope: float
    w: float
    u: float
    way: float


def frame_of(case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the plane's unit normal, its downhill direction and the velocity (m/s) after the impact, each (3,)."""
    a, b = math.radians(case.slope), math.radians(case.way)
    n, down = np.array((math.sin(a), 0.0, math.cos(a))), np.array((math.cos(a), 0.0, -math.sin(a)))
    return n, down, case.w * n + case.u * (math.cos(b) * down + math.sin(b) * np.array((0.0, 1.0, 0.0)))


def summed(case: Case) -> RemainingBounces:
    """Return the sum of the bounces as the package computes it."""
    n, _, v = frame_of(case)
    motion = Motion(0.0, ZERO, tuple(v.tolist()), ZERO)
    rest: RemainingBounces = rest_of_bounces(
        MODEL, Surface(case.r, case.q, case.mu, 0.5), motion, tuple(n.tolist()), G, falling_rock()
    )
    return rest


class Flown(NamedTuple):
    """Places (N, 2) m downhill and across after each bounce, and velocity (m/s) and time (s) at the end."""

    places: np.ndarray
    v: np.ndarray
    t: float


@cache
def flown(case: Case) -> Flown:
    """Compute bounce by bounce, in the axes of the plane, until the normal speed is 1e-18 of the first."""
    with mp.workdps(40):
        r, q, mu, w = mpf(case.r), mpf(case.q), mpf(case.mu), mpf(case.w)
        a, b = mp.radians(mpf(case.slope)), mp.radians(mpf(case.way))
        steep, push = mpf(G) * mp.sin(a), mpf(G) * mp.cos(a)
        u, side, x, y, t, places = case.u * mp.cos(b), case.u * mp.sin(b), mpf(0), mpf(0), mpf(0), []
        while w > mpf(case.w) / 10**18:
            T = 2 * w / push
            x, y, t = x + u * T + steep * T * T / 2, y + side * T, t + T
            u += steep * T
            speed = mp.hypot(u, side)
            if speed > 0:
                share = max(q * speed, speed - mu * (1 + r) * w) / speed
                u, side = share * u, share * side
            w *= r
            places.append((float(x), float(y)))
        return Flown(np.array(places), np.array((float(u), float(side))), float(t))


NAMED = {
    "friction-for-good": Case(0.5, 0.8, 0.18, 20.0, 0.1, 10.0, 0.0),
    "friction-for-good-uphill": Case(0.5, 0.8, 0.18, 20.0, 0.1, 10.0, 180.0),
    "friction-for-good-across": Case(0.5, 0.8, 0.18, 20.0, 0.1, 10.0, 90.0),
    "friction-for-good-slow": Case(0.7, 0.5, 0.18, 20.0, 0.1, 0.5, 130.0),
    "R_t-first": Case(0.8, 0.9, 0.7, 20.0, 3.0, 4.0, 30.0),
    "R_t-for-good": Case(0.8, 0.4, 1.2, 20.0, 1.0, 1.0, 60.0),
    "R_t-for-good-at-once": Case(0.5, 0.3, 2.0, 10.0, 2.0, 0.3, 60.0),
    "R_t-as-R_n-level": Case(0.6, 0.6, 1.0, 0.0, 1.0, 1.0, 0.0),
    "R_t-as-R_n-slope": Case(0.75, 0.75, 5.0, 20.0, 0.03, 0.006, 180.0),
    "uphill-and-back": Case(0.85, 0.9, 0.3, 35.0, 1.0, 0.4, 180.0),
    "uphill-askew-and-back": Case(0.85, 0.9, 0.3, 35.0, 1.0, 0.4, 170.0),
    "steeper-than-friction": Case(0.5, 0.2, 0.5, 50.0, 0.5, 0.0, 0.0),
    "level-straight-up": Case(0.5, 0.9, 0.5, 0.0, 0.5, 0.0, 0.0),
    "R_n-0": Case(0.0, 0.8, 0.5, 20.0, 0.5, 3.0, 45.0),
    "R_t-1": Case(0.5, 1.0, 0.5, 20.0, 0.5, 3.0, 45.0),
    "R_t-nearly-1": Case(0.5, 1.0 - 1e-9, 0.5, 20.0, 0.5, 3.0, 45.0),
    "R_t-0": Case(0.5, 0.0, 0.5, 20.0, 0.5, 3.0, 45.0),
    "mu-0": Case(0.5, 0.8, 0.0, 20.0, 0.5, 3.0, 135.0),
    "mu-nearly-0": Case(0.5, 0.8, 1e-7, 20.0, 0.5, 0.1, 179.0),
    "R_n-0.95": Case(0.95, 0.8, 0.5, 20.0, 0.1, 3.0, 45.0),
}


def random_case(draw: np.random.Generator) -> Case:
    """Return a case with random coefficients, bounces 1e-9 m to 1 m high, and speeds from 0 to 100 m/s."""
    r, u = draw.choice([0.0, draw.uniform(0.0, 0.9)], p=[0.05, 0.95]), 10.0 ** draw.uniform(-6, 2)
    return Case(
        float(r), float(draw.choice([draw.uniform(), draw.uniform(), 0.0, 1.0, r])),
        float(draw.choice([draw.uniform(0.0, 2.0), draw.uniform(0.0, 2.0), 0.0, 5.0, 1e-7])),
        float(draw.choice([draw.uniform(0.0, 80.0), draw.uniform(0.0, 80.0), 0.0])),
        10.0 ** draw.uniform(-4, 0.6), float(draw.choice([u, u, 0.0])),
        float(draw.choice([draw.uniform(0.0, 360.0), 0.0, 180.0])),
    )  # fmt: skip


DRAW = np.random.default_rng(15)
CASES = NAMED | {f"random-{i}": random_case(DRAW) for i in range(150)}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_sum_is_that_of_bounces_one_by_one(case):
    rest, exact = summed(case), flown(case)
    _, down, _ = frame_of(case)
    way = np.add(rest.along, rest.down)
    found = np.array([way @ down, way[1], rest.v @ down, rest.v[1]])
    largest = max(case.u, np.linalg.norm(exact.v), G * math.sin(math.radians(case.slope)) * exact.t, 1e-300)
    assert rest.ends
    assert rest.t == pytest.approx(exact.t, rel=1e-13)
    np.testing.assert_allclose(found[:2], exact.places[-1], rtol=0.0, atol=STATED * largest * exact.t)
    np.testing.assert_allclose(found[2:], exact.v, rtol=0.0, atol=STATED * largest)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_every_bounce_lies_in_the_parallelogram_that_must_fit_on_the_facet(case):
    """In none of 36 directions does a place lie farther out than the corners of the parallelogram."""
    rest, exact = summed(case), flown(case)
    _, down, _ = frame_of(case)
    along, fall = (np.array((np.dot(part, down), part[1])) for part in (rest.along, rest.down))
    corners = np.array([(0.0, 0.0), along, fall, along + fall])
    angles = np.radians(np.arange(0.0, 360.0, 10.0))
    directions = np.stack([np.cos(angles), np.sin(angles)])
    size = np.abs(corners).max()
    assert ((exact.places @ directions).max(0) <= (corners @ directions).max(0) + STATED * size).all()


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_sum_makes_no_energy(case):
    """The energy per kilogram at the end, minus that gained by the fall along the plane, is at most that before."""
    rest = summed(case)
    fallen = -(rest.along[2] + rest.down[2])
    before, after = 0.5 * (case.u**2 + case.w**2), 0.5 * np.dot(rest.v, rest.v)
    assert after - G * fallen <= before * (1.0 + 1e-12) + 1e-9 * after


def test_bounces_without_an_end_are_flown():
    assert not summed(Case(1.0, 0.8, 0.5, 20.0, 0.1, 1.0, 0.0)).ends


@pytest.mark.long
def test_of_bounces_that_hardly_get_smaller_those_that_are_summed_are_right():
    """Near R_n = 1 there may be too many bounces for the sum; then the rock is flown, and the sum is never wrong."""
    cases = [Case(r, q, 0.5, 20.0, 0.1, 1.0, 45.0) for r in (0.97, 0.99, 0.999) for q in (0.3, 0.98, 0.9999)]
    rests = [summed(case) for case in cases]
    assert {rest.ends for rest in rests} == {True, False}
    for case, rest in zip(cases, rests, strict=True):
        if rest.ends:
            exact = flown(case)
            _, down, _ = frame_of(case)
            assert (rest.v @ down, rest.v[1]) == pytest.approx(exact.v, rel=1e-9, abs=1e-10)


# --- flights ----------------------------------------------------------------------------------------------------------

SLOPE, FRICTION, SPEED, SECONDS = 20.0, 10.0, 10.0, 3.0
SAME = 1e-9
"""Largest difference (m and m/s) between results with different `smallest_bounce`.

It is due to the 1e-12 of 10 m/s that a sum leaves out, over 3 s, and to rounding in some hundred events at 60 m.
"""


def bouncing_down(engine: str, model, rise: float, smallest_bounce: float):
    """Fly a rock that leaves a slope at SPEED along it, in bounces that rise `rise` (m) above the slope.

    Return its flights, the downhill direction and the normal of the slope.
    """
    descent, normal = down_the_slope(SLOPE)
    v = SPEED * descent + math.sqrt(2.0 * G * math.cos(math.radians(SLOPE)) * rise) * normal
    physics = flight_with(
        model, surface(0.5, 0.8, FRICTION), "sliding", smallest_bounce=smallest_bounce, max_time=SECONDS
    )
    over = engine_over(engine, incline(SLOPE, down=120.0))
    return fly(over, physics, np.array((0.0, 0.2, 0.0)) + 1e-6 * normal, v), descent, normal


@pytest.mark.long
@pytest.mark.parametrize("rise", [1e-4, 1e-2])
@pytest.mark.parametrize("engine", ENGINES)
def test_bouncing_on_a_slope_slows_a_rock_as_friction_does(engine, rise):
    """Momentum gives the final speed: per mass, the normal impulse of t seconds is g_n t minus the initial w."""
    flights, descent, normal = bouncing_down(engine, MODEL, rise, 1e-3)
    w = flights.paths.v[0] @ normal
    g_n, g_t = G * math.cos(math.radians(SLOPE)), G * math.sin(math.radians(SLOPE))
    mu = math.tan(math.radians(FRICTION))
    end = flights.paths.v[-1] @ descent
    assert flights.deposits.outcome[0] == Outcome.MAX_TIME
    assert SPEED + g_t * SECONDS - end <= mu * g_n * SECONDS * (1.0 + 1e-12)
    assert end == pytest.approx(SPEED + (g_t - mu * g_n) * SECONDS + mu * w, abs=SAME)
    assert flights.deposits.path[0] > 30.0


@pytest.mark.parametrize("rise", [1e-4, 1e-2])
def test_constant_restitution_stops_the_same_rock_within_metres(rise):
    flights, _, _ = bouncing_down("reference", ConstantRestitution(), rise, 2e-2)
    speeds = np.linalg.norm(flights.paths.v, axis=1)
    assert speeds[1:3].min() < 1e-6 and flights.paths.t[2] < 0.2


@pytest.mark.parametrize("rise", [1e-4, 1e-2])
@pytest.mark.parametrize("engine", ENGINES)
def test_neither_place_nor_speed_depends_on_smallest_bounce(engine, rise):
    ends = [bouncing_down(engine, MODEL, rise, h)[0] for h in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)]
    assert len({int(flights.deposits.impacts[0]) for flights in ends}) > 2, "it is not merely ignored"
    for flights in ends[1:]:
        np.testing.assert_allclose(flights.deposits.x[0], ends[0].deposits.x[0], rtol=0.0, atol=SAME)
        np.testing.assert_allclose(flights.paths.v[-1], ends[0].paths.v[-1], rtol=0.0, atol=SAME)


@pytest.mark.long
@pytest.mark.parametrize("resting", ["none", "sliding"])
@pytest.mark.parametrize("engine", ENGINES)
def test_where_friction_never_limits_every_bit_is_that_of_constant_restitution(engine, resting):
    over = engine_over(engine, incline(25.0, 15.0, cells=(9, 3)))
    ground = Surface(0.8, 0.5, 1e9, 0.5)
    physics = [flight_with(model, ground, resting) for model in (MODEL, ConstantRestitution())]
    assert same_bits(*(fly(over, one, (0.3, 0.2, 4.0), (1.0, 0.3, 0.0)) for one in physics))


@pytest.mark.parametrize("R_t", [0.0, 0.5, 1.0])
def test_without_friction_a_rock_goes_as_one_whose_bounces_lose_nothing_along_the_ground(R_t):
    over = engine_over("reference", incline(25.0, 15.0, cells=(9, 3)))
    flights = [
        fly(over, flight_with(model, Surface(0.6, kept, 0.0, 0.5)), (0.3, 0.2, 4.0), (1.0, 0.3, 0.0))
        for model, kept in ((MODEL, R_t), (ConstantRestitution(), 1.0))
    ]
    ends: list[Vec] = [tuple(one.deposits.x[0]) for one in flights]
    assert ends[0] == pytest.approx(ends[1], rel=1e-12)
