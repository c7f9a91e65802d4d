"""The inelastic impact of a body at one contact with Coulomb friction, solved exactly."""

import math
from typing import Any

from rpf3d_core.body.contacts import LOCAL, MATRIX, SCHUR
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import ZERO, Vec

STEPS = 60
"""Largest number of steps of the search for the sliding impulse; about three are usual."""
CLOSE, NEARLY = 1e-15, 1e-9
"""Relative distances (-) of the sliding impulse from the friction cone at which the search ends.

At CLOSE, the search ends at once; at NEARLY, the search ends after one more step. The steps converge quadratically:
after one step from an error of NEARLY, only rounding remains.
"""


@kernel
def one_point(row: Any, u: Vec, mu: float) -> Vec:
    """Return the impulse (normal, tangent, tangent) m/s at one contact after which the contact does not approach.

    row : the solver's row of the contact (`contacts.prepare`); mu : friction (-)
    u : velocity of the contact without this impulse, in local axes (m/s)

    The impulse obeys the laws of Signorini and Coulomb: if the normal impulse is above 0, the normal velocity after the
    impulse is 0. If the impulse lies inside the friction cone, the tangential velocity after it is 0 too; else the
    impulse lies on the cone, and its tangential part is opposite to the tangential velocity.

    Method: if the normal velocity is 0 and the tangential impulse is -P, the tangential velocity is b - S P, where S
    (2 x 2) and b follow from the contact's matrix. A sliding contact has S P + k P = b for a k > 0. P and the normal
    impulse are rational functions of x = 1 / (k + mean eigenvalue of S). |P| exceeds the friction at the largest x and
    is below the friction at x = 0. So an interval of x always contains a solution, for any mu.
    """
    if u[0] >= 0.0:
        return ZERO
    if mu == 0.0:
        return -u[0] / row[MATRIX], 0.0, 0.0
    nn, mean, half, cos, sin = row[MATRIX], row[SCHUR], row[SCHUR + 1], row[SCHUR + 2], row[SCHUR + 3]
    a, b = row[SCHUR + 4], row[SCHUR + 5]
    first, second = cos * u[1] + sin * u[2] - a * u[0] / nn, cos * u[2] - sin * u[1] - b * u[0] / nn
    low, high = 0.0, 1.0 / mean
    x = high
    p, q, normal, last = first / (mean + half), second / (mean - half), 0.0, False
    for step in range(STEPS):
        normal = (a * p + b * q - u[0]) / nn
        size = math.sqrt(p * p + q * q)
        excess = size - mu * normal
        if last or (step == 0 and excess <= 0.0):
            break
        if abs(excess) <= CLOSE * size or high - low <= CLOSE * high:
            break
        if excess > 0.0:
            high = x
        else:
            low = x
        guess = _root_before(row, first, second) if step == 0 else 0.0
        if 0.0 < guess < high:
            x = guess
        else:
            up, down = 1.0 + half * x, 1.0 - half * x
            dp, dq = first / (up * up), second / (down * down)
            slope = (p * dp + q * dq) / size - mu * (a * dp + b * dq) / nn
            x = x - excess / slope if slope != 0.0 else low
            last = abs(excess) <= NEARLY * size
        if not low < x < high:
            x, last = 0.5 * (low + high), False
        p, q = first * x / (1.0 + half * x), second * x / (1.0 - half * x)
    return normal, -(cos * p - sin * q), -(sin * p + cos * q)


@kernel
def _root_before(row: Any, first: float, second: float) -> float:
    """Return a first guess of x (`one_point`) from the contact's previous impulse, which is in its row.

    For this x, the larger of the two components of the sliding impulse along the eigenvectors of S is the same as in
    the previous impulse. The result is 0 or less if there is no such x.

    first, second : components of b (`one_point`) along the eigenvectors of S
    """
    half, cos, sin = row[SCHUR + 1], row[SCHUR + 2], row[SCHUR + 3]
    t, s = row[LOCAL + 1], row[LOCAL + 2]
    p, q = -(cos * t + sin * s), sin * t - cos * s
    if abs(p) >= abs(q):
        return 1.0 / (first / p - half) if p != 0.0 and first / p != half else 0.0
    return 1.0 / (second / q + half) if second / q != -half else 0.0
