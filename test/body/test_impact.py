"""Tests of impacts of rigid bodies: closed forms, laws of contact and energy for random contacts, equal engines."""

import math
from itertools import permutations

import numpy as np
import pytest
from bodies.bodies_in_contact import (
    AFTER,
    AFTER_V,
    AFTER_W,
    BEFORE,
    LEFT,
    Bodies,
    Ground,
    boxes_on_faces,
    hold,
    random_contacts,
    results_of,
    stop,
    strike,
    without_contacts,
)

from rpf3d_core.body.contacts import ARM, GOAL, IMPULSE, MU, NORMAL, RESTITUTION

MOST_LEFT = {
    (1, 5.0, 0.0, 0.0): 0.0, (1, 5.0, 1.0, 0.3): 0.0, (2, 1.0, 0.3, 0.0): 3e-4, (3, 5.0, 1.0, 0.0): 0.005,
    (4, 0.5, 0.0, 0.3): 0.008, (4, 5.0, 0.3, 0.3): 0.007, (6, 1.0, 0.0, 0.0): 0.04, (6, 5.0, 0.3, 0.0): 0.025,
    (6, 5.0, 1.0, 0.3): 0.02, (6, 0.0, 1.0, 0.0): 0.007,
}  # fmt: skip
"""Largest share of impacts after which a contact still approaches, for each number of contacts, mu, e and rolling.

Such a body is wedged between contacts whose normals are nearly opposite, where single impacts lose little energy.
"""
SETS = [
    pytest.param(most, Ground(mu, e, rolling), id=f"{most} contacts, mu to {mu:g}, e {e:g}, rolling to {rolling:g}")
    for most, mu, e, rolling in MOST_LEFT
]
MANY = 20_000
TURNS = 1e-7
"""Largest speed and spin, over the speed of the fall, that remain if the sweeps converge slowly (long plates)."""


def speeds(bodies: Bodies) -> np.ndarray:
    """Return the speed (N,) m/s of the centre plus that of the spin at the radius of gyration."""
    radii = np.linalg.norm(np.sqrt(bodies.moments), axis=1)
    return np.linalg.norm(bodies.motion[:, :3], axis=1) + radii * np.linalg.norm(bodies.motion[:, 3:], axis=1)


# --- a rod ------------------------------------------------------------------------------------------------------------

A, V = 0.7, 3.0
"""Half length (m) of the rod, and its speed of fall (m/s)."""
ANGLES = [math.radians(angle) for angle in (0.0, 10.0, 35.0, 60.0, 85.0, 90.0)]


def rod(angle: float, mu: float, e: float) -> Bodies:
    """Return a thin rod along its first axis that falls onto a plane with its lower end, `angle` (rad) to the plane."""
    moments = np.array([[1e-9 * A * A, A * A / 3.0, A * A / 3.0]])
    bodies = without_contacts(np.random.default_rng(1), 1, moments)
    n = np.array([math.sin(angle), 0.0, math.cos(angle)])
    row = bodies.points[0, 0]
    row[ARM : ARM + 3], row[NORMAL : NORMAL + 3] = (-A, 0.0, 0.0), n
    row[MU], row[RESTITUTION] = mu, e
    bodies.counts[0], bodies.motion[0] = 1, (*(-V * n), 0.0, 0.0, 0.0)
    return bodies


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_a_rod_without_friction_gets_the_impulse_of_the_closed_form(angle, e):
    found = results_of(rod(angle, 0.0, e), strike)[0][0]
    n = np.array([math.sin(angle), 0.0, math.cos(angle)])
    share = 1.0 + 3.0 * math.cos(angle) ** 2
    P, w = (1.0 + e) * V / share, 3.0 * (1.0 + e) * V * math.cos(angle) / (A * share)
    assert found[AFTER_V : AFTER_V + 3] == pytest.approx((P - V) * n, abs=1e-12)
    assert found[AFTER_W : AFTER_W + 3] == pytest.approx((0.0, w, 0.0), abs=1e-12)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("beyond", [1.001, 50.0])
def test_a_rod_that_sticks_turns_about_its_end(angle, beyond):
    c, s = math.cos(angle), math.sin(angle)
    least = 0.75 * s * c / (1.0 - 0.75 * c * c)
    found = results_of(rod(angle, beyond * least + 1e-9, 0.0), strike)[0][0]
    w = 3.0 * V * c / (4.0 * A)
    assert found[AFTER_W : AFTER_W + 3] == pytest.approx((0.0, w, 0.0), abs=1e-12)
    assert found[AFTER_V : AFTER_V + 3] == pytest.approx((0.0, 0.0, -A * w), abs=1e-12), "w x (A, 0, 0)"


