"""Tests of a sphere's impacts with a rolling moment: by hand, by search over admissible impulses, and their limit."""

import dataclasses
import math
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from flights.rolling_spheres import roll, spheres
from flights.scenes_of_facets import ENGINES, engine_over, floor, grid_triangles, same_bits, terrain_of
from flights.struck_spheres import FULL, UP, struck

from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.kinetics.coulomb_sphere import CoulombSphere
from rpf3d_core.kinetics.sphere_ground import rolling_piece
from rpf3d_core.materials.distributions import fixed, uniform_between
from rpf3d_core.materials.draws import DrawnSurface, drawn_materials
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import ZERO, Outcome

G, RADIUS, MASS = 9.81, 0.5, 700.0
INERTIA = 0.4 * MASS * RADIUS**2
"""Moment of inertia (kg m2) of a solid sphere."""
BOTH = pytest.mark.parametrize("engine", ENGINES)


# --- by hand ----------------------------------------------------------------------------------------------------------

BY_HAND = [
    # Speeds (m/s) along x before and after: u of the centre, s = R w of the spin. With e = 0 and v_n = 1, P is 1 m/s.
    pytest.param(7.0, 7.0, FULL, 0.7, 6.5, 6.5, id="rolls on: 7 - 5/7 0.7"),
    pytest.param(7.0, 0.0, FULL, 0.7, 4.5, 4.5, id="sticks and rolls: 5/7 7 - 5/7 0.7"),
    pytest.param(0.2, 0.5, FULL, 0.5, 0.0, 0.0, id="sticks and is arrested: 0.2 + 2/5 0.5 is less than 0.5"),
    pytest.param(2.0, 0.5, 0.3, 0.6, 1.7, 0.0, id="slips and is arrested: |-0.3 - 0.2| is less than 0.6"),
    pytest.param(7.0, 1.0, 0.4, 0.1, 6.6, 1.75, id="slips and rolls: 1 + 5/2 (0.4 - 0.1)"),
    pytest.param(1.0, 9.0, 0.4, 0.1, 1.4, 7.75, id="slips and rolls, ahead of its way: 9 - 5/2 (0.4 + 0.1)"),
    pytest.param(3.0, -1.0, 0.1, 0.2, 2.9, -0.25, id="slips and rolls against its way: -1 + 5/2 (0.1 + 0.2)"),
    pytest.param(3.0, 1.0, 0.0, 0.2, 3.0, 0.5, id="without friction the spin alone is braked: 1 - 5/2 0.2"),
]


@pytest.mark.parametrize(("u", "s", "mu", "mu_r", "u_after", "s_after"), BY_HAND)
def test_each_state_of_an_impact_is_that_worked_out_by_hand(u, s, mu, mu_r, u_after, s_after):
    v, w = struck((u, 0.0, -1.0), (0.0, s / RADIUS, 0.0), 0.0, mu, RADIUS, mu_r=mu_r)
    assert v == pytest.approx((u_after, 0.0, 0.0), abs=1e-14)
    assert w == pytest.approx((0.0, s_after / RADIUS, 0.0), abs=1e-14)


def exact_on_a_line(u, s, k, r):
    """Return u and s after an impact as fractions, for motion along one line.

    Each combination of slipping, sticking and rolling is tried; exactly one is consistent.
    """
    found = set()
    for slip, spin in product((-1, 0, 1), repeat=2):
        p = Fraction(-slip) * k if slip else None
        m = Fraction(-spin) * r if spin else None
        if p is None and m is None:
            p, m = -u, -u - s * Fraction(2, 5)
        elif p is None:
            p = (-2 * (u - s) + 5 * m) / 7
        elif m is None:
            m = p - s * Fraction(2, 5)
        u_after, s_after = u + p, s + Fraction(5, 2) * (m - p)
        opposes = (u_after - s_after) * slip > 0 or (slip == 0 and abs(p) <= k)
        if opposes and (s_after * spin > 0 or (spin == 0 and abs(m) <= r)):
            found.add((u_after, s_after))
    (only,) = found
    return only


