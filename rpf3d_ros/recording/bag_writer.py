"""Write received messages unchanged, as CDR bytes, into an MCAP bag, so that the nodes can replay an incident."""

from pathlib import Path
from typing import Any

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.recorded_topics import DEFAULT_SENSORS, RecordedSensors, topics_with

POSES_KEY, CLOUDS_KEY = "rpf3d_source_topics", "rpf3d_source_cloud_topics"
"""Keys of a bag's custom data with the topics of sources, so that no option is needed to read the bag."""

VERSION = 9
"""Version of rosbag2's metadata format that ROS 2 Jazzy writes."""


def import_rosbags() -> Any:
    """Return the rosbags package with its writer and reader.

    Raises InputError with the install command if rosbags is missing.
    """
    try:
        import rosbags.rosbag2
        import rosbags.serde
        import rosbags.typesys
    except ImportError as fault:
        raise InputError("bags need rosbags: pip install 'rosbags>=0.11,<0.12'") from fault
    return rosbags


def typestore() -> Any:
    """Return the definitions of ROS 2 Jazzy's messages, which are needed to write a bag and to read its messages."""
    rosbags = import_rosbags()
    return rosbags.typesys.get_typestore(rosbags.typesys.Stores.ROS2_JAZZY)


class BagWriter:
    """A bag that is open for writing received messages.

    `close` writes the index. A bag without an index, because the process was killed, must be repaired with `mcap
    recover`.
    """

    def __init__(self, folder: Path, sensors: RecordedSensors = DEFAULT_SENSORS) -> None:
        """Create the bag's folder; sensors : topics of sources, which are noted in the bag.

        Raises OSError if the folder exists or cannot be created, InputError if rosbags is missing.
        """
        rosbag2 = import_rosbags().rosbag2
        if not folder.parent.is_dir():
            raise FileNotFoundError(f"there is no folder {folder.parent} to write the bag into")
        self.folder, self._types = folder, typestore()
        self._connections: dict[str, Any] = {}
        self._topics = topics_with(sensors)
        try:
            self._writer = rosbag2.Writer(folder, version=VERSION, storage_plugin=rosbag2.StoragePlugin.MCAP)
            self._writer.set_custom_data(POSES_KEY, ",".join(sensors.poses))
            self._writer.set_custom_data(CLOUDS_KEY, ",".join(sensors.clouds))
            self._writer.open()
        except rosbag2.WriterError as error:
            raise FileExistsError(str(error)) from error

    def write(self, topic: str, name: str, stamp_ns: int, data: bytes) -> None:
        """Add a received message.

        topic : key in `topics_with(sensors)`, such as terrain/mesh; name : full name of the topic, with namespace
        stamp_ns : time of reception (ns); data : CDR bytes of the message

        Raises OSError if the bag cannot be written.
        """
        if name not in self._connections:
            self._connections[name] = self._writer.add_connection(name, self._topics[topic].kind, typestore=self._types)
        self._writer.write(self._connections[name], stamp_ns, data)

    def close(self) -> None:
        """Write the remaining messages and the index."""
        self._writer.close()
