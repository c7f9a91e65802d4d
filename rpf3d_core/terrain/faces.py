"""Find faces along a line: steep parts of the ground, such as bench faces."""

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
    """A face that a line in plan crosses.

    brow, foot : m, distance along the line at the upper edge and at the foot of the face; height : m, of the face
    """

    brow: float
    foot: float
    height: float


def first_face(distance: FloatArray, ground: FloatArray) -> Face | None:
    """Return the first face where the ground falls along a line; None if no face lies between the ends of the line.

    distance : (S,) m, ascending distances along the line; ground : (S,) m, height of the ground there, NaN if unknown

    A face is steeper than STEEP (degrees) and at least LOWEST (m) high. A face may contain less steep parts (ledges) up
    to FLAT (m) long. If the first face extends to the last point, the result is None.
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
    """Return the distance (m) of the foot of the first face along a line; NaN if `first_face` finds no face.

    distance : (S,) m, ascending distances along the line; ground : (S,) m, height of the ground there, NaN if unknown
    """
    face = first_face(distance, ground)
    return math.nan if face is None else face.foot