def test_along_a_line_impacts_are_those_of_the_complementarity_problem_in_fractions():
    rng, states = np.random.default_rng(8), 0
    for _ in range(1500):
        u, s, k, r = (Fraction(int(number), 64) for number in rng.integers((-640, -640, 0, 1), (641, 641, 320, 320)))
        u_after, s_after = exact_on_a_line(u, s, k, r)
        states += s_after != 0
        v, w = struck((float(u), 0.0, -1.0), (0.0, float(s) / RADIUS, 0.0), 0.0, float(k), RADIUS, mu_r=float(r))
        assert (v[0], RADIUS * w[1]) == pytest.approx((float(u_after), float(s_after)), abs=1e-13)
    assert 400 < states < 1400, "arrested and rolling are both among them"


# --- by brute force ---------------------------------------------------------------------------------------------------


def impulses_on_discs(rings, spokes):
    """Return points (N, 2) all over the unit disc, including its border."""
    size, angle = np.meshgrid(np.linspace(0.0, 1.0, rings), np.arange(spokes) * 2.0 * np.pi / spokes)
    return np.stack([size * np.cos(angle), size * np.sin(angle)], -1).reshape(-1, 2)


def kinetic(v, w):
    """Return the kinetic energy (J) of velocities (..., 3) m/s and spins (..., 3) rad/s."""
    return 0.5 * MASS * (v * v).sum(-1) + 0.5 * INERTIA * (w * w).sum(-1)


def least_energy(v, w, n, e, mu, mu_r):
    """Return the least kinetic energy (J) after an impact, and the velocity (3,) m/s and spin (3,) rad/s with it.

    It is searched on a grid of impulses and moments that is refined five times around the best point.
    """
    aside = np.cross(n, (0.3, -0.5, 0.81))
    aside /= np.linalg.norm(aside)
    axes = np.stack([aside, np.cross(n, aside)])
    P = (1.0 + e) * -MASS * (v @ n)
    disc = impulses_on_discs(9, 24)
    centres, width = np.zeros((2, 2)), 1.0
    for _ in range(6):
        pushes, moments = (centre + width * disc for centre in centres)
        pushes, moments = (x / np.maximum(np.linalg.norm(x, axis=1), 1.0)[:, None] for x in (pushes, moments))
        J, M = mu * P * pushes @ axes, mu_r * RADIUS * P * moments @ axes
        after = v + (P * n + J[:, None, :]) / MASS
        turned = w + (np.cross(-RADIUS * n, J)[:, None, :] + M[None, :, :]) / INERTIA
        energy = kinetic(after, turned)
        i, j = np.unravel_index(np.argmin(energy), energy.shape)
        centres, width = np.stack([pushes[i], moments[j]]), 0.35 * width
    return energy[i, j], after[i, 0], turned[i, j]


@pytest.mark.parametrize("seed", range(40))
def test_no_admissible_impulse_and_moment_dissipate_more(seed):
    """The search is in three dimensions, over the discs of admissible friction and moment."""
    rng = np.random.default_rng(seed)
    n = rng.normal(size=3)
    n /= np.linalg.norm(n)
    v, w = rng.normal(size=3) * 5.0, rng.normal(size=3) * rng.choice([1.0, 10.0, 30.0])
    v -= (v @ n + abs(v @ n)) * n
    e, mu, mu_r = rng.uniform(0.0, 0.9), rng.uniform(0.02, 1.2), rng.uniform(0.02, 1.2)
    after, spin = struck(v, w, e, mu, RADIUS, mu_r=mu_r, n=tuple(n.tolist()))
    left = kinetic(after, spin)
    J = MASS * (after - v)
    P = J @ n
    J -= P * n
    M = INERTIA * (spin - w) - np.cross(-RADIUS * n, J)
    assert np.linalg.norm(J) <= mu * P * (1.0 + 1e-12), "friction is within its cone"
    assert np.linalg.norm(M) <= mu_r * RADIUS * P * (1.0 + 1e-12) and abs(M @ n) < 1e-9 * P
    least, v_least, w_least = least_energy(v, w, n, e, mu, mu_r)
    assert left <= least + 1e-9 * kinetic(v, w)
    assert least - left < 2e-4 * kinetic(v, w), "the grid comes near"
    near = 0.03 * (np.linalg.norm(v) + RADIUS * np.linalg.norm(w))
    assert np.linalg.norm(after - v_least) < near and RADIUS * np.linalg.norm(spin - w_least) < near


