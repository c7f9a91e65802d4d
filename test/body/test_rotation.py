"""Tests of torque-free rotation: Taylor steps with 40 digits, closed forms, and conserved quantities."""

import math

import numpy as np
import pytest
from bodies.turning_bodies import angle_between, by_taylor, in_space, real_bodies, turn_all, turned

from rpf3d_core.body.quaternions import multiply, turn_by, turned_back
from rpf3d_core.body.rotation import spin_bound, turned_for, turning_of

Q = (0.5, 0.5, -0.5, 0.5)
BRICK = (5.0 / 12.0, 10.0 / 12.0, 13.0 / 12.0)
SPUN = (1e-3, 10.0, 1e-3)
"""A spin (rad/s) nearly about the middle axis of BRICK."""
"""BRICK: moments (kg m2) of a brick of 3 x 2 x 1 m and 1 kg."""


def errors(moments, w, t, q=Q):
    """Return the errors of the orientation (rad) and of the spin (relative) after t seconds."""
    place, spin, _ = turned(moments, q, w, t)
    true_place, true_spin = by_taylor(moments, q, w, t)
    return angle_between(place, true_place)[0], np.abs(spin[0] - true_spin).max() / np.linalg.norm(w)


@pytest.mark.parametrize("seed", range(4))
def test_a_random_body_turns_as_taylor_steps_with_40_digits_say(seed):
    for moments, q, w in zip(*real_bodies(4, seed), strict=True):
        orientation, spin = errors(moments, w, 5.0, q)
        assert orientation < 1e-12
        assert spin < 1e-12


def near_separatrix(off: float, x: float, y: float, z: float):
    """Return a spin (3,) of the body with moments (4, 6.5, 9) near the separatrix: L^2 / (2 T I2) = 1 + off.

    x, y, z : spin for off = 0, on the separatrix if x = 1.5 z
    """
    energy = 4.0 * x * x + 6.5 * y * y + 9.0 * z * z
    return x, y, z * math.sqrt(1.0 + off * energy * 6.5 / (9.0 * 2.5 * z * z))


@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6, 1e-3, -1e-3])
@pytest.mark.parametrize("start", [(1.5, 0.5, 1.0), (-0.15, 1.0, 0.1)])
def test_a_body_near_the_separatrix_turns_as_taylor_steps_say(off, start):
    moments, w = (4.0, 6.5, 9.0), near_separatrix(off, *start)
    ratio = sum((J * s) ** 2 for J, s in zip(moments, w, strict=True)) / np.dot(moments, np.square(w)) / 6.5
    assert ratio - 1.0 == pytest.approx(off, abs=1e-15 + 0.3 * abs(off))
    orientation, spin = errors(moments, w, 30.0)
    assert orientation < 1e-12
    assert spin < 1e-12


def test_on_the_separatrix_the_spin_reaches_the_middle_axis_and_stays():
    """w1 = A1 sech(k t) and w2 = A2 tanh(k t), with k = sqrt((I2 - I1) (I3 - I2) / (I1 I3)) |w2 at the end|."""
    moments, w = (4.0, 6.5, 9.0), (1.5, 0.0, 1.0)
    end = math.sqrt((4.0 * 1.5**2 + 9.0) / 6.5)
    growth = end * 2.5 / 6.0
    for t in (0.5, 3.0, 30.0, 3000.0):
        spin = turned_for(turning_of(moments, Q, w), t)[1]
        sech = 1.0 / math.cosh(growth * t) if growth * t < 700.0 else 0.0
        expected = (1.5 * sech, end * math.tanh(growth * t), sech)
        assert np.abs(spin) == pytest.approx(expected, abs=1e-13)
        assert spin[1] > 0.0


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12, 1e-15])
@pytest.mark.parametrize("w", [(3.0, 2.0, 1.0), (3.0, -4.0, 1e-9), (1e-7, 3.0, 2.0), (-5.0, 0.3, 1e-7)])
def test_a_body_with_nearly_equal_moments_loses_no_digits(gap, w):
    for moments in ((1.0, 1.0 + gap, 1.5), (1.0, 1.5, 1.5 + gap), (1.0, 1.0 + gap, 1.0 + 3.0 * gap)):
        orientation, spin = errors(moments, w, 1.0)
        assert orientation < 1e-13
        assert spin < 1e-13


