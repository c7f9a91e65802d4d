"""The exact path of a rock that slides on a plane with Coulomb friction, in any direction on the slope.

Let u be the speed of the rock, g_s and g_n the gravity along the plane and normal to it, k = mu g_n the deceleration by
friction, and phi the angle between the velocity and the line of steepest descent. From u' = g_s cos(phi) - k and
u phi' = -g_s sin(phi) it follows, with m = k / g_s and w = tan(phi / 2), that u is proportional to
w^(m-1) (1 + w^2): the hodograph of the sliding rock. Time, position and length of the path are then integrals of powers
of r = w / w_0, which falls from 1 to 0 as the rock turns downhill. The integrals are written with y = -ln r, so that no
digits are lost for m near 1 or a nearly straight path. In this module y is the parameter of a point on the path: 0 at
the start, inf at the end.

Derived from first principles; checked against quadrature in test/analytic/test_slide_path.py.
"""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import ALONG_EDGE
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale

STRAIGHT = 1e-9
"""Value of tan(phi / 2) below which a path counts as a straight line; so does a path above the inverse of this value.

Such a path bends by less than 1e-9 of its length.
"""
STEEPEST = 1e9
"""Value of m above which friction stops the rock before gravity can turn its velocity by 1e-9."""
BEND = 0.0625
"""Tangent of half the largest angle by which one segment of a sliding path turns; this angle is 7 degrees."""
HALVING = math.log(2.0)
SLIGHT = 5e-4
"""Value of tan(phi / 2) below which the rest of a path is one segment: it bends by less than 1e-3 of its length."""
FARTHEST = 1e40
"""Value of the parameter y after which a path crosses no more edges.

A path grows slowest with y at m = 1. Even for a rock with only 1e-9 m/s at the start, the path is then 1e20 m long at
this value.
"""
LARGEST_EXPONENT = 700.0
"""Largest argument of exp that is used; a larger one overflows: Python raises an error, compiled code gives inf."""
ROOT_STEPS = 200
"""Largest number of steps in the search for the parameter y of an event.

Bisection needs 64 steps in float64 if both ends of the bracket are of similar size, and more if their sizes differ
much.
"""


class SlidePath(NamedTuple):
    """The path of a sliding rock, which turns downhill: the constants from which each point of the path follows.

    down, across : (3,) unit vectors in the plane: the steepest descent, and the horizontal direction to the side to
        which the rock moves
    speed : u_0 (m/s), at the start; w : tan(phi_0 / 2), phi_0 the angle between velocity and steepest descent at the
        start
    m : k / g_s (-), deceleration by friction over gravity along the plane; pull : g_s (m/s^2)
    """

    down: Vec
    across: Vec
    speed: float
    w: float
    m: float
    pull: float


class SlideState(NamedTuple):
    """A sliding rock at a point of its path: t (s), offset (3,) m from the start, v (3,) m/s, path length (m)."""

    t: float
    offset: Vec
    v: Vec
    length: float


@kernel
def slide_path(v: Vec, n: Vec, g_t: Vec, friction: float) -> SlidePath:
    """Return the path of a sliding rock with velocity v along the plane of normal n.

    g_t : (3,) m/s^2, gravity along the plane; friction : k, deceleration by friction (m/s^2)
    If the path is a straight line (`is_straight`), use only `speed` and `pull` of the result.
    """
    pull, speed = norm(g_t), norm(v)
    if pull == 0.0 or speed == 0.0:
        return SlidePath(
            down=scale(1.0 / speed, v) if speed > 0.0 else g_t, across=v, speed=speed, w=0.0, m=math.inf, pull=pull
        )
    down = scale(1.0 / pull, g_t)
    across = cross(n, down)
    along, sideways = dot(v, down), dot(v, across)
    if sideways < 0.0:
        across, sideways = scale(-1.0, across), -sideways
    if sideways == 0.0:
        return SlidePath(
            down=down, across=across, speed=speed, w=0.0 if along > 0.0 else math.inf, m=friction / pull, pull=pull
        )
    w = sideways / (speed + along) if along > 0.0 else (speed - along) / sideways
    return SlidePath(down=down, across=across, speed=speed, w=w, m=friction / pull, pull=pull)


@kernel
def is_straight(path: SlidePath) -> bool:
    """Return True if a sliding path deviates from a straight line by less than 1e-9 of its length."""
    return not (STRAIGHT < path.w < 1.0 / STRAIGHT) or path.m > STEEPEST


