"""Bounces that are summed up pass no obstacle that the true path of the bounces meets."""

import math

import numpy as np
import pytest
from flights.obstacles_made import STRAIGHT, fence, trees, with_effects
from flights.scenes_of_facets import ENGINES, down_the_slope, engine_over, flight, fly, incline, surface

from rpf3d_core.kinetics.rebound import RemainingBounces, rebound, rest_of_bounces
from rpf3d_core.kinetics.rebounds.coulomb_limited import CoulombLimited
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import ZERO, Mode, Motion, Outcome

G, ANGLE, RISE = 9.81, 30.0, 0.1
REACH = 0.7
"""m, radius of the rock and of the stem of a tree together."""
TERRAIN = incline(ANGLE, down=60.0, up=60.0, half_width=60.0)
_, NORMAL = down_the_slope(ANGLE)


def terms(smallest_bounce: float):
    """Return a flight with the default rebound model, R_n 0.5 and R_t 0.8."""
    return flight(surface(0.5, 0.8, 30.0, 0.0), rebound="coulomb_limited", smallest_bounce=smallest_bounce)


def across_the_slope():
    """Return position and velocity (3,) of a rock across the slope; its first impact leaves bounces of 0.9 RISE."""
    into = np.sqrt(2.0 * G * NORMAL[2] * 0.9 * RISE) / 0.5
    return np.array([0.0, -20.0, 0.0]) + 1e-3 * NORMAL, np.array([0.0, 8.0, 0.0]) - into * NORMAL


def farthest_impact(over):
    """Return the impact (3,) m of the true path that is farthest from the chord of the sum, and the way to it, (3,) m.

    The bounces of the true path are flown one by one.
    """
    summed, flown = (fly(over, terms(h), *across_the_slope()).paths for h in (RISE, 1e-7))
    (k,) = np.flatnonzero(summed.mode == Mode.SETTLING)
    start, chord = summed.x[k], summed.x[k + 1] - summed.x[k]
    during = (flown.mode == Mode.FLIGHT) & (flown.t > summed.t[k]) & (flown.t < summed.t[k + 1])
    off = flown.x[during] - start
    off -= np.outer(off @ chord / (chord @ chord), chord)
    most = np.linalg.norm(off, axis=1).argmax()
    return flown.x[during][most], off[most]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_fence_that_only_the_true_path_crosses_catches_the_rock(engine):
    over = engine_over(engine, TERRAIN)
    place, off = farthest_impact(over)
    assert np.linalg.norm(off) > 0.15
    away = off / np.linalg.norm(off)
    barrier = fence(TERRAIN, [tuple((place - 0.4 * off)[:2]), tuple((place + 2.0 * away)[:2])], 2.0, 1e9)
    for smallest_bounce in (1e-7, RISE):
        flights = fly(over, with_effects(terms(smallest_bounce), barrier), *across_the_slope())
        assert flights.deposits.outcome[0] == Outcome.CAUGHT


@pytest.mark.parametrize("engine", ENGINES)
def test_a_tree_that_only_the_true_path_reaches_is_hit(engine):
    over = engine_over(engine, TERRAIN)
    place, off = farthest_impact(over)
    at = place + (REACH - 0.3 * np.linalg.norm(off)) * off / np.linalg.norm(off)
    forest = trees(TERRAIN, [tuple(at[:2])], 40.0, 20.0, 1e7, STRAIGHT)
    for smallest_bounce in (1e-7, RISE):
        flights = fly(over, with_effects(terms(smallest_bounce), forest), *across_the_slope())
        assert np.any(flights.impacts.facet < 0)


@pytest.mark.parametrize("engine", ENGINES)
def test_obstacles_far_from_the_bounces_change_no_result(engine):
    over = engine_over(engine, TERRAIN)
    far = fence(TERRAIN, [(-10.0, -30.0), (-10.0, 30.0)], 2.0, 1e9)
    bare, fenced = (
        fly(over, each, *across_the_slope()).deposits for each in (terms(RISE), with_effects(terms(RISE), far))
    )
    assert np.array_equal(bare.x, fenced.x) and np.array_equal(bare.t, fenced.t)


# --- the triangle that contains the bounces ---------------------------------------------------------------------------


def sum_of(
    ground: Surface, angle: float, speed: float, heading: float, rise: float
) -> tuple[RemainingBounces, np.ndarray, np.ndarray]:
    """Return the sum of bounces on an incline, the rock's first velocity (3,) m/s and the normal (3,).

    angle : of the incline; heading : of the speed along it, from the steepest descent (both in degrees)
    speed : along the incline (m/s); rise : of the first bounce (m)
    """
    (descent, normal), h = down_the_slope(angle), math.radians(heading)
    v = speed * (math.cos(h) * descent + math.sin(h) * np.cross(normal, descent))
    v = v + math.sqrt(2.0 * G * normal[2] * rise) * normal
    motion = Motion(0.0, ZERO, tuple(v), ZERO)
    return rest_of_bounces(CoulombLimited(), ground, motion, tuple(normal), G, None), v, normal


def test_all_bounces_are_in_the_triangle():
    """Places are shares of the two displacements of the sum."""
    random = np.random.default_rng(6)
    for _ in range(200):
        R_n, R_t, friction = random.uniform(0.05, 0.9), random.uniform(), random.uniform(0.0, 40.0)
        ground = surface(R_n, R_t, friction)
        angle, heading = random.uniform(5.0, 70.0), random.uniform(20.0, 160.0)
        rest, v, normal = sum_of(ground, angle, random.uniform(0.1, 10.0), heading, 0.1)
        sides, x, pull = np.array([rest.along, rest.down]).T, np.zeros(3), np.array([0.0, 0.0, -G])
        for _ in range(60):
            T = 2.0 * (v @ normal) / (G * normal[2])
            for share in (0.25, 0.5, 0.75, 1.0):
                t = share * T
                along, down = np.linalg.lstsq(sides, _on(x + v * t + 0.5 * t * t * pull, normal), rcond=None)[0]
                assert -1e-9 <= down <= along + 1e-9 <= 1.0 + 2e-9
            x, v = x + v * T + 0.5 * T * T * pull, v + T * pull
            v = np.array(rebound(CoulombLimited(), ground, Motion(0.0, ZERO, tuple(v), ZERO), tuple(normal), None).v)


def _on(x: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the point (3,) of the plane through the origin that is nearest to x (3,)."""
    return x - (x @ normal) * normal


@pytest.mark.parametrize(
    ("rise", "ground", "radius"),
    [
        (1e-3, surface(0.5, 0.8, 30.0), 0.0137),
        (1e-3, surface(0.95, 1.0, 0.0), 1.306),
        (0.1, surface(0.5, 0.8, 30.0), 1.278),
    ],
)
def test_the_largest_circle_in_the_triangle_is_as_stated(rise, ground, radius):
    rest, _, _ = sum_of(ground, 60.0, 30.0, 90.0, rise)
    one, other = np.array(rest.along), np.array(rest.down)
    around = sum(np.linalg.norm(side) for side in (one, other, one + other))
    assert np.linalg.norm(np.cross(one, other)) / around == pytest.approx(radius, rel=5e-3)
