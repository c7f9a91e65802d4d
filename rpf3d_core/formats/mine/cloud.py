"""The content of a file of points without triangles (a cloud), as all readers of clouds return it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray


class Cloud(NamedTuple):
    """The points of a cloud, in the coordinates of its file.

    points : (N, 3) m
    classes : (N,) class of each point, as in LAS files; None if the file has no classes
    single : True if the file stores coordinates in single precision
    remarks : sentences on content of the file that was not read
    crs : the coordinate reference system that the file states; None if it states none
    """

    points: FloatArray
    classes: NDArray[np.uint8] | None = None
    single: bool = False
    remarks: tuple[str, ...] = ()
    crs: str | None = None


MOST_POINTS = 500_000_000
"""Largest number of points of a cloud; they take 12 GB of memory."""