@kernel
def slide_state(path: SlidePath, y: float) -> SlideState:
    """Return time, place, velocity and path length of a sliding rock at the path parameter y (0: start, inf: end).

    At this point the tangent of half the angle between velocity and steepest descent is `path.w` exp(-y). At y = inf, a
    rock that friction stops has stopped.
    """
    m, w2 = path.m, path.w * path.w
    time = path.speed / (path.pull * (1.0 + w2))
    t = time * (_power(m - 1.0, y) + w2 * _power(m + 1.0, y))
    area = time * path.speed / (1.0 + w2)
    forward, middle, back = _power(2.0 * m - 2.0, y), _power(2.0 * m, y), _power(2.0 * m + 2.0, y)
    length = area * (forward + 2.0 * w2 * middle + w2 * w2 * back)
    down, across = _offsets(path, y)
    return SlideState(
        t=t, offset=add(scale(down, path.down), scale(across, path.across)), v=slide_velocity(path, y), length=length
    )


@kernel
def _offsets(path: SlidePath, y: float) -> tuple[float, float]:
    """Return how far (m) a sliding rock has moved down the slope and across it, at the parameter y of its path.

    y : 0 at the start, inf at the end
    """
    m, w2 = path.m, path.w * path.w
    spread = 1.0 + w2
    area = path.speed * path.speed / (path.pull * spread * spread)
    down = area * (_power(2.0 * m - 2.0, y) - w2 * w2 * _power(2.0 * m + 2.0, y))
    across = 2.0 * area * path.w * (_power(2.0 * m - 1.0, y) + w2 * _power(2.0 * m + 1.0, y))
    return down, across


@kernel
def slide_velocity(path: SlidePath, y: float) -> Vec:
    """Return the velocity (3,) m/s of a sliding rock at the parameter y of its path (0: start, inf: end)."""
    if y == math.inf:
        return 0.0, 0.0, 0.0
    r = math.exp(-y)
    w = path.w * r
    scaled = path.speed * math.exp(min((1.0 - path.m) * y, LARGEST_EXPONENT)) / (1.0 + path.w * path.w)
    return add(scale(scaled * (1.0 - w * w), path.down), scale(2.0 * scaled * w, path.across))


@kernel
def _power(q: float, y: float) -> float:
    """Return the integral of s^(q-1) over s from exp(-y) to 1: (1 - exp(-q y)) / q, or y for q = 0.

    Times and lengths of a sliding path are sums of such integrals.
    """
    if q == 0.0:
        return y
    if y == math.inf:
        return 1.0 / q if q > 0.0 else math.inf
    if -q * y > LARGEST_EXPONENT:
        return math.inf
    return -math.expm1(-q * y) / q


@kernel
def bend_point(path: SlidePath) -> float:
    """Return the path parameter y at which a segment of a sliding path must end, because the path has turned too far.

    y : 0 at the start of the path, inf at its end. The result is inf if one segment is enough for the whole path.

    At the end of the segment the path has turned by 7 degrees or, if the path is already nearly downhill, its angle to
    the line of steepest descent has halved. Within a segment, speed and direction differ by at most 1 % from a motion
    with constant acceleration.
    """
    if path.w <= SLIGHT:
        return math.inf
    if path.w <= 2.0 * BEND:
        return HALVING
    return math.log(path.w * (1.0 + path.w * BEND) / (path.w - BEND))


@kernel
def turning_point(path: SlidePath, inward: Vec) -> float:
    """Return the path parameter y (0: start, inf: end) at which a sliding rock moves parallel to an edge; -1 if never.

    inward : (3,) vector in the plane, perpendicular to the edge, pointing into the facet

    inward . v is proportional to A (1 - w^2) + 2 B w, with A and B the components of `inward` along the path's `down`
    and `across`. For w > 0 this expression changes sign just once, unless A is 0.
    """
    A, B = dot(inward, path.down), dot(inward, path.across)
    if A == 0.0:
        return -1.0
    B = math.copysign(1.0, A) * B
    root = math.sqrt(A * A + B * B)
    w = (B + root) / abs(A) if B >= 0.0 else abs(A) / (root - B)
    return math.log(path.w / w) if w < path.w else -1.0


