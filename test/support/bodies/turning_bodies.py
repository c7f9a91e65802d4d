"""Make bodies that rotate without torque, and compute their rotation to 20 digits, or with the engines' code."""

from operator import mul

import numpy as np

from rpf3d_core.body.rotation import spin_bound, turned_for, turning_of
from rpf3d_core.jit.dispatch import loop

BITS = 140
"""Binary digits after the point of the numbers in `by_taylor`: 42 decimal digits, where the tests need 13."""
ORDER = 30
STEP = 0.3
"""Largest angle (rad) of rotation in one step; the series converges up to 1.5 rad, so its remainder is below 2e-21.

The longest test has 10,000 steps, and compares to 1e-12.
"""


def real_bodies(n: int, seed: int):
    """Return random principal moments (n, 3) kg m2, unit quaternions (n, 4), and spins (n, 3) of up to 20 rad/s.

    The moments of a body are ascending and physically possible: no moment exceeds the sum of the other two.
    """
    rng = np.random.default_rng(seed)
    second = rng.uniform(0.05, 1.0, (n, 3))
    q = rng.normal(size=(n, 4))
    w = rng.normal(size=(n, 3))
    w *= (rng.uniform(0.0, 20.0, n) / np.linalg.norm(w, axis=1))[:, None]
    moments = np.sort(second.sum(axis=1)[:, None] - second, axis=1)
    return moments, q / np.linalg.norm(q, axis=1)[:, None], w


def by_taylor(moments, q, w, t: float):
    """Return orientation (4,) and spin (3,) rad/s of a body after t seconds, exact to 20 digits, from Taylor series.

    moments : (3,) principal moments, in any unit; q : (4,) orientation; w : (3,) rad/s, spin in the body's axes
    """
    fastest = float(np.sqrt(np.dot(moments, np.square(w)) / min(moments)))
    unit = 2.0 ** np.round(np.log2(fastest))  # in this unit of spin, no coefficient loses digits
    steps = int(fastest * t / STEP) + 1
    h = exact(t * unit) // steps
    J = [exact(value) for value in moments]
    rates = [((J[i - 2] - J[i - 1]) << BITS) // J[i] for i in range(3)]
    q, w = [exact(value) for value in q], [exact(value / unit) for value in w]
    for _ in range(steps):
        q, w = taylor_step(rates, q, w, h)
    q, w = (np.array([value / 2**BITS for value in part]) for part in (q, w))
    return q / np.linalg.norm(q), w * unit


def exact(value: float) -> int:
    """Return a number as an integer in units of 2^-BITS; exact for every double with a magnitude above 1e-26."""
    top, bottom = float(value).as_integer_ratio()
    return (top << BITS) // bottom


def taylor_step(rates, q, w, h):
    """Return orientation and spin after one Taylor step of w1' = rate1 w2 w3 (and so on) and q' = q (0, w) / 2.

    All numbers are integers in units of 2^-BITS; h : length of the step.
    """
    q, w = [[value] for value in q], [[value] for value in w]
    for k in range(ORDER):
        new_w = [(rates[i] * folded(w[i - 2], w[i - 1]) >> BITS) // (k + 1) for i in range(3)]
        a, b, c, d = q
        x, y, z = w
        new_q = [
            -folded(b, x) - folded(c, y) - folded(d, z),
            folded(a, x) + folded(c, z) - folded(d, y),
            folded(a, y) + folded(d, x) - folded(b, z),
            folded(a, z) + folded(b, y) - folded(c, x),
        ]
        for series, value in zip(q, new_q, strict=True):
            series.append(value // (2 * (k + 1)))
        for series, value in zip(w, new_w, strict=True):
            series.append(value)
    return [summed(series, h) for series in q], [summed(series, h) for series in w]


def folded(a, b):
    """Return the coefficient of highest order of the product of two power series of equal length."""
    return sum(map(mul, a, reversed(b))) >> BITS


def summed(series, h):
    """Return the value of a power series at h."""
    total = 0
    for value in reversed(series):
        total = (total * h >> BITS) + value
    return total


def angle_between(q, p) -> np.ndarray:
    """Return the angles (n,) rad of the rotations between unit quaternions q and p, (n, 4)."""
    q, p = np.atleast_2d(q), np.atleast_2d(p)
    across = q[:, :1] * p[:, 1:] - p[:, :1] * q[:, 1:] - np.cross(q[:, 1:], p[:, 1:])
    return 2.0 * np.arcsin(np.minimum(1.0, np.linalg.norm(across, axis=1)))


def in_space(q, a) -> np.ndarray:
    """Return vectors a (n, 3) of the body's axes, rotated by unit quaternions q (n, 4) into the axes of space."""
    s, v = q[:, :1], q[:, 1:]
    return a + 2.0 * np.cross(v, np.cross(v, a) + s * a)


@loop
def turn_all(moments, q, w, t, out):
    """Rotate each body for its time t (s), and write its final state into a row of `out`.

    The columns are orientation (4), spin (3, rad/s) and the upper bound of the spin (rad/s).
    """
    for k in range(len(out)):
        J, s = (moments[k, 0], moments[k, 1], moments[k, 2]), (w[k, 0], w[k, 1], w[k, 2])
        turning = turning_of(J, (q[k, 0], q[k, 1], q[k, 2], q[k, 3]), s)
        place, spin = turned_for(turning, t[k])
        for i in range(4):
            out[k, i] = place[i]
        for i in range(3):
            out[k, 4 + i] = spin[i]
        out[k, 7] = spin_bound(turning)


def turned(moments, q, w, t, run=turn_all):
    """Return orientations (n, 4), spins (n, 3) rad/s and upper bounds of the spins (n,) rad/s of bodies after times t.

    moments : (3,) or (n, 3); q : (4,) or (n, 4); w : (n, 3) rad/s; t : s, a number or (n,); run : loop like `turn_all`
    """
    w = np.atleast_2d(np.asarray(w, dtype=float))
    n = len(w)
    out = np.zeros((n, 8))
    moments, q = (
        np.ascontiguousarray(np.broadcast_to(np.asarray(a, float), (n, s))) for a, s in ((moments, 3), (q, 4))
    )
    run(moments, q, np.ascontiguousarray(w), np.ascontiguousarray(np.broadcast_to(np.asarray(t, float), n)), out)
    return out[:, :4], out[:, 4:7], out[:, 7]
