"""Tests of the sphere of CRSP (Pfeiffer & Bowen 1989): worked examples, and three dimensions."""

import math

import numpy as np
import pytest
from flights.rebounds_named import MODELS, UP, energy, falling_rock, flight_with, struck
from flights.scenes_of_facets import engine_over, fly, incline, surface

from rpf3d_core.kinetics.rebound import rest_of_bounces
from rpf3d_core.kinetics.rebounds.pfeiffer_bowen import PfeifferBowen, friction, scaling
from rpf3d_core.values import ZERO, Motion, Outcome

CRSP = MODELS["pfeiffer_bowen"]
PRINTED = 5.1e-5
"""Half a unit of the fourth decimal, the last that the reference prints; w' has three decimals."""

# vn, vt, w, R, m, Rn, Rt | f, F, vn', vt', w', E'/E; None for values that the reference does not print
VECTORS = [
    (10, 15, 0, 0.5, 1000, 0.5, 0.8, 0.8276, 0.7484, 2.2769, 9.9772, 19.954, 0.4448),
    (10, 15, 20, 0.5, 1000, 0.5, 0.8, 0.9068, 0.7484, 2.2769, 11.3342, 22.668, 0.5069),
    (5, 5, 10, 0.3, 300, 0.35, 0.85, 0.9647, 0.8211, 1.3472, 4.0228, 13.409, 0.4565),
    (20, 10, 0, 0.5, 1000, 0.53, 0.99, 0.9926, 0.7950, 1.8327, 7.5077, None, 0.1645),
]
IDS = [f"physics-9.2-vn{row[0]}-vt{row[1]}-w{row[2]}" for row in VECTORS]


@pytest.mark.parametrize("row", VECTORS, ids=IDS)
def test_the_impact_is_that_of_the_worked_values(row):
    vn, vt, w, R, m, Rn, Rt, f, F, vn_after, vt_after, w_after, ratio = row
    before = Motion(0.0, ZERO, (float(vt), 0.0, -float(vn)), (0.0, float(w), 0.0))
    after = struck(CRSP, surface(Rn, Rt), before.v, before.w, rock=falling_rock(m, R))
    assert friction(Rt, abs(vt - w * R) / CRSP.A) == pytest.approx(f, abs=PRINTED)
    assert scaling(Rn, Rt, float(vn), CRSP.B) == pytest.approx(F, abs=PRINTED)
    assert after.v == pytest.approx((vt_after, 0.0, vn_after), abs=PRINTED)
    if w_after is not None:
        assert after.w == pytest.approx((0.0, w_after, 0.0), abs=10 * PRINTED)
    assert energy(after, R) / energy(before, R) == pytest.approx(ratio, abs=PRINTED)