def test_as_the_rolling_friction_fades_impacts_become_those_without():
    rng = np.random.default_rng(3)
    for e_t in (0.0, 0.4):
        v, w = rng.normal(size=3) - np.array([0.0, 0.0, 4.0]), 9.0 * rng.normal(size=3)
        for mu in (0.05, 0.6):
            ends = [struck(v, w, 0.4, mu, RADIUS, e_t, mu_r) for mu_r in (0.0, 1e-12)]
            assert np.allclose(*ends, atol=1e-10)


# --- many impacts, and the ground -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("mu", "mu_r"), [(0.6, 0.3), (0.6, 0.05), (0.2, 0.3), (0.2, 2.0)])
@pytest.mark.parametrize("slope", [0.0, 10.0])
def test_many_small_impacts_brake_a_rolling_sphere_as_the_ground_does(mu, mu_r, slope):
    """Impacts of g_n dt for 0.2 s give Azzoni's 5/7 (g_t - mu_r g_n), or g_t - mu g_n if friction is exceeded."""
    g_t, g_n, impacts = G * math.sin(math.radians(slope)), G * math.cos(math.radians(slope)), 2000
    dt, v, w = 0.2 / impacts, np.array([5.0, 0.0, 0.0]), np.array([0.0, 5.0 / RADIUS, 0.0])
    for _ in range(impacts):
        v, w = struck((v[0] + g_t * dt, 0.0, -g_n * dt), w, 0.0, mu, RADIUS, mu_r=mu_r)
    expected = max(5.0 / 7.0 * (g_t - mu_r * g_n), g_t - mu * g_n)
    assert (v[0] - 5.0) / 0.2 == pytest.approx(expected, rel=1e-9, abs=1e-9)
    piece = rolling_piece((5.0, 0.0, 0.0), ZERO, UP, (g_t, 0.0, 0.0), g_n, Surface(0.3, 1.0, mu, 0.0, mu_r), RADIUS)
    assert piece.a[0] == pytest.approx(expected, rel=1e-12)


def rough_slope(cell=2.0, length=150.0, width=60.0):
    """Return a slope of 32 degrees over 60 m, then a level floor, both in 2 m cells with random heights +-0.25 m."""
    x, y = np.meshgrid(np.arange(0.0, length + cell, cell), np.arange(0.0, width + cell, cell), indexing="ij")
    z = 0.25 * np.random.default_rng(5).uniform(-1, 1, x.shape) - math.tan(math.radians(32.0)) * np.minimum(x, 60.0)
    return terrain_of(np.stack([x, y, z], -1).reshape(-1, 3), grid_triangles(*x.shape))


def test_the_mean_runout_does_not_depend_on_the_smallest_bounce():
    """The test flies 1,000 spheres; the impacts per rock grow from 32 to 101.

    Bounces that are left out lose their energy. At the seams of this slope some bounces rise 1 to 10 mm, so the
    largest height shortens the mean runout by 1 %. The effect of the other heights is within the noise.
    """
    over, rocks = engine_over("compiled", rough_slope()), 1000
    runouts = []
    for k, height in enumerate((1e-2, 1e-3, 1e-4, 1e-5)):
        rng = np.random.default_rng(k)
        x = np.stack([rng.uniform(4, 8, rocks), rng.uniform(25, 35, rocks), np.full(rocks, 3.0)], 1)
        physics = spheres(Surface(0.3, 1.0, 0.7, 0.5, 0.4), smallest_bounce=height)
        ends = roll(over, physics, 0.5, x, (2.0, 0.0, 0.0)).deposits
        assert np.mean(ends.outcome == Outcome.STOPPED) > 0.99
        runouts.append(np.linalg.norm((ends.x - x)[:, :2], axis=1))
    means = np.array([way.mean() for way in runouts])
    errors = np.array([way.std() / math.sqrt(rocks) for way in runouts])
    assert (errors / means).max() < 0.002, "the means are known to 0.2 %"
    assert np.ptp(means[1:]) < 4.0 * math.sqrt(2.0) * errors.max()
    assert 0.985 * means[1:].min() < means[0] < means[1:].max()


