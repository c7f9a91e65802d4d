"""Convert the orientations and shapes of bodies for the files of a run.

A body's axes are its principal axes through the centre of mass, in the order of ascending moments of inertia. A
quaternion w, x, y, z turns a vector from these axes into the axes of the input, in which all positions are written.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rpf3d_core.ensemble.flights import Deposits, FloatArray
from rpf3d_core.terrain.frame import Frame

if TYPE_CHECKING:
    from rpf3d_core.shapes.polyhedron import Polyhedron

HALF = math.sqrt(0.5)
"""Cosine and sine of 45 degrees, half the turn from the local axes to the axes of an input whose y points up."""


def orientations_to_input(frame: Frame, q: FloatArray) -> FloatArray:
    """Return orientations (N, 4) w, x, y, z of bodies relative to the input's axes.

    If the input's y is up, a vector with the local components (x, y, z) has the components (x, z, -y) along the input's
    axes: each orientation is turned by -90 degrees about x. If z is up, the orientations stay the same.

    q : (N, 4) orientations w, x, y, z of the bodies relative to the local axes
    """
    if frame.up == "z":
        return q
    w, x, y, z = q.T
    return np.stack([HALF * (w + x), HALF * (x - w), HALF * (y + z), HALF * (z - y)], axis=1)


def blocks_of(scene: Any, deposits: Deposits) -> "list[Polyhedron]":
    """Return the shapes of a run's rocks, in the order of the shapes' numbers; empty for points and spheres.

    scene : the `Scene` of the run

    Raises
    ------
    InputError
        The file of a shape has been removed or damaged since the run began.
    """
    if deposits.pose is None:
        return []
    from rpf3d_core.setup.shapes import polyhedra_of  # the process that draws loads no scene

    return polyhedra_of(scene)[0]


def moments_of(blocks: "Sequence[Polyhedron]", deposits: Deposits) -> FloatArray | None:
    """Return the principal moments of inertia (R, 3) of each rock's shape per unit of mass (m^2); None without shapes.

    The moments belong to the shape at the size in its file, not at the size of the rock. This is enough, because the
    rotation of a rock depends only on the ratios of the moments.

    blocks : the shapes, from `blocks_of`
    """
    if deposits.shape is None:
        return None
    return np.array([block.moments for block in blocks])[deposits.shape]