@pytest.mark.parametrize("moments", [(1.0, 1.0, 1.7), (1.0, 1.8, 1.8), (1.0, 1.0, 1.0)])
@pytest.mark.parametrize("w", [(3.0, -2.0, 1.0), (-1.0, 2.0, -3.0), (2.0, 1.0, 0.0), (0.0, 1.0, 2.0)])
def test_a_symmetric_top_turns_evenly_about_two_axes(moments, w):
    """The axis circles about L at |L| / I, and the body spins about its axis at (1 - I3 / I) w3."""
    axis = 2 if moments[0] == moments[1] else 0
    across = moments[1]
    for t in (0.01, 0.7, 5.0):
        L = tuple(J * s / across * t for J, s in zip(moments, w, strict=True))
        about = [0.0, 0.0, 0.0]
        about[axis] = (1.0 - moments[axis] / across) * w[axis] * t
        # the turn about L is given in the body's axes at time 0, so it is multiplied from the right
        expected = multiply(multiply(Q, turn_by(L)), turn_by(tuple(about)))
        place, spin, _ = turned(moments, Q, w, t)
        assert angle_between(place, expected)[0] < 1e-13
        assert spin[0] == pytest.approx(turned_back(turn_by(tuple(about)), w), abs=1e-13)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("rate", [3.0, -3.0, 1000.0, 1e-9])
def test_a_spin_about_a_principal_axis_stays_also_about_the_middle_one(axis, rate):
    w, turn = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    w[axis], turn[axis] = rate, 30.0 * rate
    place, spin, bound = turned(BRICK, Q, w, 30.0)
    assert angle_between(place, multiply(Q, turn_by(tuple(turn))))[0] < 1e-12
    assert spin[0].tolist() == w
    assert bound[0] == pytest.approx(abs(rate) * math.sqrt(BRICK[axis] / BRICK[0]), rel=1e-15)


def test_a_body_without_spin_keeps_its_orientation():
    place, spin, bound = turned(BRICK, Q, (0.0, 0.0, 0.0), 1e6)
    assert place[0].tolist() == list(Q)
    assert spin[0].tolist() == [0.0, 0.0, 0.0]
    assert bound[0] == 0.0


@pytest.mark.parametrize("w", [(3e-9, 2e-9, 1e-9), (1e-9, -3e-9, 1e-9)])
def test_a_slow_spin_is_as_exact_as_any(w):
    for t in (5.0, 1e9):
        assert max(errors(BRICK, w, t)) < 1e-13


def test_a_fast_spin_is_exact_to_the_rounding_of_its_angle():
    assert max(errors(BRICK, (700.0, -500.0, 600.0), 0.2)) < 1e-12


def test_twice_the_spin_is_the_same_motion_in_half_the_time():
    moments, q, w = real_bodies(300, 11)
    place, spin, bound = turned(moments, q, w, 3.0)
    fast_place, fast_spin, fast_bound = turned(moments, q, 1024.0 * w, 3.0 / 1024.0)
    assert np.array_equal(place, fast_place)
    assert np.array_equal(1024.0 * spin, fast_spin)
    assert np.array_equal(1024.0 * bound, fast_bound)


def test_at_time_0_orientation_and_spin_are_those_given():
    moments, q, w = real_bodies(300, 12)
    place, spin, _ = turned(moments, q, w, 0.0)
    assert np.array_equal(place, q)
    assert np.array_equal(spin, w)


@pytest.mark.parametrize("t", [1e-9, 1e-3, 1.0, 30.0])
def test_energy_and_the_angular_momentum_in_space_are_kept(t):
    moments, q, w = real_bodies(2000, 13)
    place, spin, _ = turned(moments, q, w, t)
    energy = (moments * w**2).sum(axis=1)
    L = in_space(q, moments * w)
    assert np.max(np.abs((moments * spin**2).sum(axis=1) / energy - 1.0)) < 1e-12
    assert np.max(np.linalg.norm(in_space(place, moments * spin) - L, axis=1) / np.linalg.norm(L, axis=1)) < 1e-12
    assert np.max(np.abs((place**2).sum(axis=1) - 1.0)) < 1e-15


def test_two_times_one_after_the_other_are_their_sum():
    moments, q, w = real_bodies(2000, 14)
    first, second = np.random.default_rng(15).uniform(0.0, 2.0, (2, 2000))
    place, spin, _ = turned(moments, q, w, first)
    place, spin, _ = turned(moments, place, spin, second)
    at_once, spin_at_once, _ = turned(moments, q, w, first + second)
    size = np.linalg.norm(w, axis=1)
    assert np.max(np.linalg.norm(spin - spin_at_once, axis=1) / size) < 1e-12
    assert np.max(angle_between(place, at_once)) < 1e-12


