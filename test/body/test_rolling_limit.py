"""Tests of the rolling moment of an impact, against a root in 50 digits and against other moments in the limit."""

import math

import numpy as np
import pytest
from bodies.bodies_in_contact import random_moments, unit
from mpmath import mp, mpf

from rpf3d_core.body.contacts import put
from rpf3d_core.body.rolling_limit import rolling_impulse
from rpf3d_core.jit.dispatch import loop


@loop
def impulses_of(spins, moments, limits, found):
    """Write the angular impulse of rolling resistance of each body into `found` (N, 3)."""
    for i in range(len(limits)):
        w, m = spins[i], moments[i]
        put(found[i], 0, rolling_impulse((w[0], w[1], w[2]), (m[0], m[1], m[2]), limits[i]))


def cases(seed: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return spins (N, 3), moments (N, 3), and limits (N,) of 1e-6 to 2 times the impulse that stops the spin."""
    rng = np.random.default_rng(seed)
    moments = random_moments(rng, count) * 10.0 ** rng.uniform(-6, 3, (count, 1))
    spins = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 3, (count, 1))
    limits = np.linalg.norm(spins * moments, axis=1) * np.minimum(10.0 ** rng.uniform(-6, 0.5, count), 2.0)
    return spins, moments, limits


def impulses(spins: np.ndarray, moments: np.ndarray, limits: np.ndarray, engine=impulses_of) -> np.ndarray:
    found = np.zeros_like(spins)
    engine(spins, moments, limits, found)
    return found


def exact_impulse(spin: np.ndarray, moments: np.ndarray, limit: float) -> list[float]:
    """Return the angular impulse (3,) by bisection of its length over the multiplier, in 50 digits."""
    w, inertia, most = [mpf(float(x)) for x in spin], [mpf(float(x)) for x in moments], mpf(float(limit))

    def impulse(k):
        return [-a * b / (1 + k * b) for a, b in zip(w, inertia, strict=True)]

    def length(k):
        return mp.sqrt(sum(x * x for x in impulse(k)))

    if length(mpf(0)) <= most:
        return [float(x) for x in impulse(mpf(0))]
    low, high = mpf(0), mpf(1)
    while length(high) > most:
        high *= 4
    for _ in range(150):
        middle = (low + high) / 2
        low, high = (middle, high) if length(middle) > most else (low, middle)
    return [float(x) for x in impulse(low)]


def test_the_impulse_is_the_root_in_50_digits():
    spins, moments, limits = cases(1, 300)
    found = impulses(spins, moments, limits)
    with mp.workdps(50):
        exact = np.array([exact_impulse(*case) for case in zip(spins, moments, limits, strict=True)])
    errors = np.linalg.norm(found - exact, axis=1) / np.linalg.norm(exact, axis=1)
    assert errors.max() < 2e-14
    stopped = np.linalg.norm(spins * moments, axis=1) <= limits
    assert 10 < stopped.sum() < 100
    assert np.array_equal(found[stopped], -spins[stopped] * moments[stopped])


def energy(spin: np.ndarray, moments: np.ndarray, impulse: np.ndarray) -> np.ndarray:
    """Return the energy of rotation (J/kg) after angular impulses (..., 3)."""
    after = spin + impulse / moments
    return 0.5 * (moments * after * after).sum(-1)


def least_energy(rng: np.random.Generator, spin: np.ndarray, moments: np.ndarray, limit: float) -> np.ndarray:
    """Return the angular impulse (3,) within the limit that leaves least energy, by a random search."""
    best, width = np.zeros(3), limit
    for _ in range(40):
        tried = best + width * unit(rng.normal(size=(2000, 3))) * rng.uniform(size=(2000, 1)) ** (1.0 / 3.0)
        tried /= np.maximum(np.linalg.norm(tried, axis=1) / limit, 1.0)[:, None]
        tried = np.concatenate([best[None], tried])
        best, width = tried[np.argmin(energy(spin, moments, tried))], 0.7 * width
    return best


def test_no_other_impulse_within_the_limit_leaves_less_energy():
    rng = np.random.default_rng(2)
    spins, moments, limits = cases(3, 60)
    found = impulses(spins, moments, limits)
    for spin, inertia, limit, impulse in zip(spins, moments, limits, found, strict=True):
        before = energy(spin, inertia, np.zeros(3))
        assert np.linalg.norm(impulse) <= limit * (1.0 + 1e-14)
        best = least_energy(rng, spin, inertia, limit)
        assert energy(spin, inertia, impulse) <= energy(spin, inertia, best) + 1e-14 * before
        assert np.linalg.norm(impulse - best) < 3e-3 * limit, "the search comes near"


@pytest.mark.parametrize("spin", [(0.0, 0.0, 0.0), (1e-200, 0.0, 0.0), (3.0, -2.0, 1.0)])
@pytest.mark.parametrize("limit", [0.0, 1e-12, 0.3, math.inf])
def test_a_body_without_spin_or_resistance_is_an_edge_that_stays_finite(spin, limit):
    moments = (0.2, 0.3, 0.4)
    impulse = np.array(rolling_impulse(spin, moments, limit))
    full = -np.array(spin) * moments
    assert np.isfinite(impulse).all() and np.linalg.norm(impulse) <= limit * (1.0 + 1e-14)
    if limit > np.abs(full).sum():
        assert np.array_equal(impulse, full)
    assert impulse @ spin <= 0.0


def test_both_engines_find_the_same_bits():
    bodies = cases(4, 2000)
    assert np.array_equal(impulses(*bodies), impulses(*bodies, impulses_of.py_func))
