"""The shapes of real blocks: scanned hulls, also in the masses and proportions of the blocks that fell."""

from collections.abc import Sequence

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.shapes.families import family
from rpf3d_core.shapes.polyhedron import Polyhedron, polyhedron_of, scaled_to_volume

DENSITY = 2700.0
"""kg/m3, as in the scenes of both sites."""


def lengths_of(shape: Polyhedron) -> FloatArray:
    """Return the extents (3,) m of a shape along its principal axes, the longest first."""
    return -np.sort(-np.ptp(shape.corners, axis=0))


def stretched(shape: Polyhedron, lengths: Sequence[float], mass: float) -> Polyhedron:
    """Return a shape stretched to the proportions of three lengths (m), and scaled to a mass (kg) at `DENSITY`.

    The longest extent of the shape gets the longest length. Lengths and mass of a real block fit no hull exactly; the
    mass decides the size, because it was weighed to 20 kg and the lengths were measured to 0.1 m.
    """
    extents = np.ptp(shape.corners, axis=0)
    factors = np.empty(3)
    factors[np.argsort(-extents)] = -np.sort(-np.asarray(lengths)) / -np.sort(-extents)
    return of_mass(polyhedron_of(shape.corners * factors, shape.name), mass)


def of_mass(shape: Polyhedron, mass: float) -> Polyhedron:
    """Return a shape scaled to a mass (kg) at `DENSITY`."""
    return scaled_to_volume(shape, mass / DENSITY)


def equant(lengths: Sequence[float], mass: float) -> Polyhedron:
    """Return the ideal equant body, stretched to the proportions of three lengths (m) and scaled to a mass (kg)."""
    return stretched(family("equant"), lengths, mass)
