"""How a sphere moves until its next contact, and the contact itself."""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, scale


class Course(NamedTuple):
    """A sphere whose centre moves with constant acceleration: what the search for its contacts needs.

    x, v, a : place (3,) m and velocity (3,) m/s at the start, and acceleration (3,) m/s^2
    radius : of the sphere (m); gravity : m/s^2, accelerations that are tiny relative to it count as rounding
    """

    x: Vec
    v: Vec
    a: Vec
    radius: float
    gravity: float


class Touch(NamedTuple):
    """The contact of a sphere with a facet after t seconds (inf: none), with the speed `approach` (m/s) into the facet.

    In the result of a search (`touching.py`), t may also be a distance, or the component of a vector.

    facet : number of the facet, -1 for none
    n : (3,) unit, from the point of contact to the centre; along : (3,) unit, along the touched edge, else zero
    face : True if the sphere touches the interior of the facet, False for an edge or a corner
    """

    t: float
    facet: int
    approach: float
    n: Vec
    along: Vec
    face: bool


NO_TOUCH = Touch(t=math.inf, facet=-1, approach=0.0, n=(0.0, 0.0, 1.0), along=ZERO, face=False)


@kernel
def course_position(course: Course, t: float) -> Vec:
    """Return the position of the sphere's centre (m), t seconds after the start of its motion."""
    return add(course.x, scale(t, add(course.v, scale(0.5 * t, course.a))))


@kernel
def course_velocity(course: Course, t: float) -> Vec:
    """Return the velocity of the sphere's centre (m/s), t seconds after the start of its motion."""
    return add(course.v, scale(t, course.a))


@kernel
def sooner(best: Touch, other: Touch) -> Touch:
    """Return the earlier of two contacts of a sphere.

    At equal times, the contact with the larger `approach` counts, then the larger components of the normal, then the
    smaller facet number.
    """
    if other.t != best.t:
        return other if other.t < best.t else best
    if other.approach != best.approach:
        return other if other.approach > best.approach else best
    for k in range(3):
        if other.n[k] != best.n[k]:
            return other if other.n[k] > best.n[k] else best
    return other if other.facet < best.facet else best