@kernel
def exit_point(path: SlidePath, inward: Vec, distance: float) -> float:
    """Return the path parameter y (0: start, inf: end) at which a rock slides out over an edge of its facet.

    The result is inf if the rock never slides out over this edge.

    inward : (3,) vector in the plane, perpendicular to the edge, pointing into the facet; of any length
    distance : distance of the start from the edge (m), times the length of `inward`

    The path bends in one direction only, so it moves away from the edge at most once and towards the edge at most once.
    """
    A, turn = dot(inward, path.down), turning_point(path, inward)
    entering, ends_inwards = dot(inward, slide_velocity(path, 0.0)), A > 0.0
    heads_in = entering >= 0.0
    if heads_in and A >= 0.0:
        return math.inf
    if ends_inwards and entering >= -ALONG_EDGE * norm(inward) * path.speed:
        return math.inf  # the rock starts along the edge, except for rounding, and gravity pulls it into the facet
    if ends_inwards and turn < 0.0:  # the rock moves along the edge, outwards only by rounding
        return math.inf
    low = max(turn, 0.0) if heads_in else 0.0
    if _height(path, inward, distance, low) <= 0.0:
        return low
    if ends_inwards:
        return _crossing(path, inward, distance, low, turn) if _height(path, inward, distance, turn) < 0.0 else math.inf
    if path.m > 1.0 and _height(path, inward, distance, math.inf) >= 0.0:
        return math.inf
    high = low + 1.0 / (1.0 + path.m)
    while _height(path, inward, distance, high) >= 0.0:
        if high > FARTHEST:
            return math.inf
        high = 2.0 * high
    return _crossing(path, inward, distance, low, high)


@kernel
def _height(path: SlidePath, inward: Vec, distance: float, y: float) -> float:
    """Return the distance of a sliding rock from an edge at the path parameter y, times the length of `inward`.

    The result is below 0 beyond the edge.

    inward, distance : as in `exit_point`
    """
    A, B = dot(inward, path.down), dot(inward, path.across)
    down, across = _offsets(path, y)
    height = distance + B * across
    return height if A == 0.0 else height + A * down  # an edge along the slope: down may be infinite


@kernel
def _crossing(path: SlidePath, inward: Vec, distance: float, low: float, high: float) -> float:
    """Return the path parameter y, between `low` and `high`, at which a sliding rock crosses an edge.

    `_height` is >= 0 at `low` and < 0 at `high`. The search is the Illinois method.

    inward, distance : as in `exit_point`; low, high : ends of the range of y
    """
    h_low, h_high = _height(path, inward, distance, low), _height(path, inward, distance, high)
    kept = 0
    for _ in range(ROOT_STEPS):
        y = high - h_high * (high - low) / (h_high - h_low)
        if not (low < y < high):
            y = 0.5 * (low + high)
        if not (low < y < high):
            break
        h = _height(path, inward, distance, y)
        if h >= 0.0:
            h_high = 0.5 * h_high if kept == 1 else h_high
            low, h_low, kept = y, h, 1
        else:
            h_low = 0.5 * h_low if kept == -1 else h_low
            high, h_high, kept = y, h, -1
        if h == 0.0:
            break
    return low


@kernel
def time_point(path: SlidePath, t: float, latest: float) -> float:
    """Return the path parameter y (0: start, inf: end) of a sliding rock after t seconds.

    latest : a value of y that the rock reaches after more than t seconds
    """
    low, high = 0.0, min(latest, 1.0 / (1.0 + path.m))
    while high < latest and slide_state(path, high).t < t:
        low, high = high, min(2.0 * high, latest)
    for _ in range(ROOT_STEPS):
        y = 0.5 * (low + high)
        if not (low < y < high):
            break
        if slide_state(path, y).t < t:
            low = y
        else:
            high = y
    return low


@kernel
def stop_point(path: SlidePath, stop_speed: float) -> float:
    """Return the path parameter y (0: start, inf: end) at which a sliding rock has slowed to stop_speed >= 0 (m/s).

    The result is inf if the rock reaches this speed only at the end of the path, or never.

    Let m = `path.m` be the deceleration by friction divided by the gravity along the plane, and w the tangent of half
    the angle between velocity and steepest descent. If m < 1, the rock first slows down and then speeds up; the speed
    is lowest where w^2 = (1 - m) / (1 + m). The search ends at this place.
    """
    if stop_speed <= 0.0 or (path.speed / (1.0 + path.w * path.w) >= stop_speed and path.m <= 1.0):
        return math.inf
    low, high = 0.0, 1.0 / (1.0 + path.m)
    if path.m < 1.0:
        high = math.log(path.w / math.sqrt((1.0 - path.m) / (1.0 + path.m)))
        if high <= 0.0 or norm(slide_velocity(path, high)) > stop_speed:
            return math.inf
    while norm(slide_velocity(path, high)) > stop_speed:
        low, high = high, 2.0 * high
    for _ in range(ROOT_STEPS):
        y = 0.5 * (low + high)
        if not (low < y < high):
            break
        if norm(slide_velocity(path, y)) > stop_speed:
            low = y
        else:
            high = y
    return high
