"""Measure end points of rocks along one direction, to compare simulated with observed end points."""

from collections.abc import Callable

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.scene.model import ObservedSpec
from rpf3d_core.terrain.frame import FloatArray, Frame, Up


def position_along(observed: ObservedSpec, frame: Frame) -> Callable[[FloatArray], FloatArray]:
    """Return the function that measures the positions of end points along `observed.along`, the scene's direction.

    The function takes points (N, 3) m in the local frame, and returns positions (N,) m along the horizontal part of the
    direction. Positions are measured from the local origin, because `ensemble.samples.Sample` rounds large numbers
    more coarsely: positions from the origin of the input could be wrong by metres.
    """
    along = horizontal_direction(observed.along, frame.up)
    return lambda x: np.asarray(frame.directions_to_input(x) @ along)


def horizontal_direction(along: tuple[float, float, float], up: Up) -> FloatArray:
    """Return the horizontal part of a direction as a unit vector (3,) in the input's axes.

    along : the direction, any length; up : the axis that points up in the input

    Raises
    ------
    InputError
        The direction is vertical.
    """
    vertical = 2 if up == "z" else 1
    flat = np.array([0.0 if axis == vertical else value for axis, value in enumerate(along)])
    length = float(np.linalg.norm(flat))
    if length == 0.0:
        raise InputError(f"`observed.along` is {list(along)}, which is vertical; it must have a horizontal part")
    return flat / length