# --- ground that is drawn, and zones ----------------------------------------------------------------------------------


def two_floors():
    """Return a level floor of two zones: 0 (left) for x < 0, 1 (right) for x > 0."""
    ticks = (-40.0, 0.0, 40.0)
    vertices = [(x, y, 0.0) for x in ticks for y in (-40.0, 40.0)]
    return terrain_of(vertices, grid_triangles(3, 2), (0, 1, 0, 1), ("left", "right"))


def dropped(engine, grounds, rocks, **settings):
    """Fly spheres that fall onto the two zones alternately, with 7 m/s along y, and do not slip at impacts."""
    physics = spheres(Surface(0.5, 1.0, 0.5, 0.5), CoulombSphere(FULL, 0.0), max_impacts=2, **settings)
    physics = dataclasses.replace(physics, materials=drawn_materials(grounds))
    x = np.array([[-20.0 if rock % 2 == 0 else 20.0, -30.0, 3.0] for rock in range(rocks)])
    numbers, ones = np.arange(rocks), np.ones(rocks)
    v = np.tile([0.0, 7.0, 0.0], (rocks, 1))
    releases = Releases(0 * numbers, numbers, x, v, ones, 0.5 * ones)
    return fly_ensemble(engine_over(engine, two_floors()), physics, releases)


def rolling_frictions(flights):
    """Return the rolling friction mu_r (R, 2) of the two impacts of each rock, computed from the speeds.

    u' = 5/7 u + 2/7 s - 5/7 mu_r P, and u = s after the first impact.
    """
    impacts, into = flights.impacts, np.array([1.0, 0.5]) * math.sqrt(2.0 * G * 2.5)
    after = np.sqrt(impacts.speed_out.reshape(-1, 2) ** 2 - (0.5 * into) ** 2)
    before = np.stack([np.full(len(after), 5.0), after[:, 0]], 1)
    return 7.0 / 5.0 * (before - after) / (1.5 * into)


def ground(rolling_friction, per_impact=False):
    return DrawnSurface(fixed(0.5), fixed(1.0), fixed(30.0), 0.5, per_impact, rolling_friction)


@BOTH
def test_each_zone_has_its_own_rolling_friction_at_impacts(engine):
    mu_r = rolling_frictions(dropped(engine, [ground(fixed(0.1)), ground(fixed(0.3))], 4))
    assert mu_r == pytest.approx(np.array([[0.1, 0.1], [0.3, 0.3]] * 2), abs=1e-8)


@pytest.mark.long
def test_rolling_friction_at_impacts_may_be_drawn_for_each_rock_or_each_impact():
    rocks, drawn = 400, uniform_between(0.1, 0.3)
    flights = {
        (engine, each): dropped(engine, [ground(drawn, each), ground(fixed(0.2))], rocks)
        for engine in ENGINES
        for each in (False, True)
    }
    for each in (False, True):
        assert same_bits(*(flights[engine, each] for engine in ENGINES))
        mu_r = rolling_frictions(flights["reference", each])
        assert mu_r[1::2] == pytest.approx(0.2, abs=1e-8), "the other zone is certain"
        left = mu_r[::2]
        assert 0.1 <= left.min() < 0.103 and 0.297 < left.max() <= 0.3
        assert left.mean() == pytest.approx(0.2, abs=6.0 * 0.2 / math.sqrt(12.0 * len(left)))
        assert (np.abs(left[:, 0] - left[:, 1]).max() < 1e-8) != each
        assert abs(np.corrcoef(left.T)[0, 1]) < 0.4 or not each


@BOTH
def test_a_sphere_without_rolling_friction_keeps_what_sticking_leaves_it(engine):
    physics = spheres(Surface(0.5, 1.0, 0.5, 0.5), CoulombSphere(FULL, 0.0), max_impacts=3)
    impacts = roll(engine_over(engine, floor(60.0)), physics, 0.5, (-40.0, 0.3, 3.0), (7.0, 0.0, 0.0)).impacts
    rises = 0.25 ** np.arange(1, 4) * 2.0 * G * 2.5
    assert np.sqrt(impacts.speed_out**2 - rises) == pytest.approx(5.0, rel=1e-12)
