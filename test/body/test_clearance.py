"""Tests of the time for which a flying body stays clear of a plane, against motions integrated by scipy."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

from rpf3d_core.body.clearance import TURNING, BodySweep, clear_time, reach_time, set_arms
from rpf3d_core.body.quaternions import turned
from rpf3d_core.body.rotation import spin_bound, turned_for, turning_of
from rpf3d_core.jit.dispatch import loop

G = 9.81
CORNERS = 6
BELOW = 1e-9
"""Largest depth (m) below the plane due to rounding and the integration."""


class Bodies(NamedTuple):
    """N bodies in flight at time 0, each with a plane.

    corners : (N, K, 3) m; moments : (N, 3) m2, of inertia per mass
    state : (N, 13): position, velocity, spin in the body's axes, orientation
    planes : (N, 4): unit normal and distance (m); bounds : (N,) rad/s, upper bounds of the spin
    """

    corners: np.ndarray
    moments: np.ndarray
    state: np.ndarray
    planes: np.ndarray
    bounds: np.ndarray


# --- the motion, integrated -------------------------------------------------------------------------------------------


def matrices(q: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (N, 3, 3) of quaternions (N, 4)."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1)[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def heights(bodies: Bodies, t: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the heights (N, K) m of the corners above the planes at times t (N,) s, for orientations q (N, 4)."""
    x, v, n = bodies.state[:, :3], bodies.state[:, 3:6], bodies.planes[:, :3]
    fall = np.array([0.0, 0.0, -0.5 * G])
    centres = x + v * t[:, None] + fall * (t * t)[:, None]
    corners = np.einsum("nij,nkj->nki", matrices(q), bodies.corners) + centres[:, None]
    return np.einsum("nki,ni->nk", corners, n) - bodies.planes[:, 3:]


def orientations(bodies: Bodies, until: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return the orientations (S, N, 4) at the shares (S,) of the times `until` (N,) s, by Euler's equations.

    Bodies that turn about equally far are integrated together, because the body that turns farthest sets the steps.
    """
    found = np.empty((len(shares), len(until), 4))
    for alike in np.array_split(np.argsort(bodies.bounds * until), 20):
        found[:, alike] = integrated(bodies.moments[alike], bodies.state[alike], until[alike], shares)
    return found


def integrated(inertia: np.ndarray, state: np.ndarray, until: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return the orientations (S, N, 4) of bodies with moments (N, 3) and states (N, 13), integrated as one system."""
    count = len(until)

    def change(_, y):
        w, q = y[: 3 * count].reshape(-1, 3), y[3 * count :].reshape(-1, 4)
        spin = np.cross(inertia * w, w) / inertia
        a, b = q[:, :1], q[:, 1:]
        turn = 0.5 * np.hstack([-np.sum(b * w, 1, keepdims=True), a * w + np.cross(b, w)])
        return np.concatenate([(spin * until[:, None]).ravel(), (turn * until[:, None]).ravel()])

    start = np.concatenate([state[:, 6:9].ravel(), state[:, 9:].ravel()])
    done = solve_ivp(change, (0.0, 1.0), start, "DOP853", t_eval=shares, rtol=1e-13, atol=1e-13)
    return done.y[3 * count :].T.reshape(len(shares), count, 4)


LONG = 1e9
"""Time (s) after which no body of these tests reaches a plane for the first time."""


# --- the times --------------------------------------------------------------------------------------------------------


@loop
def times_of(corners, space_spins, state, planes, bounds, asked, arms, found):
    """Write the clear time (s) of each body into `found` (N,).

    asked : (N,) s, the time beyond which the caller needs no result; arms : (4, C), working memory
    """
    for k in range(len(found)):
        s, p, w = state[k], planes[k], space_spins[k]
        sweep = BodySweep(
            x=(s[0], s[1], s[2]), v=(s[3], s[4], s[5]), w=(w[0], w[1], w[2]), q=(s[9], s[10], s[11], s[12]),
            gravity=9.81, spin_bound=bounds[k],
        )  # fmt: skip
        set_arms(arms, corners[k], 0, corners.shape[1], 1.0)
        found[k] = clear_time(arms, corners.shape[1], sweep, ((p[0], p[1], p[2]), p[3]), asked[k])


def clear_times(bodies: Bodies, run=times_of, asked=None) -> np.ndarray:
    space_spins = np.einsum("nij,nj->ni", matrices(bodies.state[:, 9:]), bodies.state[:, 6:9])
    found, arms = np.zeros(len(bodies.state)), np.zeros((4, bodies.corners.shape[1]))
    asked = np.full(len(found), LONG) if asked is None else asked
    run(bodies.corners, space_spins, bodies.state, bodies.planes, bodies.bounds, asked, arms, found)
    return found


def clear_for(corners, first, last, size, sweep, plane) -> float:
    """Return the clear time (s) of one body; infinite beyond LONG."""
    arms = np.zeros((4, last - first))
    set_arms(arms, corners, first, last, size)
    return clear_time(arms, last - first, sweep, plane, LONG)


def random_bodies(seed: int, count: int, corners: int) -> Bodies:
    """Return random bodies with spins up to about 30 rad/s, whose lowest corner is 1e-6 to 10 m above its plane.

    The corners do not follow from the moments of inertia, so that a single corner may be anywhere.
    """
    rng = np.random.default_rng(seed)
    second = 10.0 ** rng.uniform(-2, 0, size=(count, 3))  # integrals of x^2, y^2, z^2: any positive values
    moments = np.sort(second.sum(1, keepdims=True) - second, axis=1)
    spins = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-1, 1.2, size=(count, 1))
    q = rng.normal(size=(count, 4))
    n = rng.normal(size=(count, 3))
    state = np.hstack([np.zeros((count, 3)), rng.normal(size=(count, 3)) * 5.0, spins, q])
    state[:, 9:] /= np.linalg.norm(q, axis=1)[:, None]
    planes = np.hstack([n / np.linalg.norm(n, axis=1)[:, None], np.zeros((count, 1))])
    bounds = np.sqrt((moments * spins**2).sum(1) / moments.min(1))
    made = Bodies(rng.normal(size=(count, corners, 3)), moments, state, planes, bounds)
    planes[:, 3] = heights(made, np.zeros(count), state[:, 9:]).min(1) - 10.0 ** rng.uniform(-6, 1, size=count)
    return made


