"""The local frame: the input's coordinates with z turned up, relative to an origin.

Survey coordinates are large (5e5, 4.5e6). The origin is subtracted when the terrain is read, which keeps float64
rounding near 1e-13 m instead of 1e-9 m (docs/explanation/physics.md).
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Up = Literal["y", "z"]
FloatArray = NDArray[np.float64]


class Frame(NamedTuple):
    """The local frame of a terrain: converts between the input's coordinates and local coordinates.

    origin : (3,) m, of the local frame, in the input's coordinates with z turned up; up : axis that points up in the
        input, "y" or "z"
    """

    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    up: Up = "z"

    def directions_to_local(self, vectors: ArrayLike) -> FloatArray:
        """Convert directions (..., 3) from the input's axes to the local axes, in which z points up."""
        v = np.asarray(vectors, dtype=float)
        return v if self.up == "z" else np.stack([v[..., 0], -v[..., 2], v[..., 1]], axis=-1)

    def directions_to_input(self, vectors: ArrayLike) -> FloatArray:
        """Convert directions (..., 3) from the local axes to the input's axes."""
        v = np.asarray(vectors, dtype=float)
        return v if self.up == "z" else np.stack([v[..., 0], v[..., 2], -v[..., 1]], axis=-1)

    def points_to_local(self, points: ArrayLike) -> FloatArray:
        """Convert points (..., 3) m from the input's coordinates to local coordinates."""
        local: FloatArray = self.directions_to_local(points) - np.array(self.origin)
        return local

    def points_to_input(self, points: ArrayLike) -> FloatArray:
        """Convert points (..., 3) m from local coordinates to the input's coordinates."""
        return self.directions_to_input(np.asarray(points, dtype=float) + np.array(self.origin))