def test_a_thousand_short_steps_are_one_long_one():
    moments, q, w = real_bodies(200, 16)
    place, spin = q, w
    for _ in range(1000):
        place, spin, _ = turned(moments, place, spin, 1.0 / 1024.0)
    at_once, spin_at_once, _ = turned(moments, q, w, 1000.0 / 1024.0)
    assert np.max(angle_between(place, at_once)) < 1e-11
    assert np.max(np.abs(spin - spin_at_once) / np.linalg.norm(w, axis=1)[:, None]) < 1e-11


def test_a_brick_spun_about_its_middle_axis_flips_at_the_known_times():
    """w_y changes sign at the known times (s), and the largest w_x is that of the closed form."""
    turning = turning_of(BRICK, Q, SPUN)
    flips = (2.46534, 6.93788, 11.41043, 15.88297)
    for k, flip in enumerate(flips):
        before, after = (turned_for(turning, flip + dt)[1][1] for dt in (-1e-5, 1e-5))
        assert before * after < 0.0
        assert (before > 0.0) == (k % 2 == 0)
    peak = max(abs(turned_for(turning, flips[0] + 1e-5 * k)[1][0]) for k in range(-3, 4))
    energy2, momentum2 = (sum(J**n * x * x for J, x in zip(BRICK, SPUN, strict=True)) for n in (1, 2))
    largest = math.sqrt((energy2 * BRICK[2] - momentum2) / (BRICK[0] * (BRICK[2] - BRICK[0])))  # 8.660254 rad/s
    assert peak == pytest.approx(largest, abs=1e-8)


@pytest.mark.parametrize("off", [1e-3, *(pytest.param(off, marks=pytest.mark.long) for off in (1e-6, 1e-9))])
def test_100_rad_per_s_about_the_middle_axis_keep_energy_and_momentum_for_30_s_and_are_exact(off):
    w = (100.0 * off, 100.0, 100.0 * off)
    place, spin, _ = turned(BRICK, Q, w, 30.0)
    moments, before = np.array(BRICK), np.array([w])
    assert (moments * spin**2).sum() == pytest.approx((moments * before**2).sum(), rel=1e-12)
    L = in_space(np.array([Q]), moments * before)
    assert np.abs(in_space(place, moments * spin) - L).max() < 1e-12 * np.linalg.norm(L)
    orientation, error = errors(BRICK, w, 30.0)
    assert orientation < 1e-9 and error < 1e-9


def test_no_spin_of_a_motion_is_faster_than_its_bound_and_the_least_axis_reaches_it():
    moments, q, w = real_bodies(500, 17)
    for t in np.linspace(0.0, 3.0, 40):
        _, spin, bound = turned(moments, q, w, t)
        assert np.all(np.linalg.norm(spin, axis=1) <= bound * (1.0 + 1e-14))
    assert spin_bound(turning_of(BRICK, Q, (4.0, 0.0, 0.0))) == pytest.approx(4.0, rel=1e-15)


def test_both_engines_give_the_same_bits_for_20000_bodies():
    moments, q, w = real_bodies(20_000, 18)
    rng = np.random.default_rng(19)
    moments[:2000, 1] = moments[:2000, 0] * (1.0 + 10.0 ** rng.uniform(-16, -1, 2000))
    moments[:2000, 2] = np.maximum(moments[:2000, 2], moments[:2000, 1])
    moments[2000:3000, 1] = moments[2000:3000, 2]
    # on either side of the separatrix, and some spins about one axis
    gaps = (moments[3000:6000, 1] - moments[3000:6000, 0]) * moments[3000:6000, 0]
    ratio = gaps / (moments[3000:6000, 2] - moments[3000:6000, 1]) / moments[3000:6000, 2]
    w[3000:6000, 2] = w[3000:6000, 0] * np.sqrt(ratio) * (1.0 + 10.0 ** rng.uniform(-17, -1, 3000))
    w[6000:6300] *= np.eye(3)[np.arange(300) % 3]
    t = rng.uniform(0.0, 30.0, 20_000)
    compiled, plain = (turned(moments, q, w, t, run) for run in (turn_all, turn_all.py_func))
    for a, b in zip(compiled, plain, strict=True):
        assert np.all(np.isfinite(a))
        assert np.array_equal(a, b)
