"""Convert a bag to the rerun file that the live recorder would write from the same messages; ROS is not needed."""

import struct
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from os import SEEK_END
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.recorded_topics import RecordedSensors, RecordedTopic, topic_called, topics_with
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.recording.bag_sensors import sensors_in, unread_topics
from rpf3d_ros.recording.bag_writer import import_rosbags, typestore
from rpf3d_ros.recording.files import RecordingFiles, Rotation
from rpf3d_ros.recording.message_log import MessageLog, Reading
from rpf3d_ros.recording.thinning import WHOLE, Thinning

MESH = "terrain/mesh"
"""Topic whose messages are passed on as CDR bytes, as in the recorder."""

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of every MCAP file."""

CUT_OFF = (
    "the file is incomplete, perhaps because the recorder was killed: repair it with mcap recover FILE -o REPAIRED "
    "(the MCAP command line, https://mcap.dev), and give the repaired file"
)

UNREADABLE = (ValueError, IndexError, KeyError, TypeError, MemoryError, ArithmeticError, struct.error)
"""Errors that a damaged message may raise while it is read; UnicodeError and rosbags' own errors are ValueErrors."""


class Raw(NamedTuple):
    """A message of a bag.

    topic : key in `topics_with(sensors)`
    name : full name of the topic in the bag
    stamp_ns : time of reception (ns)
    data : CDR bytes of the message
    """

    topic: str
    name: str
    stamp_ns: int
    data: bytes


class Converted(NamedTuple):
    """The result of a conversion.

    messages : topic -> number of messages that were not refused, including messages that the thinning left out
    refused : one sentence for each refused message, with its topic and time, in order
    """

    messages: Counter[str]
    refused: list[str]


def sensors_of(bag: Path, source_topics: str | None = None, source_cloud_topics: str | None = None) -> RecordedSensors:
    """Return the topics of sources in a bag.

    source_topics, source_cloud_topics : names of topics with poses and with clouds, separated by commas; None for the
        names that the recorder has noted in the bag, or for the default topic if no names are noted

    Raises InputError if the bag cannot be read or is incomplete, or the names are wrong.
    """
    with _reading(bag) as reader:
        return sensors_in(reader, source_topics, source_cloud_topics)


def unread_of(bag: Path, namespace: str, sensors: RecordedSensors) -> list[str]:
    """Return a sentence for each topic of a bag that may have sources, but is not one of the topics in `sensors`.

    namespace : namespace of the topics in the bag; sensors : topics of sources that are read

    Raises InputError if the bag cannot be read or is incomplete.
    """
    with _reading(bag) as reader:
        return unread_topics(reader, namespace, sensors)


def topics_of(bag: Path, namespace: str = "", sensors: RecordedSensors | None = None) -> dict[str, RecordedTopic]:
    """Return the recorded topics that have messages in a bag, in the order of TOPICS.

    namespace : namespace of the topics in the bag; sensors : topics of sources, None for the result of `sensors_of`

    Raises InputError if the bag cannot be read or is incomplete.
    """
    with _reading(bag) as reader:
        topics = topics_with(sensors or sensors_in(reader))
        held = {topic_called(c.topic, namespace, topics) for c in _chosen(reader, namespace, topics) if c.msgcount}
    return {name: topic for name, topic in topics.items() if name in held}


def messages_of(bag: Path, namespace: str = "", sensors: RecordedSensors | None = None) -> Iterator[Raw]:
    """Yield the messages of the recorded topics in a bag, in order of time.

    namespace : namespace of the topics in the bag; sensors : topics of sources, None for the result of `sensors_of`

    Raises InputError if the bag cannot be read or is incomplete.
    """
    with _reading(bag) as reader:
        topics = topics_with(sensors or sensors_in(reader))
        chosen = _chosen(reader, namespace, topics)
        if not chosen:
            return  # rosbags reads all topics if the list is empty
        for connection, stamp_ns, data in reader.messages(connections=chosen):
            topic = topic_called(connection.topic, namespace, topics)
            yield Raw(topic=str(topic), name=connection.topic, stamp_ns=stamp_ns, data=bytes(data))


