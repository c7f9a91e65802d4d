"""Convert each received message to entries of a recording; the modules `*_entries` do this topic by topic.

No message class is imported: messages are read by the names of their fields, from rclpy or from a bag.
"""

from collections.abc import Callable
from typing import Any

from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.recording.alert_entries import AlertEntries
from rpf3d_ros.recording.answer_entries import AnswerEntries
from rpf3d_ros.recording.area_entries import AreaEntries
from rpf3d_ros.recording.entries import EntryMaker, EntryTimes, RecordingEntry
from rpf3d_ros.recording.source_entries import SourceEntries
from rpf3d_ros.recording.terrain_entries import TerrainEntries


class MessageLog:
    """Converts the messages of all topics to entries of a recording.

    All messages with the stamp of the same sources belong to one event. A refused message gives no entry.
    """

    def __init__(self, frame: MapFrame, mesh_frame: str, now: Callable[[], int]) -> None:
        """Begin without terrain, areas or alerts.

        mesh_frame : frame of terrain/mesh
        now : returns the time (ns since the epoch) for messages without a stamp
        """
        times = EntryTimes(now)
        self._makers: dict[str, EntryMaker] = {
            **TerrainEntries(frame, mesh_frame, times).makers(),
            **SourceEntries(frame, times).makers(),
            **AreaEntries(frame, times).makers(),
            **AnswerEntries(frame, times).makers(),
            **AlertEntries(times).makers(),
        }

    def entries(self, topic: str, message: Any) -> list[RecordingEntry]:
        """Return the entries of one message; topic : a key of TOPICS. A message of terrain/mesh is given as CDR bytes.

        Raises MessageRefused.
        """
        return list(self._makers[topic](message))
