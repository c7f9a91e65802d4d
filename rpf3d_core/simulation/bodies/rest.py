"""Decide when a body has stopped, and why.

A body has stopped if it stands still, has stayed in one place for some time, has been slower than the ground's stop
speed for some time, or leans against an obstacle.
"""

import math
from enum import IntEnum
from typing import NamedTuple

from rpf3d_core.body.quaternions import Quaternion, inverse, multiply
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion, rotational_energy
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, norm, subtract

STANDS = 1e-3
"""Speed (m/s) up to which a body counts as standing."""
STANDS_FOR, HELD_FOR, SLOW_FOR = 0.3, 2.0, 5.0
"""Times (s) after which a body counts as stopped, for the `Stop` reasons STANDS, HELD and SLOW."""


class Stop(IntEnum):
    """Why a body counts as stopped.

    NOT_STOPPED : the body does not count as stopped
    STANDS : its speed was at most STANDS (1 mm/s) for STANDS_FOR (0.3 s)
    HELD : it moved less than the skin for HELD_FOR (2 s), but may still jitter
    SLOW : it was slower than the ground's stop speed for SLOW_FOR (5 s)
    LEANS : it lost all its speed against an obstacle
    """

    NOT_STOPPED = -1
    STANDS = 0
    HELD = 1
    SLOW = 2
    LEANS = 3


NOT_STOPPED = int(Stop.NOT_STOPPED)
STANDING, HELD, CRAWLING, LEANING = int(Stop.STANDS), int(Stop.HELD), int(Stop.SLOW), int(Stop.LEANS)


class Rest(NamedTuple):
    """The times (s) since which a body stands, is slow, and has stayed in one place.

    stands : inf if the body does not stand; slow : inf if the body is faster than the ground's stop speed
    held : time since which it has moved less than the skin, the distance from the ground at which contact begins
    x, q : position (3,) m and orientation at the time `held`
    """

    stands: float
    slow: float
    held: float
    x: Vec
    q: Quaternion


@kernel
def no_rest(motion: BodyMotion) -> Rest:
    """Return the `Rest` of a body that begins to stay in one place only now, and neither stands nor is slow.

    motion : the body's current motion
    """
    return Rest(stands=math.inf, slow=math.inf, held=motion.t, x=motion.x, q=motion.q)


@kernel
def mean_speed(body: Body, begin: BodyMotion, end: BodyMotion) -> float:
    """Return the speed (m/s) of a body in a step, from an estimate of its kinetic energy in the middle of the step.

    A body without spin and with this energy has this speed.

    begin, end : motion at both ends of the step

    The energy is the sum of two energies: the translational energy of the mean velocity, and the smaller of the two
    rotational energies at the ends of the step.
    """
    v = (0.5 * (begin.v[0] + end.v[0]), 0.5 * (begin.v[1] + end.v[1]), 0.5 * (begin.v[2] + end.v[2]))
    return math.sqrt(dot(v, v) + 2.0 * min(rotational_energy(body, begin), rotational_energy(body, end)))


@kernel
def after_step(body: Body, rest: Rest, end: BodyMotion, speed: float, stop_speed: float) -> Rest:
    """Return the `Rest` of a body after a step in contact.

    rest : before the step; end : motion after the step; speed : of the body in the step, from `mean_speed` (m/s)
    stop_speed : of the ground (m/s)
    """
    stands = min(rest.stands, end.t) if speed <= STANDS else math.inf
    slow = min(rest.slow, end.t) if speed <= stop_speed else math.inf
    turn = multiply(inverse(rest.q), end.q)
    sine = math.sqrt(turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3])
    if norm(subtract(end.x, rest.x)) + 2.0 * body.reach * sine > body.skin:
        return Rest(stands=stands, slow=slow, held=end.t, x=end.x, q=end.q)
    return Rest(stands=stands, slow=slow, held=rest.held, x=rest.x, q=rest.q)


@kernel
def why_stopped(rest: Rest, t: float) -> int:
    """Return the number of the `Stop` reason for which a body counts as stopped at time t (s), or NOT_STOPPED."""
    if t - rest.stands >= STANDS_FOR:
        return STANDING
    if t - rest.held >= HELD_FOR:
        return HELD
    return CRAWLING if t - rest.slow >= SLOW_FOR else NOT_STOPPED
