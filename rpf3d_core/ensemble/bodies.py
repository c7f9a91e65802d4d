"""Draw at random the shape of each rock and its orientation at the release, for rocks that have shapes."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rpf3d_core.materials.streams import Purpose, uniform
from rpf3d_core.terrain.frame import FloatArray

IntArray = NDArray[np.int64]

WHY_STOPPED = ("standing", "held", "slow", "leaning")
"""Names of the stop reasons of rocks with a shape, as in files, in the order of `simulation.bodies.rest.Stop`."""


@dataclass(frozen=True, eq=False)
class DrawnBody:
    """Rocks with a shape, of one density (kg/m3).

    size : the size of the rocks, a `Rock`, `DrawnRock` or `SourceRocks`; None if each rock has the volume of its shape
    volumes : (K,) m3, volumes of the scene's shapes before they are scaled to the size of a rock
    shares : (K,) running sum of the shapes' weights, whose last value is 1
    """

    density: float
    size: Any
    volumes: FloatArray
    shares: FloatArray


def shape_numbers(body: DrawnBody, seed: int, source: ArrayLike, rocks: IntArray) -> IntArray:
    """Return the number (R,), from 0, of the shape of each rock, drawn at random with the weights of the shapes.

    source : number of the source, one for all rocks or one for each rock (R,); rocks : (R,) numbers of the rocks
    """
    if len(body.volumes) == 1:
        return np.zeros(len(rocks), dtype=np.int64)
    drawn = uniform(seed, source, rocks, Purpose.SHAPE)
    return np.searchsorted(body.shares, drawn, side="right").clip(max=len(body.volumes) - 1).astype(np.int64)


def random_orientations(seed: int, source: ArrayLike, rocks: IntArray) -> FloatArray:
    """Return the orientations (R, 4) of rocks as unit quaternions w, x, y, z, all orientations equally likely.

    source, rocks : as in `shape_numbers`

    Source: Shoemake 1992, Graphics Gems III, "Uniform random rotations".
    """
    purposes = (Purpose.POSE, Purpose.POSE_TURN, Purpose.POSE_TILT)
    share, turn, tilt = (uniform(seed, source, rocks, purpose).tolist() for purpose in purposes)
    return np.array([_orientation(*draws) for draws in zip(share, turn, tilt, strict=True)]).reshape(-1, 4)


def _orientation(share: float, turn: float, tilt: float) -> tuple[float, float, float, float]:
    """Return one random orientation, a quaternion w, x, y, z, from three uniform numbers share, turn, tilt in [0, 1).

    The functions of `math` are used, because the last bits of NumPy's functions may depend on the length of the array.
    """
    low, high = math.sqrt(1.0 - share), math.sqrt(share)
    a, b = 2.0 * math.pi * turn, 2.0 * math.pi * tilt
    return high * math.cos(b), low * math.sin(a), low * math.cos(a), high * math.sin(b)
