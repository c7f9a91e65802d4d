"""The time step of flights through air, for drag and drag layers: as long as the error of the position allows.

A flight is computed in time steps (stretches) of h seconds. In each stretch, motion A due to the air alone, dv/dt =
d(v), and free flight B alternate: A(h/2) B(h) A(h/2) (Strang 1968, SIAM J. Numer. Anal. 5:506). Let d' and d'' be the
derivatives of d with respect to v, and g the acceleration of gravity. Compared with the Taylor series of the exact
motion, one stretch has the errors

    dx = h^3 d' (d / 24 + g / 6)                                 in position,
    dv = h^3 (d' d' g / 24 - d''(d, g) / 24 - d''(g, g) / 12)      in velocity,

and terms with higher powers of h. At a time t within a stretch, the position has a further error of
d t (h - t) / 2 <= d h^2 / 8. In a flight of T seconds, a velocity error that arises after s seconds moves the rock by
(T - s) times this velocity error until the end. The position error after T seconds is therefore at most
h^2 (T |dx| / h^3 + T^2 / 2 |dv| / h^3 + |d| / 8). `stretch_for` returns the h at which this bound equals the accuracy.
"""

import math

from rpf3d_core.jit.dispatch import kernel

FLIGHT = 5.0
"""Longest duration (s) of a flight whose accuracy is guaranteed; in 5 s a rock falls 120 m.

In a longer flight, the error grows at most with the square of the duration.
"""


@kernel
def stretch_for(accuracy: float, place: float, speed: float, slowing: float) -> float:
    """Return the time step (s) with which the position error of a flight through air stays within `accuracy` (m).

    accuracy : largest position error (m) at the end of a flight of FLIGHT seconds
    place, speed : |dx| / h^3 (m/s^3) and |dv| / h^3 (m/s^4), the errors of one time step h in position and velocity
    slowing : |d|, deceleration by the air (m/s^2)
    """
    return math.sqrt(accuracy / (FLIGHT * place + 0.5 * FLIGHT * FLIGHT * speed + 0.125 * slowing))
