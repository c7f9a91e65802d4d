"""The map frame, the frame of every output: in metres, z up, with an origin near the site.

Survey coordinates are large: a float32 step is 0.03 m at 5e5 m and 0.5 m at 4.5e6 m. Messages therefore contain
coordinates relative to `origin`. A message in the survey frame is shifted in float64 on arrival. A message in another
frame needs a transform into the map frame (`MapFrame.other`). Without this transform, the frame is foreign, and the
message is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.refusals import MessageRefused

FARTHEST = 1.0e5
"""Largest coordinate (m) that is accepted in the map frame, so that float32 has steps of 8 mm or less."""

UNIT_TOLERANCE = 1.0e-3
"""Largest deviation of a quaternion's length from 1: three decimals are enough."""


LEVEL = 1.0 - 1.0e-4
"""Least vertical component (-) of the z axis of a frame that is not tilted: the axis is vertical within 0.8 degrees.

The sign of the component does not matter: the axis may point up or down.
"""


class RigidTransform(NamedTuple):
    """A transform from another frame into the map frame, float64.

    source : name of the other frame; rotation : (3, 3), proper and orthogonal; translation : (3,) m
    """

    source: str
    rotation: FloatArray
    translation: FloatArray

    def points(self, points: FloatArray) -> FloatArray:
        """Return points (..., 3) m of the other frame in the map frame; a point with one NaN becomes NaN as a whole."""
        return np.asarray(points @ self.rotation.T + self.translation)

    def directions(self, directions: FloatArray) -> FloatArray:
        """Return directions (-) or velocities (m/s), (..., 3), of the other frame in the map frame; without shift."""
        return np.asarray(directions @ self.rotation.T)


@dataclass(frozen=True)
class MapFrame:
    """The frame of all messages, and its relation to survey coordinates.

    name : name of the map frame
    survey : name of the frame of survey coordinates; "" if messages never use it
    origin : (3,) m, survey coordinates (east, north, height) of the map frame's origin
    other : the transform of one other frame into the map frame, at the time of one message; None if there is none
    """

    name: str = "map"
    survey: str = ""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    other: RigidTransform | None = None

    def points(self, points: FloatArray, frame_id: str) -> FloatArray:
        """Return the points (..., 3) m of a message, converted from frame_id to the map frame; NaN stays NaN.

        Raises MessageRefused for a foreign frame (`check`), and for a coordinate beyond `FARTHEST` in the map frame.
        """
        self.check(frame_id)
        moved = points
        if frame_id == self.survey:
            moved = points - np.array(self.origin)
        elif self.other is not None and not self.knows(frame_id):
            moved = self.other.points(points)
        if not bool(np.any(np.abs(moved) > FARTHEST)):
            return moved
        raise MessageRefused(
            f"a point lies beyond {FARTHEST:.0e} m from the origin of frame '{self.name}', where markers and float32 "
            f"clouds lose centimetres; {self._remedy(frame_id)}"
        )

    def _remedy(self, frame_id: str) -> str:
        if self.knows(frame_id):
            return "subtract map_origin from the coordinates, or set survey_frame and map_origin, for a mesh mesh_frame"
        return f"check the transform of frame '{frame_id}'"

    def directions(self, directions: FloatArray, frame_id: str) -> FloatArray:
        """Return directions (-) or velocities (m/s), (..., 3), of a message, converted from frame_id to the map frame.

        Raises MessageRefused for a foreign frame.
        """
        self.check(frame_id)
        if self.other is None or self.knows(frame_id):
            return directions
        return self.other.directions(directions)

    def knows(self, frame_id: str) -> bool:
        """True for the names of the map frame and of the survey frame, which need no transform `other`."""
        return bool(frame_id) and frame_id in (self.name, self.survey)

    def tilts(self, frame_id: str) -> bool:
        """True if the transform of a frame tilts its z axis; an axis that points down is not tilted."""
        if self.other is None or self.knows(frame_id):
            return False
        return bool(abs(self.other.rotation[2, 2]) < LEVEL)

    def check(self, frame_id: str) -> None:
        """Raise MessageRefused if a frame is foreign: not the map frame, the survey frame or the frame of `other`.

        frame_id : name of the frame; an empty name is refused, too
        """
        if self.knows(frame_id) or (self.other is not None and frame_id == self.other.source):
            return
        also = f" or '{self.survey}'" if self.survey else ""
        why = ": no other frame is transformed" if frame_id else ""
        raise MessageRefused(f"frame_id is '{frame_id}'; it must be '{self.name}'{also}{why}")


def rigid_transform(source: str, quaternion: Sequence[float], translation: Sequence[float]) -> RigidTransform:
    """Return the transform from the frame `source` into the map frame: a quaternion x, y, z, w and a translation (m).

    The quaternion is normalised, because a length that is off by 0.001 would move a point at 1 km by 2 m.

    Raises MessageRefused if a number is not finite, or if the length of the quaternion differs from 1 by more than
    UNIT_TOLERANCE.
    """
    turn, shift = np.array(quaternion, dtype=np.float64), np.array(translation, dtype=np.float64)
    if not bool(np.isfinite(turn).all() and np.isfinite(shift).all()):
        raise MessageRefused(f"the transform of frame '{source}' is not finite")
    length = float(np.linalg.norm(turn))
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise MessageRefused(
            f"the transform of frame '{source}' is not a rotation: its quaternion has length {length:.4g}, not 1"
        )
    return RigidTransform(source=source, rotation=rotation_of(turn / length), translation=shift)


def same_transform(one: RigidTransform | None, other: RigidTransform | None) -> bool:
    """True if two transforms have the same numbers, or both are None."""
    if one is None or other is None:
        return one is other
    return np.array_equal(one.rotation, other.rotation) and np.array_equal(one.translation, other.translation)


def rotation_of(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrix (3, 3) of a unit quaternion (4,) x, y, z, w."""
    x, y, z, w = quaternion.tolist()
    return np.array([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ])  # fmt: skip