@pytest.mark.parametrize("angle", [math.radians(angle) for angle in (10.0, 35.0, 60.0, 85.0)])
def test_a_rod_with_less_friction_than_sticking_needs_slides(angle):
    c, s = math.cos(angle), math.sin(angle)
    mu = 0.999 * 0.75 * s * c / (1.0 - 0.75 * c * c)
    found, points = results_of(rod(angle, mu, 0.0), stop)
    n, t = np.array([s, 0.0, c]), np.array([c, 0.0, -s])
    at = found[0, AFTER_V : AFTER_V + 3] + np.cross(found[0, AFTER_W : AFTER_W + 3], (-A, 0.0, 0.0))
    P = points[0, 0, IMPULSE : IMPULSE + 3]
    assert abs(at @ n) < 1e-12 * V and abs(at @ t) > 1e-5 * V
    assert P @ t == pytest.approx(-math.copysign(mu * (P @ n), at @ t), rel=1e-12)


# --- faces that land flat ---------------------------------------------------------------------------------------------


def fallen_flat(mu: float, e: float, order: tuple[int, ...]) -> Bodies:
    """Return 200 random boxes that fall flat onto a plane without spin; order : order of the four contacts."""
    bodies = boxes_on_faces(np.random.default_rng(7), 200, Ground(mu, e, 0.0))
    bodies.points[:, :, MU] = mu
    bodies.points[:, :4] = bodies.points[:, list(order)]
    bodies.motion[:, :3], bodies.motion[:, 3:] = -V * bodies.points[:, 0, NORMAL : NORMAL + 3], 0.0
    return bodies


@pytest.mark.parametrize("mu", [0.0, 0.5, 2.0])
def test_a_face_that_lands_flat_is_at_rest_at_once_in_any_order_of_its_corners(mu):
    for order in permutations(range(4)):
        found, _ = results_of(fallen_flat(mu, 0.0, order), strike)
        assert np.abs(found[:, AFTER_V : AFTER_W + 3]).max() < TURNS * V
        assert np.median(np.abs(found[:, AFTER_V : AFTER_W + 3]).max(axis=1)) < 1e-11 * V


@pytest.mark.parametrize("mu", [0.0, 0.5, 2.0])
def test_a_face_that_lands_flat_rebounds_with_the_share_e_of_its_speed_and_without_spin(mu):
    bodies = fallen_flat(mu, 0.4, (2, 0, 3, 1))
    found, _ = results_of(bodies, strike)
    assert np.abs(found[:, AFTER_V : AFTER_V + 3] + 0.4 * bodies.motion[:, :3]).max() < TURNS * V
    assert np.abs(found[:, AFTER_W : AFTER_W + 3]).max() < TURNS * V


def test_below_the_slow_speed_an_impact_has_no_restitution():
    bodies = fallen_flat(0.5, 0.9, (0, 1, 2, 3))
    assert np.abs(results_of(bodies, strike, 1.001 * V)[0][:, AFTER_V : AFTER_V + 3]).max() < TURNS * V
    fast = results_of(bodies, strike, 0.999 * V)[0][:, AFTER_V : AFTER_V + 3]
    assert np.linalg.norm(fast, axis=1) == pytest.approx(0.9 * V, rel=TURNS)


# --- random contacts --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("most", "ground"), SETS)
def test_no_impact_gains_energy(most, ground):
    bodies = random_contacts(np.random.default_rng(most), MANY, most, ground)
    found, _ = results_of(bodies, strike)
    assert (found[:, AFTER] <= found[:, BEFORE] * (1.0 + 1e-12)).all()
    assert (found[:, AFTER] < 0.99 * found[:, BEFORE]).mean() > 0.1, "impacts take energy"


@pytest.mark.parametrize(("most", "ground"), SETS)
def test_impulses_stay_in_their_cones(most, ground):
    bodies = random_contacts(np.random.default_rng(10 + most), MANY, most, ground)
    _, points = results_of(bodies, stop, 1e-11)
    impulse, n = points[:, :, IMPULSE : IMPULSE + 3], points[:, :, NORMAL : NORMAL + 3]
    P = np.einsum("nki,nki->nk", impulse, n)
    friction = np.linalg.norm(impulse - P[:, :, None] * n, axis=2)
    real = np.arange(P.shape[1]) < bodies.counts[:, None]
    size = speeds(bodies)[:, None]
    assert (-1e-12 * size <= P)[real].all()
    assert (friction <= points[:, :, MU] * P + 1e-12 * np.maximum(size, P))[real].all()


@pytest.mark.parametrize(("most", "ground"), SETS)
def test_few_impacts_leave_a_contact_that_approaches(most, ground):
    bodies = random_contacts(np.random.default_rng(20 + most), MANY, most, ground)
    found, _ = results_of(bodies, strike)
    left = -found[:, LEFT] / speeds(bodies)
    assert (left > 1.0001e-9).mean() <= MOST_LEFT[(most, *ground)]
    assert (left > 1e-3).mean() <= (0.005 if most > 2 else 3e-4 * (most - 1))


