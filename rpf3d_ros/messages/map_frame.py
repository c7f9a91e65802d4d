"""The frame of every message: `map`, in metres, z up, with an origin near the site.

Survey coordinates are large: a float32 step is 0.03 m at 5e5 and 0.5 m at 4.5e6. Messages therefore carry coordinates
relative to `origin`. A message in the survey frame is shifted in float64 on arrival; any other frame is refused.
"""

from dataclasses import dataclass

import numpy as np

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.refusals import MessageRefused

FARTHEST = 1.0e5
"""Largest coordinate (m) that is accepted in the map frame, so that float32 has steps of 8 mm or less."""


@dataclass(frozen=True)
class MapFrame:
    """The frame of all messages, and its relation to survey coordinates.

    name : name of the map frame
    survey : name of the frame of survey coordinates; "" if messages never use it
    origin : (3,) m, survey coordinates (east, north, height) of the map frame's origin
    """

    name: str = "map"
    survey: str = ""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def points(self, points: FloatArray, frame_id: str) -> FloatArray:
        """Return the points (..., 3) m of a message, converted from frame_id to the map frame; NaN stays NaN.

        Raises MessageRefused for a foreign frame, and for a point farther than `FARTHEST` from the origin.
        """
        self.check(frame_id)
        shifted = points - np.array(self.origin) if frame_id == self.survey else points
        if not bool(np.any(np.abs(shifted) > FARTHEST)):
            return shifted
        raise MessageRefused(
            f"a point lies beyond {FARTHEST:.0e} m from the origin of frame '{self.name}', where markers and float32 "
            f"clouds lose centimetres; publish coordinates less map_origin, or name survey_frame and set map_origin"
        )

    def check(self, frame_id: str) -> None:
        """Raise an error if a frame is neither the map frame nor the survey frame.

        Raises MessageRefused for any other name, and for an empty name.
        """
        if frame_id and frame_id in (self.name, self.survey):
            return
        also = f" or '{self.survey}'" if self.survey else ""
        raise MessageRefused(f"frame_id is '{frame_id}'; it must be '{self.name}'{also}: no other frame is transformed")
