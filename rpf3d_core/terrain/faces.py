"""Faces: steep stretches of the ground along a line, as bench faces are."""

import math
from typing import NamedTuple

import numpy as np

from rpf3d_core.terrain.frame import FloatArray

STEEP = 45.0
"""Slope (degrees) from which the ground counts as a face; bench faces have 55 to 85, catch benches below 15."""
FLAT = 1.0
"""Length (m) of less steep ground that ends a face."""
LOWEST = 3.0
"""Least height (m) of a face; lower steps are rocks, ruts or noise of the survey."""


class Face(NamedTuple):
    """A face on a line: distances (m) of its brow and of its foot, and its height (m)."""

    brow: float
    foot: float
    height: float


def first_face(distance: FloatArray, ground: FloatArray) -> Face | None:
    """Return the first face that falls along a line; None without a face, or if the line ends on it.

    distance, ground : (S,) m, rising distances; NaN for ground that is not known

    A face is at least LOWEST high. It may contain ledges up to FLAT long.
    """
    with np.errstate(invalid="ignore"):
        steep = np.flatnonzero(np.diff(ground) < -np.diff(distance) * math.tan(math.radians(STEEP)))
    ends = np.flatnonzero(distance[steep[1:]] - distance[steep[:-1] + 1] > FLAT)
    firsts, lasts = steep[np.append(0, ends + 1)[: len(steep)]], steep[np.append(ends, len(steep) - 1)[: len(steep)]]
    for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True):
        height = float(ground[first] - ground[last + 1])
        if height >= LOWEST:
            face = Face(brow=float(distance[first]), foot=float(distance[last + 1]), height=height)
            return face if last + 2 < len(distance) else None
    return None


def foot_of_face(distance: FloatArray, ground: FloatArray) -> float:
    """Return the distance (m) of the foot of the first face along a line (`first_face`); NaN if there is no face.

    distance, ground : (S,) m
    """
    face = first_face(distance, ground)
    return math.nan if face is None else face.foot