@pytest.mark.parametrize("tilt", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("ground", [Ground(1.0, 0.0, 0.0), Ground(2.0, 0.3, 0.2), Ground(5.0, 1.0, 0.0)])
def test_a_face_leaves_no_contact_that_approaches(tilt, ground):
    bodies = boxes_on_faces(np.random.default_rng(5), MANY, ground, tilt)
    found, _ = results_of(bodies, strike)
    left = -found[:, LEFT] / speeds(bodies)
    assert left.max() <= 1.0001e-9
    assert (found[:, AFTER] <= found[:, BEFORE] * (1.0 + 1e-12)).all()


WEDGED = [(4, 5.0), (4, 100.0), (6, 5.0), (6, 100.0), (8, 2.0), (8, 100.0)]
"""(Number of contacts, largest friction) for which the sweeps diverge for some random bodies."""


@pytest.mark.parametrize(("most", "mu"), WEDGED)
def test_sustained_contact_of_a_wedged_body_gains_no_energy(most, mu):
    bodies = random_contacts(np.random.default_rng(most), MANY, most, Ground(mu, 0.0, 0.0))
    found, _ = results_of(bodies, hold, 1e-6)
    assert (found[:, AFTER] <= found[:, BEFORE] * (1.0 + 1e-12)).all()
    assert (-found[:, LEFT] > 1e-2).mean() < 1e-3, "nearly all contacts are solved"
    if (most, mu) in ((4, 5.0), (4, 100.0), (6, 5.0)):
        alone = results_of(bodies, stop, 1e-6)[0]
        assert (alone[:, AFTER] / alone[:, BEFORE]).max() > 10.0, "the sweeps alone diverge"


@pytest.mark.parametrize(("most", "mu"), WEDGED)
def test_a_body_in_sustained_contact_gets_no_faster_than_four_times_the_fastest_goal_makes_it(most, mu):
    rng = np.random.default_rng(50 + most)
    bodies = random_contacts(rng, MANY, most, Ground(mu, 0.0, 0.3))
    bodies.motion[:] *= 0.01
    goals = 0.1 * rng.normal(size=(MANY, bodies.points.shape[1], 3))
    bodies.points[:, :, GOAL : GOAL + 3] = goals
    real = np.arange(goals.shape[1]) < bodies.counts[:, None]
    largest = (np.linalg.norm(goals, axis=2) * real).max(axis=1)
    found, _ = results_of(bodies, hold, 1e-6)
    gain = np.sqrt(2.0 * found[:, AFTER]) - np.sqrt(2.0 * found[:, BEFORE])
    assert (gain <= 4.0 * largest + 1e-12).all()
    assert gain.max() > 0.0, "goals may make a body faster"


def test_a_body_that_moves_away_keeps_its_velocity():
    bodies = random_contacts(np.random.default_rng(3), 2000, 1, Ground(2.0, 0.5, 0.3))
    r, n = bodies.points[:, 0, ARM : ARM + 3], bodies.points[:, 0, NORMAL : NORMAL + 3]
    speed = np.einsum("ni,ni->n", bodies.motion[:, :3] + np.cross(bodies.motion[:, 3:], r), n)
    found, _ = results_of(bodies, strike)
    same = (found[:, :6] == bodies.motion).all(axis=1)
    assert np.array_equal(same, speed >= 0.0)


def test_a_mirrored_body_has_the_mirrored_impact():
    """In up to 1 % the order of tangents decides between several solutions, or the sweeps end early."""
    bodies = random_contacts(np.random.default_rng(4), 2000, 3, Ground(1.0, 0.3, 0.0))
    mirrored = bodies.part(slice(None))
    mirrored.points[:, :, [ARM, NORMAL]] *= -1.0
    mirrored.motion[:, [0, 4, 5]] *= -1.0  # spin is an axial vector
    found, other = results_of(bodies, strike)[0], results_of(mirrored, strike)[0]
    other[:, [AFTER_V, AFTER_W + 1, AFTER_W + 2]] *= -1.0
    assert (np.abs(found[:, :6] - other[:, :6]).max(axis=1) > 1e-8 * speeds(bodies)).mean() < 0.01


@pytest.mark.parametrize(
    ("most", "ground"), [(1, Ground(5.0, 1.0, 0.3)), (6, Ground(1.0, 0.0, 0.0)), (6, Ground(5.0, 0.3, 0.3))]
)
def test_both_engines_find_the_same_bits(most, ground):
    bodies = random_contacts(np.random.default_rng(30), 2000 if most == 1 else 500, most, ground)
    for solve in (strike, stop):
        found, points = results_of(bodies, solve, 1e-3)
        plain, plain_points = results_of(bodies, solve.py_func, 1e-3)
        assert np.array_equal(found, plain)
        assert np.array_equal(points, plain_points)
