"""Make random bodies in contact as arrays for the solver of impacts, and solve the impacts of many bodies at once."""

from typing import Any, NamedTuple

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
)
from rpf3d_core.body.impact import impact, sustained
from rpf3d_core.body.inelastic import Velocity, inelastic, kinetic
from rpf3d_core.jit.dispatch import kernel, loop

MOST = 8
"""Largest number of contacts of a body."""
AFTER_V, AFTER_W, BEFORE, AFTER, LEFT = 0, 3, 6, 7, 8
"""First columns in a row of results: velocity (3, m/s) and spin (3, rad/s) after the impact, energy before and after.

The energies are kinetic (J/kg). LEFT is the largest remaining speed of approach at a contact (m/s).
"""


class Bodies(NamedTuple):
    """N bodies in contact, in their own axes.

    points : (N, MOST, CONTACT_COLUMNS) contacts; counts : (N,) number of contacts
    moments : (N, 3) m2, principal moments of inertia per unit of mass, ascending
    motion : (N, 6) velocity (m/s) and spin (rad/s)
    """

    points: np.ndarray
    counts: np.ndarray
    moments: np.ndarray
    motion: np.ndarray

    def part(self, chosen: Any) -> "Bodies":
        """Return copies of some of the bodies; chosen : index of the rows."""
        return Bodies(*(np.ascontiguousarray(column[chosen]).copy() for column in self))


class Ground(NamedTuple):
    """Coefficients of random contacts.

    mu : largest friction (-); e : restitution (-) of all contacts; rolling : largest rolling resistance (m)
    """

    mu: float
    e: float
    rolling: float


def unit(a: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) scaled to length 1."""
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def random_moments(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return principal moments (N, 3) m2 of random ellipsoids with half-axes of 0.05 to 1 m, ascending."""
    squares = rng.uniform(0.05, 1.0, (count, 3)) ** 2
    return np.sort((squares.sum(1, keepdims=True) - squares) / 5.0, axis=1)


def without_contacts(rng: np.random.Generator, count: int, moments: np.ndarray) -> Bodies:
    """Return `count` bodies with principal moments (N, 3) m2, random motions, and no contacts."""
    points = np.zeros((count, MOST, CONTACT_COLUMNS))
    return Bodies(points, np.zeros(count, dtype=np.int64), moments, 5.0 * rng.normal(size=(count, 6)))


def give_ground(rng: np.random.Generator, bodies: Bodies, ground: Ground) -> Bodies:
    """Set the coefficients of all contacts in place, and return the bodies.

    Friction and rolling resistance are random, up to the values of the ground; restitution is that of the ground.
    """
    shape = bodies.points.shape[:2]
    bodies.points[:, :, MU] = rng.uniform(0.0, ground.mu, shape)
    bodies.points[:, :, ROLLING] = ground.rolling * rng.uniform(0.0, 1.0, shape)
    bodies.points[:, :, RESTITUTION] = ground.e
    return bodies


def random_contacts(rng: np.random.Generator, count: int, most: int, ground: Ground) -> Bodies:
    """Return `count` bodies with 1 to `most` contacts at random points, with normals roughly towards the centre."""
    bodies = without_contacts(rng, count, random_moments(rng, count))
    arms = 0.4 * rng.normal(size=(count, MOST, 3))
    bodies.points[:, :, ARM : ARM + 3] = arms
    bodies.points[:, :, NORMAL : NORMAL + 3] = unit(0.5 * rng.normal(size=arms.shape) - unit(arms))
    bodies.counts[:] = rng.integers(1, most + 1, count)
    return give_ground(rng, bodies, ground)


def boxes_on_faces(rng: np.random.Generator, count: int, ground: Ground, tilt: float = 0.0) -> Bodies:
    """Return `count` random boxes that touch planes with the four corners of a random face.

    tilt : upper bound (rad) of the angles between the normals of the four contacts and the normal of the face
    """
    half = rng.uniform(0.2, 1.0, (count, 3))
    half = -np.sort(-half, axis=1)  # the longest side has the least moment
    squares = half * half
    bodies = without_contacts(rng, count, (squares.sum(1, keepdims=True) - squares) / 3.0)
    rows = np.arange(count)
    axis, side = rng.integers(0, 3, count), rng.choice([-1.0, 1.0], count)
    for k, (a, b) in enumerate(((1, 1), (1, -1), (-1, -1), (-1, 1))):
        signs = np.empty((count, 3))
        signs[rows, axis], signs[rows, (axis + 1) % 3], signs[rows, (axis + 2) % 3] = side, a, b
        bodies.points[:, k, ARM : ARM + 3] = signs * half
        n = np.zeros((count, 3))
        n[rows, axis] = -side
        bodies.points[:, k, NORMAL : NORMAL + 3] = unit(n + np.tan(tilt) * rng.uniform(-0.5, 0.5, (count, 3)))
    bodies.counts[:] = 4
    return give_ground(rng, bodies, ground)


# --- impacts ----------------------------------------------------------------------------------------------------------


@kernel
def before_of(motion, moments):
    """Return the velocity and spin of a body before its impact as a `Velocity`, and its principal moments (3,) m2."""
    velocity = Velocity((motion[0], motion[1], motion[2]), (motion[3], motion[4], motion[5]))
    return velocity, (moments[0], moments[1], moments[2])


@kernel
def note(row, points, count, moments, before, after):
    """Write the result of an impact into a row: motion afterwards, energies, largest remaining speed of approach."""
    put(row, AFTER_V, after.v)
    put(row, AFTER_W, after.w)
    row[BEFORE], row[AFTER] = kinetic(before, moments), kinetic(after, moments)
    row[LEFT] = fastest(points, count, after.v, after.w)[0]


@loop
def strike(points, rows, counts, moments, motion, slow, out):
    """Solve the impact of each body, and write the result into its row of `out`; slow : argument of `impact` (m/s)."""
    for i in range(len(counts)):
        before, of = before_of(motion[i], moments[i])
        after = impact(points[i], rows, counts[i], of, before, slow)
        note(out[i], points[i], counts[i], of, before, after)


@loop
def stop(points, rows, counts, moments, motion, within, out):
    """Solve the inelastic impact of each body by `inelastic` alone, and write the result into its row of `out`.

    The restitution and the checks of `impact` are left out. within : argument of `inelastic` (m/s)
    """
    for i in range(len(counts)):
        before, of = before_of(motion[i], moments[i])
        after = inelastic(points[i], rows, counts[i], of, before, within)
        note(out[i], points[i], counts[i], of, before, after)


@loop
def hold(points, rows, counts, moments, motion, within, out):
    """Solve the sustained contact of each body, and write the result into its row of `out`.

    within : argument of `sustained` (m/s)
    """
    for i in range(len(counts)):
        before, of = before_of(motion[i], moments[i])
        after = sustained(points[i], rows, counts[i], of, before, within)
        note(out[i], points[i], counts[i], of, before, after)


def results_of(bodies: Bodies, solve: Any, threshold: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the results (N, 9) of the impacts, and the contacts (N, MOST, CONTACT_COLUMNS) with their impulses.

    solve : `strike`, `stop` or `hold`, or the Python function of one of them (`py_func`)
    threshold : value of its argument `slow` or `within` (m/s)
    """
    out, points = np.zeros((len(bodies.counts), 9)), bodies.points.copy()
    rows = np.zeros((MOST, SOLVER_COLUMNS))
    solve(points, rows, bodies.counts, bodies.moments, bodies.motion, threshold, out)
    return out, points
