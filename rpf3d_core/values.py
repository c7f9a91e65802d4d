"""Immutable values that the whole package shares: the motion of a rock, its mass and radius, and its outcome.

SI units, z up, right-handed, in the terrain's local frame (`terrain/frame.py`).
"""

from enum import IntEnum
from typing import NamedTuple

Vec = tuple[float, float, float]

ZERO: Vec = (0.0, 0.0, 0.0)
STANDARD_GRAVITY = 9.81
"""Default gravity (m/s^2) of a scene; the published test cases use the same value."""


SPHERE_INERTIA_RATIO = 0.4
"""Moment of inertia I of a solid sphere with mass m and radius R, as I / (m R^2) (-)."""


class Motion(NamedTuple):
    """The place and movement of a rock at a time: t (s), position x (3,) m, velocity v (3,) m/s, spin w (3,) rad/s."""

    t: float
    x: Vec
    v: Vec
    w: Vec


class Rock(NamedTuple):
    """A rock: its mass (kg) and the radius (m) of the sphere of equal volume."""

    mass: float
    radius: float


class Outcome(IntEnum):
    """How the flight of a rock ended; every rock has exactly one outcome, explained in `OUTCOME_SENTENCES`."""

    STOPPED = 0
    LEFT_TERRAIN = 1
    CAUGHT = 2
    FRAGMENTED = 3
    MAX_TIME = 4
    MAX_IMPACTS = 5
    UNRESOLVED_CONTACT = 6
    FAILED = 7
    LOST_TO_HOLE = 8
    FELL_THROUGH = 9


MOVING = -1
"""Value in place of an outcome while a rock is still moving."""

OUTCOME_SENTENCES: dict[Outcome, str] = {
    Outcome.STOPPED: "stopped on the ground",
    Outcome.LEFT_TERRAIN: "flew past the edge of the terrain",
    Outcome.CAUGHT: "was caught by a barrier",
    Outcome.FRAGMENTED: "broke; its fragments fly on as separate rocks",
    Outcome.MAX_TIME: "was still moving at max_time; raise max_time to follow it further",
    Outcome.MAX_IMPACTS: (
        "reached max_impacts (impacts and slides over facets; or as many path segments in air so dense that the rock "
        "sinks very slowly); raise max_impacts to follow it further"
    ),
    Outcome.UNRESOLVED_CONTACT: (
        "was faster than stop_speed when its bounces had died out, and `ground: none` has no motion on the ground (use "
        "`ground: sliding`, for a sphere `ground: sphere`); or it was wedged between facets at a speed that should "
        "have freed it; or there is no room for its shape at its release and above"
    ),
    Outcome.FAILED: (
        "reached a position or speed that is not a number; its results end with the event before, it counts in no "
        "map, and rpf3d_core.replay flies it again by its source and number"
    ),
    Outcome.LOST_TO_HOLE: (
        "fell through a hole in the terrain; it is followed to the level of the ground around the hole and no further"
    ),
    Outcome.FELL_THROUGH: (
        "was found below ground that has no hole: a fault of this program; its results end where it last was on the "
        "ground, and rpf3d_core.replay flies it again by its source and number"
    ),
}

DEPOSITED = (Outcome.STOPPED, Outcome.CAUGHT)
"""The outcomes of deposits: rocks that lie on the terrain in the end."""
UNSTOPPED = tuple(outcome for outcome in Outcome if outcome not in (*DEPOSITED, Outcome.FRAGMENTED))
"""The outcomes of rocks that did not stop on the terrain.

FRAGMENTED does not belong here, because each fragment of a broken rock has its own outcome.
"""


class Mode(IntEnum):
    """Kind of motion of a rock between two events of its path; each row of a path stores this number.

    FLIGHT : free flight; SETTLING : the last small bounces, summed up
    SLIDING : sliding or rolling; for a body with a shape, a time step in contact with the ground
    END : no motion; the row marks the end of the path
    """

    FLIGHT = 0
    SETTLING = 1
    SLIDING = 2
    END = 3