# --- no corner reaches the plane before -------------------------------------------------------------------------------


@pytest.mark.parametrize(("seed", "corners"), [(1, CORNERS), (2, 1)])
def test_a_body_has_no_corner_below_the_plane_before_its_clear_time(seed, corners):
    bodies = random_bodies(seed, 2000, corners)
    until = np.minimum(clear_times(bodies), 3.0)
    assert until.min() > 0.0
    shares = np.linspace(0.0, 1.0, 101)
    lowest = np.array(
        [heights(bodies, s * until, q) for s, q in zip(shares, orientations(bodies, until, shares), strict=True)]
    )
    assert lowest.min() > -BELOW


def test_a_needle_with_the_largest_acceleration_arrives_little_after_its_clear_time():
    # The moments and the spin for which a search over all bodies finds the largest acceleration, 1.2528 w^2 r.
    second, w = np.array([193607.808, 17.7305362, 8.19904193e-06]), np.array([-0.58375677, -0.56635941, 0.58177749])
    w /= np.linalg.norm(w)
    push = 2.0 * np.outer(w, w) * second[:, None] / (second[:, None] + second) - np.eye(3)
    left, sizes, right = np.linalg.svd(push)
    n, r, spin, height = -left[:, 0], right[0], 1000.0, 1e-9
    q = (1.0, 0.0, 0.0, 0.0)
    drop = (r @ n - height, 0.0)
    sweep = BodySweep(
        x=(0.0, 0.0, 0.0), v=tuple((-np.cross(spin * w, r)).tolist()), w=tuple((spin * w).tolist()), q=q, gravity=0.0,
        spin_bound=spin,
    )  # fmt: skip
    time = clear_for(r[None].copy(), 0, 1, 1.0, sweep, (tuple(n.tolist()), float(drop[0])))
    arrives = math.sqrt(2.0 * height / (sizes[0] * spin * spin))
    assert sizes[0] == pytest.approx(1.2528, abs=1e-4)
    assert 0.99 * arrives < time < arrives


def test_no_rigid_body_accelerates_a_corner_by_more_than_the_factor():
    # For a body without torque, acceleration = A r with A_ij = 2 w_i w_j s_i / (s_i + s_j) - delta_ij w^2, s_i the
    # integrals of x_i^2: the matrix of second moments times A is symmetric, because no torque acts.
    rng = np.random.default_rng(3)
    second, w = 10.0 ** rng.uniform(-6, 6, size=(50_000, 3)), rng.normal(size=(50_000, 3))
    w /= np.linalg.norm(w, axis=1)[:, None]
    share = second[:, :, None] / (second[:, :, None] + second[:, None])
    push = 2.0 * w[:, :, None] * w[:, None] * share - np.eye(3)
    largest = np.linalg.norm(push, 2, axis=(1, 2)).max()
    assert 0.97 * TURNING < largest < TURNING


