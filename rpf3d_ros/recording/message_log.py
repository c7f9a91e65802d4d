"""Convert each received message to entries of a recording; the modules `*_entries` do this topic by topic.

No message class is imported: messages are read by the names of their fields, from rclpy or from a bag.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

from rpf3d_ros.interface.recorded_topics import DEFAULT_SENSORS, RecordedSensors
from rpf3d_ros.interface.transforms import InputFrames
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.recording.alert_entries import AlertEntries
from rpf3d_ros.recording.answer_entries import AnswerEntries
from rpf3d_ros.recording.area_entries import AreaEntries
from rpf3d_ros.recording.entries import SECOND, EntryMaker, EntryTimes, LastContents, RecordingEntry
from rpf3d_ros.recording.rock_entries import LINES, RockEntries
from rpf3d_ros.recording.source_entries import SourceEntries
from rpf3d_ros.recording.terrain_entries import TerrainEntries
from rpf3d_ros.recording.thinning import WHOLE, Thinning, text_of
from rpf3d_ros.recording.waiting import HeldLines, PacedMessages, Read

MAPS = ("hazard/grid", "hazard/zones", "hazard/points")
"""Topics of the hazard maps."""


class Reading(NamedTuple):
    """A message to record: its topic, and a function that returns its entries.

    entries : function that deserializes the message and returns its entries; raises MessageRefused for a message that
        cannot be used
    """

    topic: str
    entries: Callable[[], list[RecordingEntry]]


class MessageLog:
    """Converts the messages of all topics to entries of a recording.

    All messages with the stamp of the same sources belong to one event. A refused message gives no entry.
    """

    def __init__(
        self, frame: MapFrame, mesh_frame: str, now: Callable[[], int], thinning: Thinning = WHOLE,
        frames: InputFrames | None = None, sensors: RecordedSensors = DEFAULT_SENSORS,
    ) -> None:  # fmt: skip
        """Start with no terrain, areas or alerts.

        frame : the map frame and survey frame; mesh_frame : name of the frame of terrain/mesh
        now : returns the time (ns since the epoch) at which the current message was received
        thinning : what the recording leaves out
        frames : finds the frames of the inputs; None to accept the map frame and the survey frame only
        sensors : topics of sources
        """
        frames = frames or InputFrames(frame)
        self._now, self._about, times = now, thinning.text + text_of(sensors), EntryTimes(now)
        self._times, areas, self._alerts = times, AreaEntries(frame, frames, times), AlertEntries(times)
        answers = AnswerEntries(frame, times, None if thinning.is_whole else LastContents())
        self._makers: dict[str, EntryMaker] = {
            **TerrainEntries(frames, mesh_frame, times).makers(),
            **SourceEntries(frames, times, sensors).makers(),
            **areas.makers(),
            **answers.makers(),
            **self._alerts.makers(),
        }
        self._maps: dict[str, PacedMessages] = {}
        self._waiting: dict[str, PacedMessages | HeldLines] = {}
        if not thinning.is_whole:
            rocks = RockEntries(frame, times, lambda: areas.rings, thinning.rocks)
            self._makers.update(rocks.makers())
            self._maps = {topic: PacedMessages(round(SECOND * thinning.maps_every)) for topic in MAPS}
            self._waiting = {**self._maps, LINES: rocks.held}

    def begin(self) -> list[RecordingEntry]:
        """Return the entries that a recording begins with: the text that states what is left out."""
        return [self._times.at(self._now(), lambda r: r.about(self._about), "about")]

    def received(self, topic: str, read: Read) -> Iterator[Reading]:
        """Note a received message, and yield the messages to record now.

        Call `entries` of each yielded message before asking for the next: a changed alert level lets maps follow.

        The yielded messages may include the received message and messages that have waited, or there may be none.

        topic : a key of `topics_with(sensors)`; read : deserializes the message, but returns CDR bytes for terrain/mesh
        """
        yield from self.due()
        waiting, changes = self._waiting.get(topic), self._alerts.changes
        for each in waiting.take(self._now(), read) if waiting is not None else [read]:
            yield self._reading(topic, each)
        if self._alerts.changes != changes:
            yield from (self._reading(name, each) for name, maps in self._maps.items() for each in maps.open())

    def due(self) -> Iterator[Reading]:
        """Yield the messages that have waited long enough; call this every second, even if no message is received."""
        now_ns = self._now()
        yield from (self._reading(topic, each) for topic, kept in self._waiting.items() for each in kept.due(now_ns))

    def rest(self) -> Iterator[Reading]:
        """Yield all messages that still wait; call this before the recording ends."""
        yield from (self._reading(topic, each) for topic, kept in self._waiting.items() for each in kept.rest())

    def entries(self, topic: str, message: Any) -> list[RecordingEntry]:
        """Note a received message, and return the entries of all messages to record now.

        Messages that have waited may be among them. Raises MessageRefused if one of the messages is refused.

        topic : a key of `topics_with(sensors)`; message : the deserialized message, CDR bytes for terrain/mesh
        """
        return [entry for reading in self.received(topic, lambda: message) for entry in reading.entries()]

    def _reading(self, topic: str, read: Read) -> Reading:
        return Reading(topic=topic, entries=partial(self._entries, topic, read))

    def _entries(self, topic: str, read: Read) -> list[RecordingEntry]:
        return list(self._makers[topic](read()))
