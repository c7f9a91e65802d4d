"""The contact of a block with a plane, from its first impact until it flies again.

A block that strikes the ground with a corner turns about this corner, and often strikes with others soon after. A
figure of the field "after an impact" is that of the next flight. So the block is followed in short steps over the
plane, with the impact law of the package (`rpf3d_core.body.impact`), until it has flown for `CLEAR`.
"""

from typing import NamedTuple

import numpy as np

from rpf3d_core.body.contacts import (
    ARM,
    CONTACT_COLUMNS,
    MU,
    NORMAL,
    RESTITUTION,
    ROLLING,
    SOLVER_COLUMNS,
    fastest,
    put,
    vector,
)
from rpf3d_core.body.impact import impact
from rpf3d_core.body.inelastic import Velocity
from rpf3d_core.body.quaternions import multiply, normalised, turn_by, turned, turned_back
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.shapes.polyhedron import Polyhedron
from rpf3d_core.values import STANDARD_GRAVITY
from rpf3d_core.vectors import add, dot, scale

STEP = 5e-4
"""s; a corner at 10 m/s moves 5 mm in it."""
CLEAR = 0.05
"""s of flight after which a contact has ended; the jumps of the published impacts take 0.4 to 2 s."""
LONGEST = 0.1
"""s from the first impact to the end of a contact, at most.

Scars of four impacts of the 780 kg block are 1.40, 1.80, 1.55 and 1.52 m long, at speeds of 19.2, 17.5, 16.9 and
17.4 m/s: 0.07 to 0.10 s (Lu et al. 2019, table 2).
"""
TOUCHING = 1e-3
"""m, height below which a corner touches the plane."""
SLOW = 0.05
"""m/s, approach below which an impact is inelastic."""
MOST = 8
"""Largest number of contacts at a time."""


class Law(NamedTuple):
    """The ground's three numbers (-)."""

    restitution: float
    friction: float
    rolling_resistance: float


def after_contact(shape: Polyhedron, starts: FloatArray, normals: FloatArray, law: Law) -> FloatArray:
    """Return the velocity (m/s) of N blocks after contact with planes, and when each contact ended (s), (N, 4).

    The velocity is that right after the last impact.

    shape : of all blocks, in its own size
    starts : (N, 10) velocity (m/s) and spin (rad/s) before the first impact, in space, and orientation w, x, y, z
    normals : (N, 3) unit normals of the planes, which each block touches with its lowest corner; z is up
    """
    out = np.empty((len(starts), 4))
    points, rows = np.zeros((MOST, CONTACT_COLUMNS)), np.zeros((MOST, SOLVER_COLUMNS))
    radius = float(np.cbrt(shape.volume / (4.0 / 3.0 * np.pi)))
    e, mu, rolling = (float(value) for value in law)
    _strike(shape.corners, shape.moments, np.ascontiguousarray(starts), np.ascontiguousarray(normals),
            np.array([e, mu, rolling * radius]), points, rows, out)  # fmt: skip
    return out


@loop
def _strike(corners, moments, starts, normals, law, points, rows, out):
    """Follow each block until its contact has ended, and write its row of `out`."""
    m = (moments[0], moments[1], moments[2])
    for i in range(len(starts)):
        n = vector(normals[i], 0)
        v, w = vector(starts[i], 0), vector(starts[i], 3)
        q = (starts[i, 6], starts[i, 7], starts[i, 8], starts[i, 9])
        w = turned_back(q, w)
        height = -_lowest(corners, q, n)
        time, last = 0.0, 0.0
        put(out[i], 0, v)
        while time < LONGEST and time - last < CLEAR:
            count = _touching(corners, q, n, height, law, points)
            body = Velocity(turned_back(q, v), w)
            if count > 0 and fastest(points, count, body.v, body.w)[1] >= 0:
                body = impact(points, rows, count, m, body, SLOW)
                v, w, last = turned(q, body.v), body.w, time
                put(out[i], 0, v)
            v = (v[0], v[1], v[2] - STANDARD_GRAVITY * STEP)
            height += STEP * dot(n, v)
            w = _free_spin(m, w)
            q = normalised(multiply(q, turn_by(scale(STEP, w))))
            time += STEP
        out[i, 3] = last


@kernel
def _lowest(corners, q, n):
    """Return the least coordinate (m) of a block's corners along a direction n (3,), from the centre of mass."""
    least = 0.0
    for k in range(len(corners)):
        least = min(least, dot(n, turned(q, vector(corners[k], 0))))
    return least


@kernel
def _touching(corners, q, n, height, law, points):
    """Fill the rows of the corners that touch the plane; return their number. height : of the centre of mass (m)."""
    count = 0
    down = turned_back(q, n)
    for k in range(len(corners)):
        arm = vector(corners[k], 0)
        if count < MOST and height + dot(down, arm) <= TOUCHING:
            put(points[count], ARM, arm)
            put(points[count], NORMAL, down)
            points[count, RESTITUTION], points[count, MU], points[count, ROLLING] = law[0], law[1], law[2]
            count += 1
    return count


@kernel
def _free_spin(m, w):
    """Return the spin (rad/s) of a free block after a step, in its own axes: Euler's equations, by the midpoint."""
    half = add(w, scale(0.5 * STEP, _spin_change(m, w)))
    return add(w, scale(STEP, _spin_change(m, half)))


@kernel
def _spin_change(m, w):
    """Return the change of the spin (rad/s2) of a free block with principal moments m (m2)."""
    return (
        (m[1] - m[2]) / m[0] * w[1] * w[2],
        (m[2] - m[0]) / m[1] * w[2] * w[0],
        (m[0] - m[1]) / m[2] * w[0] * w[1],
    )
