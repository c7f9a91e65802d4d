"""Tests of the impact of a rigid sphere: published and derived values, and no gain of energy."""

import math

import numpy as np
import pytest
from flights.struck_spheres import FULL, struck

from rpf3d_core.kinetics.coulomb_sphere import MATERIALS_OWN
from rpf3d_core.values import ZERO

PRINTED = 6e-5
"""Largest rounding error of the references, which print four or five decimals."""
ROUNDED = 1e-12
"""Largest relative rounding error of a dozen operations."""


def energy(v, w, radius=0.5):
    return np.dot(v, v) + 0.4 * radius * radius * np.dot(w, w)


@pytest.mark.parametrize(
    ("v", "spin", "e", "mu", "v_after", "spin_after", "ratio"),
    [
        pytest.param((15, 0, -10), 0, 0.5, 0.5, (10.7143, 0, 5), 21.4286, 0.5714, id="physics-9.3 stick"),
        pytest.param((15, 0, -2), 0, 0.5, 0.3, (14.1, 0, 1), 4.5, 0.8814, id="physics-9.3 slip"),
        pytest.param((15, 0, -10), 20, 0.5, 0.5, (13.5714, 0, 5), 27.143, None, id="physics-9.3 with the motion"),
        pytest.param((15, 0, -10), -20, 0.5, 0.5, (7.8571, 0, 5), 15.714, None, id="physics-9.3 against the motion"),
    ],
)
def test_an_impact_sticks_or_slips_as_printed(v, spin, e, mu, v_after, spin_after, ratio):
    """The two printed cases with spin lack v_n and mu; the values of the first case are used, with which they stick."""
    after, w = struck(v, (0, spin, 0), e, mu)
    assert after == pytest.approx(v_after, abs=PRINTED)
    assert w == pytest.approx((0, spin_after, 0), abs=6e-4)
    if ratio is not None:
        assert energy(after, w) / energy(v, (0, spin, 0)) == pytest.approx(ratio, abs=PRINTED)


TABLE = [
    (15, 1.29410, (9.27103, 0.97057), (8.49457, 2.91171), (7.32989, 5.82343)),
    (30, 2.50000, (7.91025, 1.87500), (6.41025, 5.62500), (6.18590, 6.18590)),
    (45, 3.53553, (6.01041, 2.65165), (5.05076, 5.05076), (5.05076, 5.05076)),
    (60, 4.33013, (3.70096, 3.24760), (3.57143, 3.57143), (3.57143, 3.57143)),
    (75, 4.82963, (1.84871, 1.84871), (1.84871, 1.84871), (1.84871, 1.84871)),
]


@pytest.mark.parametrize(("angle", "out", "weak", "middle", "strong"), TABLE, ids=lambda value: str(value))
def test_a_sphere_without_spin_leaves_the_ground_as_tabulated(angle, out, weak, middle, strong):
    """The table is that of section 2.6 of the validation reference, for |v| = 10 m/s and e = 0.5."""
    a = math.radians(angle)
    for mu, (along, spin) in ((0.1, weak), (0.3, middle), (0.6, strong)):
        v, w = struck((10 * math.cos(a), 0.0, -10 * math.sin(a)), ZERO, 0.5, mu)
        assert (v[2], v[0], 0.5 * w[1]) == pytest.approx((out, along, spin), abs=1e-5)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ((1, 0), (0.428571, 1.428571)), ((0, 1), (0.571429, -0.428571)), ((1, -1), (-0.142857, 1.857143)),
        ((3, 2), (2.428571, 3.428571)),
    ],
)  # fmt: skip
def test_a_super_ball_turns_its_slip_round_and_keeps_its_energy(before, after):
    """Garwin's super ball, section 2.7 of the validation reference: e_n = e_t = 1."""
    v, w = (before[0], 0.0, -3.0), (0.0, before[1] / 0.5, 0.0)
    v_after, w_after = struck(v, w, 1.0, FULL, e_t=1.0)
    assert (v_after[0], 0.5 * w_after[1]) == pytest.approx(after, abs=1e-6)
    assert energy(v_after, w_after) == pytest.approx(energy(v, w), rel=ROUNDED)


def test_no_impact_gains_energy_and_none_leaves_the_sphere_in_the_ground():
    rng = np.random.default_rng(4)
    for _ in range(3000):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        v, w = rng.normal(size=3) * 10.0, rng.normal(size=3) * rng.choice([0.0, 1.0, 60.0])
        v -= (v @ n + abs(v @ n)) * n
        e, e_t, mu_r = rng.uniform(size=3).round(1)
        radius, mu = rng.uniform(0.01, 4.0), rng.choice([0.0, 0.3, FULL])
        after, spin = struck(v, w, e, mu, radius, e_t, mu_r * rng.choice([0.0, 1.0, 10.0]), tuple(n))
        assert energy(after, spin, radius) <= energy(v, w, radius) * (1.0 + ROUNDED)
        assert after @ n == pytest.approx(-e * (v @ n), rel=1e-9, abs=1e-12)


def test_friction_is_the_materials_own_unless_it_is_given():
    assert struck((9, 0, -1), ZERO, 0.5, MATERIALS_OWN)[0] == pytest.approx(struck((9, 0, -1), ZERO, 0.5, 0.3)[0])
