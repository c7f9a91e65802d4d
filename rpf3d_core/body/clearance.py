"""Compute for how long a body in free flight stays clear of a plane, as a step of the search for its first contact."""

import math
from typing import Any, NamedTuple

from rpf3d_core.body.quaternions import Quaternion, turned_back
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, dot

TURNING = 0.5 + math.sqrt(0.25 + 1.0 / 3.0)
"""Upper bound (-), 1.264, of |a| / (spin_bound^2 |r|): a is the acceleration of a corner by rotation.

r is the offset of the corner from the centre of mass.

The corner r accelerates by w x (w x r) + w' x r = -w^2 (P + K) r. P is 1 - u u^T with the unit vector u along w. K is
skew with |K r| <= k |r|, and k = |w'| / w^2 <= 1 / sqrt(3) for every rigid body without torque. P - 1/2 is half a
reflection, so its norm is 1/2. The norm of 1/2 + K is sqrt(1/4 + k^2), because K r is at right angles to r. So the norm
of P + K is at most 1/2 + sqrt(1/4 + k^2) = 1.264; the sum of the norms of P and K is only bounded by 1 + k = 1.577.
"""


class BodySweep(NamedTuple):
    """The state of a body in free flight at time 0.

    x, v : centre of mass (3,) m and its velocity (3,) m/s, in space
    w : spin (3,) rad/s in the axes of space
    q : orientation, from the body's axes to space
    gravity : m/s^2, along -z
    spin_bound : rad/s, a speed of rotation that the body never exceeds during the flight
    """

    x: Vec
    v: Vec
    w: Vec
    q: Quaternion
    gravity: float
    spin_bound: float


@kernel
def reach_time(height: float, rate: float, fall: float) -> float:
    """Return the first time t > 0 (s) at which height + rate t - fall t^2 / 2 is 0; infinite if there is none.

    height : m, above 0; rate : m/s; fall : m/s^2, of any sign

    Each branch adds numbers of equal sign, so rounding does not hide a short time.
    """
    square = rate * rate + 2.0 * fall * height
    if square < 0.0 or (rate >= 0.0 and fall <= 0.0):
        return math.inf
    root = math.sqrt(square)
    return (rate + root) / fall if rate > 0.0 else 2.0 * height / (root - rate)


@kernel
def set_arms(arms: Any, corners: Any, first: int, last: int, size: float) -> None:
    """Write the corners of a body and their distances from the centre of mass into the first columns of `arms`.

    arms : (4, N) m, receives the rows x, y, z and distance, with a column for each corner; in this order of memory,
        compiled code reads several corners at a time
    corners : (N, 3); the rows `first` to `last` - 1 times `size` (m) are the body's corners, in the body's axes
    """
    for i in range(last - first):
        x, y, z = size * corners[first + i, 0], size * corners[first + i, 1], size * corners[first + i, 2]
        arms[0, i], arms[1, i], arms[2, i] = x, y, z
        arms[3, i] = math.sqrt(x * x + y * y + z * z)


class Descent(NamedTuple):
    """The approach of a body's corners to a plane: the numbers that `clear_time` needs.

    up : (3,) unit normal of the plane, in the body's axes; its scalar product with a corner is the height (m) of the
        corner above the centre of mass
    across : (3,) 1/s, in the body's axes; its scalar product with a corner is the rate of change of this height (m/s)
    centre : m, height of the centre of mass above the plane; rate : m/s, rate of change of this height
    fall : m/s2, acceleration of the centre of mass towards the plane
    turning : 1/s2, largest acceleration of a corner by rotation, per metre of distance from the centre of mass
    """

    up: Vec
    across: Vec
    centre: float
    rate: float
    fall: float
    turning: float


@kernel
def _descent(sweep: BodySweep, plane: tuple[Vec, float]) -> Descent:
    """Return the numbers that describe the approach of a body's corners to a plane; plane : as in `clear_time`."""
    n = plane[0]
    return Descent(
        up=turned_back(sweep.q, n),
        across=turned_back(sweep.q, cross(n, sweep.w)),
        centre=dot(n, sweep.x) - plane[1],
        rate=dot(n, sweep.v),
        fall=sweep.gravity * n[2],
        turning=TURNING * sweep.spin_bound * sweep.spin_bound,
    )


@kernel
def _bound_of(arms: Any, i: int, descent: Descent) -> Vec:
    """Return a lower bound h + h' t - B t^2 / 2 of the height (m) of corner i above the plane, as (h, h', B).

    t : s, time from now; arms : as in `clear_time`
    """
    x, y, z = arms[0, i], arms[1, i], arms[2, i]
    up, across = descent.up, descent.across
    return (
        descent.centre + (up[0] * x + up[1] * y + up[2] * z),
        descent.rate + (across[0] * x + across[1] * y + across[2] * z),
        descent.fall + descent.turning * arms[3, i],
    )


@kernel
def _all_clear(arms: Any, count: int, descent: Descent, most: float) -> bool:
    """Return True if the bounds show that no corner reaches the plane within `most` seconds; this ends most searches.

    The loop has no branch, so that compiled code processes several corners at a time. Parameters as in `clear_time`.
    """
    clear = 0
    for i in range(count):
        height, sinks, bends = _bound_of(arms, i, descent)
        clear += (height > 0.0) & (bends >= 0.0) & (height + most * (sinks - 0.5 * bends * most) > 0.0)
    return clear == count


@routine
def clear_time(arms: Any, count: int, sweep: BodySweep, plane: tuple[Vec, float], most: float) -> float:
    """Return a time (s), 0 or more, before which no corner of the body reaches the plane n . y = d.

    arms : (4, N), of which the first `count` columns are the body's corners, from `set_arms`
    sweep : state of the body at time 0
    plane : unit normal n (3,) and distance d (m); the result is 0 if a corner is not on the side n . y > d
    most : s, time of interest; the result is infinite if no corner reaches the plane within this time

    The result is the longer of two times, each a lower bound. First, a corner at height h with rate h' accelerates
    towards the plane by at most B = g n_z + 1.264 w^2 |r| (TURNING is 1.264), with gravity g, `spin_bound` w, and the
    corner's offset r from the centre of mass. So the corner needs at least the positive root t of the equation
    h + h' t - B t^2 / 2 = 0. Second, no corner reaches the plane before the sphere around the centre of mass that
    contains all corners.
    """
    descent = _descent(sweep, plane)
    if _all_clear(arms, count, descent, most):
        return math.inf
    time, farthest = most, 0.0
    for i in range(count):
        height, sinks, bends = _bound_of(arms, i, descent)
        if height <= 0.0:
            return 0.0
        farthest = max(farthest, arms[3, i])
        # A parabola that opens downwards and is still above 0 at `time` has its root later, so it is not computed.
        if bends < 0.0 or not height + time * (sinks - 0.5 * bends * time) > 0.0:
            time = min(time, reach_time(height, sinks, bends))
    if not time < most:
        return math.inf
    if descent.centre <= farthest:
        return time
    return max(time, reach_time(descent.centre - farthest, descent.rate, descent.fall))
