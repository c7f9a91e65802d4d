"""Find how to convert each input message to the map frame, from the frames in the parameters or from tf2.

The parameters define two frames; transforms of other frames may be looked up. This file has the rules for transforms;
`tf_buffer` reads the transforms from tf2. A lookup never waits. A message is transformed once, when it is received. If
the transform of a frame changes later, evidence of earlier messages stays the same.
"""

from dataclasses import replace
from typing import NamedTuple, Protocol

from rpf3d_core.alerts.time_units import NS
from rpf3d_ros.messages.map_frame import MapFrame, rigid_transform
from rpf3d_ros.messages.refusals import MessageRefused

NEWEST = 0
"""The value of `stamp_ns` with which `TransformLookup.lookup` returns the newest transform."""


MESH_HAS_NO_STAMP = "a mesh has no stamp"
AREAS_STAY = "an area stays where it was when it was received"
"""Why the frame of an area must be static, for the error message; MESH_HAS_NO_STAMP is the reason for a mesh."""


class FoundTransform(NamedTuple):
    """A transform from one frame into another, as its provider returns it; its numbers are not checked.

    quaternion : x, y, z, w; translation : m
    stamp_ns : time (ns) for which the transform is valid; None for a static transform, which has no age
    """

    quaternion: tuple[float, float, float, float]
    translation: tuple[float, float, float]
    stamp_ns: int | None


class TransformLookup(Protocol):
    """A provider of transforms between frames. Any thread may call."""

    def lookup(self, target: str, source: str, stamp_ns: int) -> FoundTransform | str:
        """Return the transform from `source` into `target` without waiting; if there is none, the reason as text.

        stamp_ns : time (ns) of the transform, NEWEST for the newest of all; if all transforms are older than this time,
            the newest is returned
        """

    def clear(self) -> None:
        """Forget all transforms except static transforms, because the clock went back."""

    def close(self) -> None:
        """Unsubscribe: receive no more transforms."""


class InputFrames:
    """Finds the map frame for each message, with the transform that the message's coordinates need, if any."""

    def __init__(self, frame: MapFrame, transforms: TransformLookup | None = None, max_age_s: float = 0.0) -> None:
        """Set the frames.

        frame : the map frame and survey frame; transforms : provider for other frames, None to refuse other frames
        max_age_s : largest age (s) of a transform at the time of a message's stamp
        """
        self._frame, self._transforms, self._max_age_s = frame, transforms, max_age_s

    def of(self, frame_id: str, stamp_ns: int) -> MapFrame:
        """Return the map frame that converts a message; frame_id, stamp_ns : frame and stamp (ns) of the message.

        No transform is looked up for the frames in the parameters, for an empty frame_id, or if there is no provider of
        transforms. The returned map frame then refuses an empty frame_id, or another frame, when it converts the
        message. Raises MessageRefused if the provider has no transform, if the stamp is 0, and for a transform that is
        later than the message, too old or not a rotation.
        """
        if self._transforms is None or self._needs_none(frame_id):
            return self._frame  # the map frame itself refuses a message in another frame
        if stamp_ns <= 0:
            raise MessageRefused(
                f"frame_id is '{frame_id}', and its stamp is 0: a transform needs the time of the data"
            )
        found = self._found(self._transforms, frame_id, stamp_ns)
        self._check_age(frame_id, found, stamp_ns)
        return self._with(frame_id, found)

    def static(self, frame_id: str, because: str) -> MapFrame:
        """Return the map frame that converts data whose frame must not move.

        Such data are meshes, which have no stamp, and areas, which stay where they are. No transform is looked up for
        the frames in the parameters, for an empty frame_id, or without a provider. Raises MessageRefused if the
        provider has no transform, and for a transform that is dynamic or not a rotation.

        because : why frame_id must be static, for the error message
        """
        if self._transforms is None or self._needs_none(frame_id):
            return self._frame
        found = self._found(self._transforms, frame_id, NEWEST)
        if found.stamp_ns is not None:
            raise MessageRefused(f"frame '{frame_id}' moves: {because}, so its frame must be static (/tf_static)")
        return self._with(frame_id, found)

    def _needs_none(self, frame_id: str) -> bool:
        return not frame_id or self._frame.knows(frame_id)

    def _found(self, transforms: TransformLookup, frame_id: str, stamp_ns: int) -> FoundTransform:
        found = transforms.lookup(self._frame.name, frame_id, stamp_ns)
        if isinstance(found, str):
            raise MessageRefused(
                f"frame_id is '{frame_id}', and there is no transform to '{self._frame.name}': {found}"
            )
        return found

    def _with(self, frame_id: str, found: FoundTransform) -> MapFrame:
        return replace(self._frame, other=rigid_transform(frame_id, found.quaternion, found.translation))

    def _check_age(self, frame_id: str, found: FoundTransform, stamp_ns: int) -> None:
        if found.stamp_ns is None:
            return
        age = (stamp_ns - found.stamp_ns) / NS
        if age < 0.0:
            raise MessageRefused(f"the transform of frame '{frame_id}' is later than the message")
        if age > self._max_age_s:
            raise MessageRefused(
                f"the transform of frame '{frame_id}' is more than {self._max_age_s:g} s older than the message "
                f"(transforms_max_age_s): {age:.3f} s"
            )
