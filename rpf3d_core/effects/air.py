"""What all effects of the air have in common: how long a parabola may stand for a flight that the air slows.

The air's own motion A, dv/dt = d(v), and free flight B are done in turn, A(h/2) B(h) A(h/2) (Strang 1968, SIAM J.
Numer. Anal. 5:506). Against the Taylor series of both together, one stretch of h seconds is off by

    dx = h^3 d' (d / 24 + g / 6)                                 in place,
    dv = h^3 (d' d' g / 24 - d''(d, g) / 24 - d''(g, g) / 12)      in speed,

and higher powers of h; within it, and where it ends early at t, the place is off by d t (h - t) / 2 <= d h^2 / 8 more.
A speed that is off at s seconds of T moves the rock by (T - s) times as much, so after T seconds it is off by no more
than h^2 (T |dx| / h^3 + T^2 / 2 |dv| / h^3 + |d| / 8). `stretch_for` solves that for h.
"""

import math

from rpf3d_core.jit.dispatch import kernel

FLIGHT = 5.0
"""Seconds of flight for which an accuracy is promised: a fall of 120 m. A longer one is off by its square, at most."""


@kernel
def stretch_for(accuracy: float, place: float, speed: float, slowing: float) -> float:
    """Seconds of a stretch that leaves a flight of FLIGHT seconds off by no more than `accuracy` (m).

    place : |dx| / h^3 (m/s^3); speed : |dv| / h^3 (m/s^4); slowing : |d| (m/s^2)
    """
    return math.sqrt(accuracy / (FLIGHT * place + 0.5 * FLIGHT * FLIGHT * speed + 0.125 * slowing))
