"""The motion of a rigid body with its orientation and spin, and its free flight in closed form."""

from typing import Any, NamedTuple

from rpf3d_core.body.clearance import BodySweep
from rpf3d_core.body.quaternions import Quaternion, turned, turned_back
from rpf3d_core.body.rotation import Turning, spin_bound, turned_for, turning_of
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, dot, scale


class Body(NamedTuple):
    """The constants of one rock with a shape.

    shapes : `ShapeTable`, the shapes of the ensemble; shape : number of the rock's shape
    first, last : the rows `first` to `last` - 1 of `shapes.corners` are its corners, for a rock of size 1
    size : radius (m) of the sphere of equal volume, by which corners are multiplied
    moments : principal moments of inertia per unit of mass (m2), ascending
    reach : largest distance of a corner from the centre of mass (m); skin : distance from the ground at which contact
        begins (m)
    """

    shapes: Any
    shape: int
    first: int
    last: int
    size: float
    moments: Vec
    reach: float
    skin: float


class BodyMotion(NamedTuple):
    """The motion of a body at a time t (s).

    x, v : (3,) m and m/s, position and velocity of the centre of mass, in the axes of the terrain (space)
    q : orientation, a quaternion from the body's axes to space; w : (3,) rad/s, spin in the body's axes
    """

    t: float
    x: Vec
    v: Vec
    q: Quaternion
    w: Vec


class FreeFlight(NamedTuple):
    """A free flight of a body.

    start : motion at the beginning; turning : constants of the rotation; gravity : m/s2
    spin : speed of rotation (rad/s) that the body never exceeds
    """

    start: BodyMotion
    turning: Turning
    gravity: float
    spin: float


SKIN = 4e-3
"""Largest distance from the ground at which contact may begin, divided by the body's reach (-)."""


@kernel
def body_of(model: Any, shape: int, radius: float) -> Body:
    """Return the constants of one rock with a shape.

    model : `RigidBody`; shape : number of the rock's shape; radius : of the sphere of equal volume (m)
    """
    shapes = model.shapes
    reach, square = shapes.reach[shape] * radius, radius * radius
    moments = (
        square * shapes.moments[shape, 0],
        square * shapes.moments[shape, 1],
        square * shapes.moments[shape, 2],
    )
    return Body(
        shapes=shapes,
        shape=shape,
        first=shapes.first[shape],
        last=shapes.first[shape + 1],
        size=radius,
        moments=moments,
        reach=reach,
        skin=min(model.accuracy, SKIN * reach),
    )


@kernel
def flight_of(body: Body, motion: BodyMotion, gravity: float) -> FreeFlight:
    """Return the free flight of a body that begins with a motion; gravity : m/s2."""
    turning = turning_of(body.moments, motion.q, motion.w)
    return FreeFlight(start=motion, turning=turning, gravity=gravity, spin=spin_bound(turning))


@kernel
def motion_after(flight: FreeFlight, t: float) -> BodyMotion:
    """Return the motion after t seconds of a free flight."""
    start, g = flight.start, flight.gravity
    q, w = turned_for(flight.turning, t)
    x, v = start.x, start.v
    return BodyMotion(
        t=start.t + t,
        x=(x[0] + t * v[0], x[1] + t * v[1], x[2] + t * (v[2] - 0.5 * g * t)),
        v=(v[0], v[1], v[2] - g * t),
        q=q,
        w=w,
    )


@kernel
def sweep_of(flight: FreeFlight, motion: BodyMotion) -> BodySweep:
    """Return the part of a free flight that begins with `motion`, in the form that the search for contacts reads."""
    return BodySweep(
        x=motion.x,
        v=motion.v,
        w=turned(motion.q, motion.w),
        q=motion.q,
        gravity=flight.gravity,
        spin_bound=flight.spin,
    )


@kernel
def corner_acceleration(body: Body, motion: BodyMotion, arm: Vec, down: Vec) -> Vec:
    """Return the acceleration (3,) m/s2 of a point of a body in free flight, in the body's axes.

    arm : position of the point relative to the centre of mass (m); down : gravity (m/s2); both (3,) in the body's axes
    """
    w, m = motion.w, body.moments
    turning = (
        (m[1] - m[2]) / m[0] * w[1] * w[2],
        (m[2] - m[0]) / m[1] * w[2] * w[0],
        (m[0] - m[1]) / m[2] * w[0] * w[1],
    )
    inward = add(scale(dot(w, arm), w), scale(-dot(w, w), arm))
    return (
        down[0] + inward[0] + turning[1] * arm[2] - turning[2] * arm[1],
        down[1] + inward[1] + turning[2] * arm[0] - turning[0] * arm[2],
        down[2] + inward[2] + turning[0] * arm[1] - turning[1] * arm[0],
    )


@kernel
def kinetic_energy(body: Body, motion: BodyMotion) -> float:
    """Return the kinetic energy of a body per unit of mass (J/kg)."""
    return 0.5 * dot(motion.v, motion.v) + rotational_energy(body, motion)


@kernel
def rotational_energy(body: Body, motion: BodyMotion) -> float:
    """Return the energy of rotation of a body per unit of mass (J/kg)."""
    m, w = body.moments, motion.w
    return 0.5 * (m[0] * w[0] * w[0] + m[1] * w[1] * w[1] + m[2] * w[2] * w[2])


@kernel
def place_of(motion: BodyMotion, arm: Vec) -> Vec:
    """Return the position (3,) m of a point of a body in the terrain's axes.

    arm : (3,) m, position of the point relative to the centre of mass, in the body's axes
    """
    return add(motion.x, turned(motion.q, arm))


@kernel
def in_body(motion: BodyMotion, p: Vec) -> Vec:
    """Return the position (3,) m of a point relative to the centre of mass, in the body's axes.

    p : (3,) m, position of the point in the terrain's axes
    """
    x = motion.x
    return turned_back(motion.q, (p[0] - x[0], p[1] - x[1], p[2] - x[2]))