# --- the time is long enough to be of use -----------------------------------------------------------------------------


@loop
def searched(corners, moments, state, planes, most, arms, found):
    """Advance each body by clear times until it is 1e-9 m from the plane.

    Columns of `found`: time (s), number of evaluations, height (m). most : time (s) of the end of the search
    """
    for k in range(len(found)):
        s, p, m = state[k], planes[k], moments[k]
        spin, q = (s[6], s[7], s[8]), (s[9], s[10], s[11], s[12])
        turning = turning_of((m[0], m[1], m[2]), q, spin)
        bound = spin_bound(turning)
        set_arms(arms, corners[k], 0, corners.shape[1], 1.0)
        t, height, count = 0.0, math.inf, 0
        while t < most and height > 1e-9 and count < 1000:
            at, w = turned_for(turning, t)
            height = math.inf
            for i in range(corners.shape[1]):
                r = turned(at, (corners[k, i, 0], corners[k, i, 1], corners[k, i, 2]))
                x, y = s[0] + s[3] * t + r[0], s[1] + s[4] * t + r[1]
                z = s[2] + s[5] * t - 0.5 * 9.81 * t * t + r[2]
                height = min(height, p[0] * x + p[1] * y + p[2] * z - p[3])
            sweep = BodySweep(
                x=(s[0] + s[3] * t, s[1] + s[4] * t, s[2] + s[5] * t - 0.5 * 9.81 * t * t),
                v=(s[3], s[4], s[5] - 9.81 * t), w=turned(at, w), q=at, gravity=9.81, spin_bound=bound,
            )  # fmt: skip
            t += clear_time(arms, corners.shape[1], sweep, ((p[0], p[1], p[2]), p[3]), most)
            count += 1
        found[k, 0], found[k, 1], found[k, 2] = t, count, height


def test_a_falling_body_reaches_the_plane_after_about_ten_evaluations():
    rng = np.random.default_rng(4)
    bodies = random_bodies(4, 2000, 40)
    bodies.corners[:] /= np.linalg.norm(bodies.corners, axis=2)[:, :, None]
    bodies.planes[:, :3] = (0.0, 0.6, 0.8)
    bodies.planes[:, 3] = -1.001 - rng.exponential(5.0, size=2000)
    found = np.zeros((2000, 3))
    searched(bodies.corners, bodies.moments, bodies.state, bodies.planes, 60.0, np.zeros((4, 40)), found)
    assert np.all(np.abs(found[:, 2]) <= 1e-9)
    assert found[:, 1].mean() < 8.0
    assert found[:, 1].max() <= 40


# --- the time asked about ---------------------------------------------------------------------------------------------


def test_a_time_is_the_same_however_much_longer_is_asked_about_and_infinite_beyond():
    bodies = random_bodies(5, 2000, CORNERS)
    times = clear_times(bodies)
    landing = np.isfinite(times)
    assert landing.mean() > 0.4
    for factor in (1.0 + 1e-6, 2.0, 1e3):
        assert np.array_equal(clear_times(bodies, asked=np.minimum(factor * times, LONG))[landing], times[landing])
    for factor in (1e-3, 0.5, 1.0 - 1e-6):
        found = clear_times(bodies, asked=np.minimum(factor * times, LONG))
        # The sphere around the body may be clear for longer than the corners are.
        assert np.all((found == math.inf) | (found == times))
        assert np.isinf(found[landing]).mean() > 0.5


# --- closed forms -----------------------------------------------------------------------------------------------------

LEVEL = (0.0, 0.0, 1.0)
BRICK = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.4, 0.4) for z in (-0.25, 0.25)])


def not_spinning(x=(0.0, 0.0, 0.0), v=(0.0, 0.0, 0.0), gravity=G) -> BodySweep:
    return BodySweep(x=x, v=v, w=(0.0, 0.0, 0.0), q=(1.0, 0.0, 0.0, 0.0), gravity=gravity, spin_bound=0.0)