@contextmanager
def _reading(bag: Path) -> Iterator[Any]:
    """Context manager: yield an open reader of a bag. Every failure to open or read the bag becomes an InputError."""
    rosbags = import_rosbags()
    if not bag.exists():
        raise InputError(f"{bag}: there is no such bag")
    try:
        with rosbags.rosbag2.Reader(bag) as reader:
            yield reader
    except InputError:
        raise
    except (rosbags.rosbag2.ReaderError, OSError, *UNREADABLE) as error:
        if _is_cut_off(bag):
            raise InputError(f"{bag}: {CUT_OFF}") from error
        lacks = "its folder has no metadata.yaml" if bag.is_dir() and not (bag / "metadata.yaml").exists() else error
        raise InputError(f"{bag}: cannot be read as a rosbag2 bag (MCAP or sqlite3): {lacks}") from error


def _chosen(reader: Any, namespace: str, topics: Mapping[str, RecordedTopic]) -> list[Any]:
    """Return the connections (topics with a type) of a bag that belong to `topics` and have the expected type."""
    named = ((connection, topic_called(connection.topic, namespace, topics)) for connection in reader.connections)
    return [connection for connection, topic in named if topic and topics[topic].kind == connection.msgtype]


def _is_cut_off(bag: Path) -> bool:
    """True if a file of the bag was cut off, for example by a kill: it begins as an MCAP file, but does not end as one.

    False if the files cannot be read.
    """
    files = bag.glob("*.mcap") if bag.is_dir() else [bag]
    with suppress(OSError):
        return any(_begins_only(file) for file in files)
    return False


def _begins_only(file: Path) -> bool:
    with file.open("rb") as opened:
        if opened.read(len(MAGIC)) != MAGIC:
            return False
        opened.seek(-len(MAGIC), SEEK_END)
        return opened.tell() == 0 or opened.read() != MAGIC


def convert(
    bag: Path, out: Path, frame: MapFrame, mesh_frame: str, namespace: str = "", thinning: Thinning = WHOLE,
    sensors: RecordedSensors | None = None,
) -> Converted:  # fmt: skip
    """Convert a bag into a recording file; return the numbers of accepted messages, and why others were refused.

    out : path of the recording; frame : the map frame and survey frame of the messages
    mesh_frame : name of the frame of terrain/mesh; namespace : namespace of the topics in the bag
    thinning : what the recording leaves out; sensors : topics of sources, None for the result of `sensors_of`

    Raises InputError if the bag cannot be read or has none of the topics, OSError if the recording cannot be written.
    """
    types, now = typestore(), [0]
    sensors = sensors or sensors_of(bag)
    topics = topics_with(sensors)
    log = MessageLog(frame, mesh_frame, lambda: now[0], thinning, sensors=sensors)
    done = Converted(Counter(), [])
    files = None
    for raw in messages_of(bag, namespace, sensors):
        now[0] = raw.stamp_ns
        if files is None:
            files = RecordingFiles(out, Rotation())
            _write(files, log.begin(), out)
        done.messages[raw.topic] += 1
        _record(log.received(raw.topic, partial(_message, types, topics[raw.topic].kind, raw)), files, out, now, done)
    if files is None:
        raise InputError(
            f"{bag}: has none of the topics {', '.join(topics)}: give the namespace of its topics (--namespace), or "
            "its topics of sources (--source-topics, --source-cloud-topics)"
        )
    _record(log.rest(), files, out, now, done)
    files.close()
    return done


def _record(readings: Iterator[Reading], files: RecordingFiles, out: Path, now: list[int], done: Converted) -> None:
    """Write messages into a recording, and add the refused messages to `done`.

    readings : the messages to write; files, out : the recording, and its path for error messages
    now : a list with one item: the time (ns) of the current message of the bag
    done : the counts and sentences to complete
    """
    for reading in readings:
        try:
            entries = reading.entries()
        except (MessageRefused, *UNREADABLE) as refusal:
            done.messages[reading.topic] -= 1
            done.refused.append(f"{reading.topic} at {now[0] / 1e9:.3f} s: {refusal}")
        else:
            _write(files, entries, out)


def _write(files: RecordingFiles, entries: list[Any], out: Path) -> None:
    try:
        files.write(entries)
    except RuntimeError as error:
        raise OSError(f"{out}: the recording could not be written: {error}") from error


def _message(types: Any, kind: str, raw: Raw) -> Any:
    if raw.topic == MESH:
        return raw.data
    try:
        return types.deserialize_cdr(raw.data, kind)
    except import_rosbags().serde.SerdeError as error:
        raise MessageRefused(f"it is not a valid {kind}: {error}") from error
