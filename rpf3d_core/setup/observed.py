"""The direction along which simulated and observed end points are compared."""

from collections.abc import Callable

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.scene.model import ObservedSpec
from rpf3d_core.terrain.frame import FloatArray, Frame, Up


def position_along(observed: ObservedSpec, frame: Frame) -> Callable[[FloatArray], FloatArray]:
    """Return a function that gives the positions (N,) m of local points (N, 3) along the direction of comparison.

    Positions are measured from the local origin, not in the input's coordinates, because very many positions are stored
    rounded.
    """
    along = horizontal_direction(observed.along, frame.up)
    return lambda x: np.asarray(frame.directions_to_input(x) @ along)


def horizontal_direction(along: tuple[float, float, float], up: Up) -> FloatArray:
    """Return the unit vector (3,) of the horizontal part of a direction in the input's axes."""
    vertical = 2 if up == "z" else 1
    flat = np.array([0.0 if axis == vertical else value for axis, value in enumerate(along)])
    length = float(np.linalg.norm(flat))
    if length == 0.0:
        raise InputError(f"`observed.along` is {list(along)}, which is vertical; it must have a horizontal part")
    return flat / length
