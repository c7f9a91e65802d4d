"""Tests of free flight: positions, and the length of an arc against quadrature (mpmath, 30 digits)."""

import math

import mpmath
import pytest

from rpf3d_core.arc import Arc, advance, arc_length, fall_time, gravity_along, position
from rpf3d_core.values import ZERO, Motion

ROUNDING = 1e-12
"""Largest relative error: a dozen roundings, and cancellation in the difference of two antiderivatives."""

THROWS = [
    ((3.0, 4.0, 12.0), 2.0), ((3.0, 4.0, 12.0), 4.0), ((0.0, 0.0, 5.0), 3.0), ((0.0, 0.0, -5.0), 3.0),
    ((0.0, 0.0, 0.0), 1.5), ((1e-9, 0.0, 4.0), 2.0), ((1e-200, 0.0, 4.0), 2.0), ((50.0, -20.0, 0.0), 10.0),
    ((2.0, 0.0, 9.81), 2.0), ((0.3, 0.1, -70.0), 0.1),
]  # fmt: skip


def quadrature(v, t, gravity):
    with mpmath.workdps(30):
        h, apex = mpmath.mpf(v[0]) ** 2 + mpmath.mpf(v[1]) ** 2, v[2] / gravity
        pieces = [0, apex, t] if 0 < apex < t else [0, t]
        return float(mpmath.quad(lambda s: mpmath.sqrt(h + (mpmath.mpf(v[2]) - mpmath.mpf(gravity) * s) ** 2), pieces))


@pytest.mark.parametrize("gravity", [9.81, 1.62])
@pytest.mark.parametrize(("v", "t"), THROWS, ids=str)
def test_the_length_of_an_arc_is_the_integral_of_its_speed(v, t, gravity):
    assert arc_length(Arc(ZERO, v, gravity), t) == pytest.approx(quadrature(v, t, gravity), rel=ROUNDING)


@pytest.mark.parametrize("t", [1e-3, 1e-5, 1e-7])
def test_the_length_of_a_short_arc_is_speed_times_time(t):
    # The closed form subtracts two numbers of about u |v| / g, so the error is 1e-16 of these numbers.
    assert arc_length(Arc(ZERO, (3.0, 0.0, 20.0), 9.81), t) == pytest.approx(
        quadrature((3.0, 0.0, 20.0), t, 9.81), abs=20.0 * 20.0 / 9.81 * 2e-16 * 4
    )


def test_no_arc_is_shorter_than_its_chord():
    arc = Arc((1.0, 2.0, 3.0), (5.0, -2.0, 8.0), 9.81)
    for t in (0.1, 0.5, 1.0, 3.0):
        assert arc_length(arc, t) >= math.dist(arc.x, position(arc, t))


def test_flying_twice_is_flying_once():
    motion = Motion(1.0, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (7.0, 8.0, 9.0))
    once, twice = advance(motion, 9.81, 1.7), advance(advance(motion, 9.81, 0.6), 9.81, 1.1)
    assert twice.t == pytest.approx(once.t, rel=ROUNDING)
    assert twice.x == pytest.approx(once.x, rel=ROUNDING)
    assert twice.v == pytest.approx(once.v, rel=ROUNDING)
    assert twice.w == motion.w


@pytest.mark.parametrize("speed", [0.0, 3.0, -3.0, 1e6, -1e6])
@pytest.mark.parametrize("height", [0.0, 1e-12, 1e-3, 100.0])
def test_the_time_of_a_fall_brings_the_rock_down_by_that_height(speed, height):
    t = fall_time(speed, height, 9.81)
    with mpmath.workdps(40):
        u, h, g = mpmath.mpf(speed), mpmath.mpf(height), mpmath.mpf(9.81)
        exact = (u + mpmath.sqrt(u * u + 2 * g * h)) / g
        assert t == pytest.approx(float(exact), rel=1e-14)


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.5, 1.2, math.pi / 2])
def test_gravity_along_a_plane_is_what_is_left_of_it_without_the_normal_part(angle):
    n = (math.sin(angle) * 0.6, math.sin(angle) * 0.8, math.cos(angle))
    along = gravity_along(n, 9.81)
    assert math.hypot(*along) == pytest.approx(9.81 * math.sin(angle), rel=1e-14)
    assert sum(a * b for a, b in zip(along, n, strict=True)) == pytest.approx(0.0, abs=1e-14)
    assert along[2] <= 0.0