@pytest.mark.parametrize("up", [-30.0, -1e-3, 0.0, 1e-3, 30.0])
@pytest.mark.parametrize("height", [1e-9, 1e-3, 1.0, 500.0])
def test_a_body_without_spin_is_clear_until_it_lands_on_a_level_plane(up, height):
    sweep = not_spinning(x=(3.0, 4.0, 0.25 + height), v=(5.0, 6.0, up))
    with mp.workdps(50):
        h = mpf(0.25 + height) - mpf(0.25)
        exact = (mpf(up) + mp.sqrt(mpf(up) ** 2 + 2 * mpf(G) * h)) / mpf(G)
    assert clear_for(BRICK, 0, 8, 1.0, sweep, (LEVEL, 0.0)) == pytest.approx(float(exact), rel=4e-15)


def test_a_body_that_touches_or_crosses_the_plane_has_no_clear_time():
    for height in (0.25, 0.2, -1.0):
        assert clear_for(BRICK, 0, 8, 1.0, not_spinning(x=(0.0, 0.0, height)), (LEVEL, 0.0)) == 0.0


def test_a_body_that_nothing_brings_to_the_plane_is_clear_for_ever():
    under_a_roof = (0.0, 0.0, -1.0), -2.0  # the plane z = 2, seen from below
    assert clear_for(BRICK, 0, 8, 1.0, not_spinning(), under_a_roof) == math.inf
    assert clear_for(BRICK, 0, 8, 1.0, not_spinning(v=(0.0, 0.0, 5.8)), under_a_roof) == math.inf
    assert clear_for(BRICK, 0, 8, 1.0, not_spinning(gravity=0.0), (LEVEL, -1.0)) == math.inf
    # The body rises 1.75 m from 6 m/s before it falls again: 6 t - 9.81 t^2 / 2 = 1.75
    hits = (6.0 - math.sqrt(36.0 - 2.0 * G * 1.75)) / G
    assert clear_for(BRICK, 0, 8, 1.0, not_spinning(v=(0.0, 0.0, 6.0)), under_a_roof) == pytest.approx(hits, rel=1e-14)


def test_a_fast_spin_far_from_the_plane_does_not_shorten_the_fall_of_the_sphere_around_the_body():
    sweep = not_spinning(x=(0.0, 0.0, 100.0))._replace(w=(0.0, 0.0, 500.0), spin_bound=500.0)
    radius = math.sqrt(0.5**2 + 0.4**2 + 0.25**2)
    fall = math.sqrt(2.0 * (100.0 - radius) / G)
    assert clear_for(BRICK, 0, 8, 1.0, sweep, (LEVEL, 0.0)) == pytest.approx(fall, rel=1e-14)


def test_a_body_has_the_size_and_the_rows_that_are_given():
    rows = np.vstack([90.0 * BRICK, BRICK, 80.0 * BRICK])
    sweep = not_spinning(x=(0.0, 0.0, 2.0))
    assert clear_for(rows, 8, 16, 4.0, sweep, (LEVEL, 0.0)) == pytest.approx(math.sqrt(2.0 / G), rel=1e-15)


def test_a_root_is_exact_for_all_sizes_of_its_terms():
    rng = np.random.default_rng(6)
    with mp.workdps(50):
        for _ in range(2000):
            h, fall = (float(10.0 ** rng.uniform(-12, 3)) for _ in range(2))
            rate = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-9, 3))
            root = mp.sqrt(mpf(rate) ** 2 + 2 * mpf(fall) * mpf(h))
            assert reach_time(h, rate, fall) == pytest.approx(float((rate + root) / fall), rel=2e-15)
            if rate * rate > 4.0 * fall * h:  # opened upwards: reached at falling height, or not at all
                upwards = (-rate - mp.sqrt(mpf(rate) ** 2 - 2 * mpf(fall) * mpf(h))) / fall
                expected = float(upwards) if rate < 0.0 else math.inf
                assert reach_time(h, rate, -fall) == pytest.approx(expected, rel=2e-15)
    assert reach_time(1.0, 0.0, 0.0) == math.inf
    assert reach_time(1.0, -2.0, 0.0) == 0.5
    assert reach_time(1.0, -1.0, -1.0) == math.inf


def test_both_engines_find_the_same_bits():
    for seed, corners in ((7, CORNERS), (8, 1)):
        bodies = random_bodies(seed, 300, corners)
        assert np.array_equal(clear_times(bodies), clear_times(bodies, times_of.py_func))
