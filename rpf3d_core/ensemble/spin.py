"""Compute the rotational and the total kinetic energy of spinning rocks from the rocks' records."""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.simulation.record import BLOW, IMPACT_COLUMNS, PIECE_COLUMNS, POSE
from rpf3d_core.values import SPHERE_INERTIA_RATIO


def rotational_energy(mass: FloatArray, radius: FloatArray, w: FloatArray) -> FloatArray:
    """Return the rotational energy (N,) J of spheres, I w^2 / 2 with I = 2/5 m R^2.

    mass : (N,) kg; radius : (N,) m; w : (N,) rad/s, spins
    """
    return np.asarray(0.5 * SPHERE_INERTIA_RATIO * mass * (radius * w) ** 2)


def largest_energies(batch: Batch, mass: FloatArray, radius: FloatArray) -> FloatArray:
    """Return the largest rotational and the largest total energy (N, 2) J of each of N rocks on its whole path.

    Both maxima are at the ends of path segments: in flight the rotational energy is constant, on a slide w^2, the
    square of the spin, is convex in time.

    batch : rocks that spin, with their complete paths; mass : (N,) kg; radius : (N,) m
    """
    owner = np.repeat(np.arange(len(batch.rows)), np.diff(batch.first[:, 1]))
    rows, most = batch.pieces, np.zeros((len(batch.rows), 2))
    most[:, 1] = 0.5 * mass * batch.finals[:, 5] ** 2  # energy of the largest speed: the total is never below it
    for k in range(2):
        if has_poses(rows):
            spin = mass[owner] * rows[:, POSE + 7]
        else:
            spin = rotational_energy(mass[owner], radius[owner], rows[:, PIECE_COLUMNS + k])
        speed2 = (rows[:, 4 + 3 * k : 7 + 3 * k] ** 2).sum(axis=1)
        for column, energy in enumerate((spin, 0.5 * mass[owner] * speed2 + spin)):
            np.maximum.at(most[:, column], owner, energy)
    return most


def has_poses(pieces: FloatArray) -> bool:
    """Return True if path segments have columns for orientation and energy, as only rocks with a shape have.

    pieces : (S, C) path segments, as in `WrittenRecords`
    """
    return bool(pieces.shape[1] > POSE)


class Spins(NamedTuple):
    """The rotation of rocks as squared speeds (m^2/s^2), which are added to v^2 in the kinetic energy.

    The squared speed of a sphere is 2/5 (R w)^2. For rocks with a shape, it is twice the rotational energy per mass.

    pieces : (S, 2) at the start and at the end of each path segment; impacts : (I,) just before each impact
    """

    pieces: Any
    impacts: Any


def spins_squared(batch: Batch, radius: FloatArray) -> Spins:
    """Return the squared speeds (m^2/s^2) due to spin for all recorded segments and impacts of N rocks.

    radius : (N,) m
    """
    if batch.pieces.shape[1] == PIECE_COLUMNS:
        return Spins(np.zeros((len(batch.pieces), 2)), np.zeros(len(batch.impacts)))
    if has_poses(batch.pieces):
        spin, before = 2.0 * batch.pieces[:, POSE + 7], batch.impacts
        return Spins(np.stack([spin, spin], axis=1), np.maximum(2.0 * before[:, BLOW + 1] - before[:, 7] ** 2, 0.0))
    struck, moved = (np.repeat(radius, np.diff(batch.first[:, k])) for k in range(2))
    pieces = SPHERE_INERTIA_RATIO * (moved[:, None] * batch.pieces[:, PIECE_COLUMNS:]) ** 2
    return Spins(pieces, SPHERE_INERTIA_RATIO * (struck * batch.impacts[:, IMPACT_COLUMNS]) ** 2)