def turn(seed: int) -> np.ndarray:
    """Return a random rotation matrix (3, 3)."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


@pytest.mark.parametrize("seed", range(5))
def test_the_impact_is_the_same_however_the_axes_lie(seed):
    q, v, w = turn(seed), np.array([4.0, 3.0, -6.0]), np.array([5.0, -7.0, 9.0])
    here = struck(CRSP, surface(), tuple(v), tuple(w))
    there = struck(CRSP, surface(), tuple((q @ v).tolist()), tuple((q @ w).tolist()), tuple(q[:, 2].tolist()))
    np.testing.assert_allclose(there.v, q @ here.v, atol=1e-13)
    np.testing.assert_allclose(there.w, q @ here.w, atol=1e-12)


def test_the_rock_leaves_rolling_where_it_went_and_keeps_its_spin_about_the_normal():
    after = struck(CRSP, surface(), (3.0, 4.0, -5.0), (11.0, -2.0, 6.0))
    assert after.v[0] / after.v[1] == pytest.approx(3.0 / 4.0, rel=1e-14)
    lowest = np.array(after.v) + np.cross(after.w, (0.0, 0.0, -0.5))
    np.testing.assert_allclose(lowest[:2], 0.0, atol=1e-14)
    assert after.w[2] == 6.0


def test_a_rock_that_falls_straight_is_sent_off_by_its_spin_and_without_spin_by_nothing():
    rolled = struck(CRSP, surface(), (0.0, 0.0, -5.0), (0.0, 8.0, 0.0))
    assert rolled.v[0] > 0.0 and rolled.v[1] == 0.0
    still = struck(CRSP, surface(), (0.0, 0.0, -5.0), (0.0, 0.0, 3.0))
    assert still.v[:2] == (0.0, 0.0) and still.w == (0.0, 0.0, 3.0)


def test_the_scaling_factor_has_its_limit_where_r_n_is_zero():
    assert scaling(0.0, 0.8, 3.0, 76.2) == 0.0
    assert scaling(1e-9, 0.8, 3.0, 76.2) == pytest.approx(0.0, abs=1e-14)
    assert scaling(0.0, 0.8, 0.0, 76.2) == 0.8


def test_the_three_speeds_are_the_users():
    slow = struck(PfeifferBowen(1.0, 6.096, 76.2), surface(), (15.0, 0.0, -10.0))
    assert slow.v[2] == pytest.approx(0.5 * 10.0 / 101.0, rel=1e-14)


# --- the rest of the bouncing -----------------------------------------------------------------------------------------


def bounced_out(model, ground, motion, angle, bounces=4000):
    """Return the displacement (m) downhill and the time (s) of single bounces on a plane of `angle` degrees along x."""
    a = math.radians(angle)
    g = 9.81 * np.array([math.sin(a), 0.0, -math.cos(a)])
    s = t = 0.0
    for _ in range(bounces):
        T = 2.0 * motion.v[2] / -g[2]
        s, t = s + motion.v[0] * T + 0.5 * g[0] * T * T, t + T
        motion = struck(model, ground, (motion.v[0] + g[0] * T, 0.0, motion.v[2] + g[2] * T), motion.w)
    return s, t


@pytest.mark.parametrize("rise", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize(("R_n", "R_t"), [(0.35, 0.85), (0.5, 0.8), (0.8, 0.5)])
@pytest.mark.parametrize("angle", [0.0, 20.0, 35.0])
def test_the_rest_of_the_bouncing_is_that_of_bounces_one_by_one_within_the_stated_error(rise, R_n, R_t, angle):
    """The bounds are those of the docstring: shares of the sums, and 8 h tan(slope) r q / ((1 - r q)(1 - r^2))."""
    a, ground = math.radians(angle), surface(R_n, R_t)
    w = math.sqrt(2.0 * 9.81 * math.cos(a) * rise)
    motion = Motion(0.0, ZERO, (0.4, 0.0, w), (0.0, 0.8, 0.0))
    s, t = bounced_out(CRSP, ground, motion, angle)
    down = (math.sin(a), 0.0, math.cos(a))
    ahead = (math.cos(a), 0.0, -math.sin(a))
    v = tuple(float(c) for c in 0.4 * np.array(ahead) + w * np.array(down))
    rest = rest_of_bounces(CRSP, ground, Motion(0.0, ZERO, v, (0.0, 0.8, 0.0)), down, 9.81, falling_rock())
    q = math.sqrt(R_t * friction(R_t, 0.0))
    share = (w / CRSP.K) ** 2 / (1.0 - R_n)
    slip = 8.0 * rise * (math.tan(a) / CRSP.A) ** 2 * 9.81 / (1.0 - q)
    extra = 8.0 * rise * math.tan(a) * R_n * q / ((1.0 - R_n * q) * (1.0 - R_n * R_n))
    told = float(np.dot(np.add(rest.along, rest.down), ahead))
    assert rest.ends
    assert rest.t == pytest.approx(t, rel=share + 1e-9)
    assert -(share + slip + (w / (CRSP.B * R_n)) ** 2) * s - 1e-9 <= told - s <= extra + (share + slip) * s


def test_a_smallest_bounce_of_half_the_height_moves_the_stop_by_less_than_the_stated_error():
    over = engine_over("reference", incline(20.0, down=200.0))
    ends = [
        fly(over, flight_with(CRSP, surface(), smallest_bounce=h), (0.5, 0.2, 3.0)).deposits for h in (1e-3, 5e-4, 1e-5)
    ]
    assert {int(end.outcome[0]) for end in ends} == {Outcome.STOPPED}
    gaps = [float(np.linalg.norm(end.x[0] - ends[-1].x[0])) for end in ends[:2]]
    # r = 0.5, q = 0.88: gravity adds 8 h tan(20) 0.44 / (0.56 x 0.75) = 3.1 h; the speed along the slope, at most
    # 3 m/s, adds at most 5e-4 m.
    assert 0.0 < gaps[0] < 3.1e-3 + 5e-4
    assert float(np.linalg.norm(ends[0].x[0] - ends[1].x[0])) < 3.1e-3 + 5e-4


def test_the_normal_it_is_given_need_not_be_the_grounds():
    tilted = (math.sin(0.2), 0.0, math.cos(0.2))
    assert struck(CRSP, surface(), (3.0, 0.0, -5.0), n=tilted).v != struck(CRSP, surface(), (3.0, 0.0, -5.0), n=UP).v
