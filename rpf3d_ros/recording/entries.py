"""Entries of a recording (each adds rows at one time), and helpers that make entries from messages."""

from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple, TypeVar

import numpy as np

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.interface.transforms import InputFrames
from rpf3d_ros.messages.cloud_reading import columns_of_cloud, positions_of_cloud
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.recording.stream import Recording

SECOND = 1_000_000_000
"""One second in nanoseconds."""

EVENTS_KEPT = 1000
"""Largest number of stamps whose event is remembered; a result with a forgotten stamp counts as a new event."""

Drawn = TypeVar("Drawn")


class RecordingEntry(NamedTuple):
    """Rows to add to a recording at one time, such as the terrain or the impacts of an answer.

    stamp_ns, event : the time (ns) and the number of the event of the added rows. All results for the same sources
        belong to one event
    draw : adds the rows to a recording
    keeps : name of the state that the entry sets, such as "terrain"; "" if it sets no state. A new file begins with the
        last entry of each state
    """

    stamp_ns: int
    event: int
    draw: Callable[[Recording], None]
    keeps: str = ""


EntryMaker = Callable[[Any], Iterator[RecordingEntry]]
"""A function that yields the entries of a message; a message of terrain/mesh is passed as CDR bytes.

Raises MessageRefused for a message that cannot be used.
"""


class EventNumbers:
    """The numbers of events: each new stamp of sources begins an event, and results with this stamp belong to it.

    Older stamps are remembered, because results may arrive after newer sources.
    """

    def __init__(self) -> None:
        self.last = 0
        self._known: OrderedDict[int, int] = OrderedDict()

    def of(self, stamp_ns: int) -> int:
        """Return the event number of a stamp; an unknown stamp begins the next event."""
        if stamp_ns not in self._known:
            self.last += 1
            self._known[stamp_ns] = self.last
            if len(self._known) > EVENTS_KEPT:
                self._known.popitem(last=False)
        return self._known[stamp_ns]


class EntryTimes:
    """Makes entries with the time and the event number of a message.

    now : returns the time (ns since the epoch) for messages without a stamp
    """

    def __init__(self, now: Callable[[], int]) -> None:
        self.now = now
        self._events = EventNumbers()

    def of_message(self, message: Any, draw: Callable[..., None], keeps: str = "") -> RecordingEntry:
        """Return an entry with the stamp of a message and the event number of this stamp.

        draw, keeps : as in `RecordingEntry`
        """
        stamp_ns = nanoseconds(message.header.stamp)
        return RecordingEntry(stamp_ns=stamp_ns, event=self._events.of(stamp_ns), draw=draw, keeps=keeps)

    def of_markers(self, array: Any, draw: Callable[..., None], keeps: str = "") -> RecordingEntry:
        """Return an entry with the stamp of a MarkerArray; an empty array gets the current time and the last event."""
        return self.of_message(array.markers[0], draw, keeps) if array.markers else self.at(self.now(), draw, keeps)

    def at(self, stamp_ns: int, draw: Callable[..., None], keeps: str = "") -> RecordingEntry:
        """Return an entry with a time (ns) and the number of the last event; draw, keeps : as in `RecordingEntry`."""
        return RecordingEntry(stamp_ns=stamp_ns, event=self._events.last, draw=draw, keeps=keeps)


class LoggedStates:
    """Keeps the last recorded state of each name, so that a repeated state is recorded only once."""

    def __init__(self) -> None:
        self._states: dict[str, object] = {}

    def is_new(self, name: str, state: object) -> bool:
        """Note a state; return True if it must be recorded, because it differs from the last state of the same name."""
        if self._states.get(name) == state:
            return False
        self._states[name] = state
        return True

    def forget(self, name: str) -> None:
        """Forget the state of a name."""
        self._states.pop(name, None)


class LastContents:
    """Keeps the last recorded arrays of each name, so that repeated content is recorded only once."""

    def __init__(self) -> None:
        self._arrays: dict[str, tuple[np.ndarray, ...]] = {}

    def differs(self, name: str, *arrays: np.ndarray) -> bool:
        """Return True if the arrays differ from the last arrays of the same name, or if there are none."""
        last = self._arrays.get(name, ())
        return len(last) != len(arrays) or not all(map(np.array_equal, last, arrays))

    def note(self, name: str, *arrays: np.ndarray) -> None:
        """Remember these arrays as the last arrays of a name."""
        self._arrays[name] = arrays

    def is_new(self, name: str, *arrays: np.ndarray) -> bool:
        """Remember arrays; return True if they differ from the last arrays of the same name, or if there were none."""
        is_new = self.differs(name, *arrays)
        self.note(name, *arrays)
        return is_new


def frame_of(message: Any, frames: InputFrames) -> MapFrame:
    """Return the map frame that converts a message with a header. Raises MessageRefused without a transform."""
    return frames.of(message.header.frame_id, nanoseconds(message.header.stamp))


def finite_points(points: FloatArray, frame_id: str, frame: MapFrame) -> FloatArray:
    """Return points (N, 3) m of a message in the map frame. Raises MessageRefused if a point is not finite.

    frame_id : name of the frame of the points; frame : converts the points
    """
    if not bool(np.isfinite(points).all()):
        raise MessageRefused("a point is not finite")
    return frame.points(points, frame_id)


def finite_positions(cloud: Any, frame: MapFrame) -> FloatArray:
    """Return the points (N, 3) m of a cloud in the map frame. Raises MessageRefused if a point is not finite."""
    return finite_points(positions_of_cloud(cloud).reshape(-1, 3), cloud.header.frame_id, frame)


def column_of(cloud: Any, name: str) -> np.ndarray:
    """Return the values (N,) of the field `name` in the N points of a cloud."""
    return columns_of_cloud(cloud, (name,))[name].ravel()


def by_name(drawn: Mapping[str, Drawn], root: str, what: str) -> dict[str, Drawn]:
    """Return the shapes of a marker message by name, from namespaces that consist of a prefix and the name.

    drawn : the shapes by namespace; root : the prefix
    what : what the names are, for the error message, such as "level"

    Raises MessageRefused for a namespace without the prefix or without a name.
    """
    for namespace in drawn:
        if not namespace.removeprefix(root).strip("/") or not namespace.startswith(root):
            raise MessageRefused(f"a marker is in namespace '{namespace}'; it must be {root}<{what}>")
    return {namespace.removeprefix(root): each for namespace, each in drawn.items()}


def nanoseconds(stamp: Any) -> int:
    """Return the stamp of a message from rclpy or from a bag in nanoseconds."""
    return int(stamp.sec) * SECOND + int(stamp.nanosec)
