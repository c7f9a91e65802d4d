"""The rolling moment of an impact: it opposes the spin, up to a limit that follows from the normal impulses."""

import math

from rpf3d_core.jit.dispatch import routine
from rpf3d_core.values import Vec

STEPS = 40
"""Largest number of Newton steps; about four are usual."""
CLOSE = 1e-15
"""Difference between the length of the moment and the limit, as a share (-) of the limit, at which the search ends."""


@routine
def rolling_impulse(w: Vec, moments: Vec, limit: float) -> Vec:
    """Return the angular impulse (m2/s, per unit of mass) that rolling resistance gives a body, in the body's axes.

    w : spin without this impulse (rad/s); moments : principal moments (m2)
    limit : largest length of the impulse (m2/s)

    If the limit allows it, the impulse M stops the spin. Else its length is the limit, and it points against the
    remaining spin: M_i = -w_i I_i / (1 + k I_i), with the moments I_i and a k > 0 such that |M| is the limit. 1 / |M|
    is a concave function of k, so Newton's steps from 0 approach the solution from below.
    """
    full = (moments[0] * w[0], moments[1] * w[1], moments[2] * w[2])
    if not limit > 0.0:
        return 0.0, 0.0, 0.0
    k, parts = 0.0, full
    for _ in range(STEPS):
        squared = parts[0] * parts[0] + parts[1] * parts[1] + parts[2] * parts[2]
        size = math.sqrt(squared)
        if size <= limit * (1.0 + CLOSE):
            break
        d = (1.0 + k * moments[0], 1.0 + k * moments[1], 1.0 + k * moments[2])
        falls = (
            parts[0] * parts[0] * moments[0] / d[0]
            + parts[1] * parts[1] * moments[1] / d[1]
            + parts[2] * parts[2] * moments[2] / d[2]
        )
        step = (size - limit) / limit * squared / falls
        if not step > CLOSE * k:
            break
        k += step
        d = (1.0 + k * moments[0], 1.0 + k * moments[1], 1.0 + k * moments[2])
        parts = (full[0] / d[0], full[1] / d[1], full[2] / d[2])
    return -parts[0], -parts[1], -parts[2]
