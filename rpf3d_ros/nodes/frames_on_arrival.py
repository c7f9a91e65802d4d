"""Find the frame of a message when it arrives; only the thread that receives surveys may wait for a transform."""

import threading
import time
from collections.abc import Callable

from rpf3d_ros.interface.transforms import InputFrames
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused

FIRST_TRANSFORMS = 5.0
"""Time (s) after the subscription for which a survey may wait for the transform of its frame.

A latched survey arrives once, as soon as the node subscribes to it, and this may be before /tf_static arrives.
"""

LOOK = 0.05
"""Time (s) between two lookups while a survey waits."""


class FramesOnArrival:
    """Finds the map frame that converts each message. The executor's thread, which receives transforms, never waits."""

    def __init__(self, frames: InputFrames, is_patient: bool) -> None:
        """Record that the calling thread, which must be the executor's thread, never waits for a transform.

        frames : finds the frames of messages
        is_patient : True if other threads may wait for the first transforms, during FIRST_TRANSFORMS (s) from now on
        """
        self._frames, self._executor = frames, threading.get_ident()
        self._wait_until = time.monotonic() + FIRST_TRANSFORMS if is_patient else 0.0
        self._closed = threading.Event()

    def of(self, frame_id: str, stamp_ns: int) -> MapFrame:
        """Return the map frame that converts a message; wait for the first transforms if the calling thread may wait.

        frame_id, stamp_ns : frame and stamp (ns) of the message

        Raises MessageRefused, as in `InputFrames.of`.
        """
        return self._when_known(lambda: self._frames.of(frame_id, stamp_ns))

    def static(self, frame_id: str, because: str) -> MapFrame:
        """Return the map frame that converts data without a time, such as a mesh.

        The method waits for the first transforms if the calling thread may wait.

        frame_id : frame of the data, which must be static; because : the reason for this, for the error message

        Raises MessageRefused, as in `InputFrames.static`.
        """
        return self._when_known(lambda: self._frames.static(frame_id, because))

    def close(self) -> None:
        """Refuse the messages that still wait for a transform, and let no further message wait."""
        self._closed.set()

    def _when_known(self, find: Callable[[], MapFrame]) -> MapFrame:
        while True:
            try:
                return find()
            except MessageRefused:
                if not self._may_wait() or self._closed.wait(LOOK):
                    raise

    def _may_wait(self) -> bool:
        return threading.get_ident() != self._executor and time.monotonic() < self._wait_until
