"""The time for which a body in free flight stays clear of a plane: the step of the search for its first contact."""

import math
from typing import Any, NamedTuple

from rpf3d_core.body.quaternions import Quaternion, turned_back
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, dot

TURNING = 0.5 + math.sqrt(0.25 + 1.0 / 3.0)
"""Largest acceleration of a corner towards any side by rotation (-), as a multiple of spin bound^2 times radius: 1.264.

The corner r accelerates by w x (w x r) + w' x r = -w^2 (P + K) r. P is 1 - u u^T with the unit vector u along w. K is
skew with |K r| <= k |r|, and k = |w'| / w^2 <= 1 / sqrt(3) for every rigid body without torque (rigid_blocks.md 6.3).
P - 1/2 is half a reflection, so its norm is 1/2. The norm of 1/2 + K is sqrt(1/4 + k^2), because K r is at right angles
to r. The sum is at most 1/2 + sqrt(1/4 + k^2); the two parts on their own give 1 + k = 1.577.
"""


class Sweep(NamedTuple):
    """A body in free flight at time 0.

    x, v : centre of mass (3,) m and its velocity (3,) m/s, in space
    w : spin (3,) rad/s in the axes of space
    q : orientation, from the body's axes to space
    gravity : (m/s^2), along -z
    spin_bound : (rad/s), a speed of rotation that the body never exceeds
    """

    x: Vec
    v: Vec
    w: Vec
    q: Quaternion
    gravity: float
    spin_bound: float


@kernel
def reach_time(height: float, rate: float, fall: float) -> float:
    """Return the first time (s) at which height + rate t - fall t^2 / 2 is 0; infinite if there is none.

    height : above 0 (m); rate : (m/s); fall : of any sign (m/s^2)

    Each branch adds numbers of equal sign, so rounding does not hide a short time.
    """
    square = rate * rate + 2.0 * fall * height
    if square < 0.0 or (rate >= 0.0 and fall <= 0.0):
        return math.inf
    root = math.sqrt(square)
    return (rate + root) / fall if rate > 0.0 else 2.0 * height / (root - rate)


@routine
def clear_time(corners: Any, first: int, last: int, size: float, sweep: Sweep, plane: tuple[Vec, float]) -> float:
    """Return a time (s), 0 or more, possibly infinite, for which no corner of the body reaches the plane n . y = d.

    corners : (N, 3); the rows `first` to `last` - 1 times `size` (m) are the body's corners, in the body's axes
    plane : unit normal n (3,) and distance d (m); the body lies on the side n . y > d, otherwise the result is 0

    Two bounds hold, and the longer time counts. A corner at height h with rate h' accelerates towards the plane by at
    most B = g n_z + TURNING w_max^2 |r|, so it needs at least the positive root of h + h' t - B t^2 / 2 = 0. And no
    corner reaches the plane before the sphere around the centre of mass that holds all corners does.

    Source: rigid_blocks.md 6.3, with a smaller factor.
    """
    n = plane[0]
    up, across = turned_back(sweep.q, n), turned_back(sweep.q, cross(n, sweep.w))
    centre, rate, fall = dot(n, sweep.x) - plane[1], dot(n, sweep.v), sweep.gravity * n[2]
    turning = TURNING * sweep.spin_bound * sweep.spin_bound
    time, farthest = math.inf, 0.0
    for i in range(first, last):
        x, y, z = size * corners[i, 0], size * corners[i, 1], size * corners[i, 2]
        height = centre + (up[0] * x + up[1] * y + up[2] * z)
        if height <= 0.0:
            return 0.0
        radius = math.sqrt(x * x + y * y + z * z)
        sinks, bends = rate + (across[0] * x + across[1] * y + across[2] * z), fall + turning * radius
        farthest = max(farthest, radius)
        # A parabola open to below that is above 0 at the least time so far has its root later: it needs no root.
        if bends < 0.0 or not height + time * (sinks - 0.5 * bends * time) > 0.0:
            time = min(time, reach_time(height, sinks, bends))
    if centre <= farthest:
        return time
    return max(time, reach_time(centre - farthest, rate, fall))
