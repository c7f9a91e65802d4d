"""Find the topics of sources in an open bag: noted by the recorder, given by the user, or not read."""

from typing import Any

from rpf3d_ros.interface.recorded_topics import (
    CLOUD,
    CLOUD_SOURCES,
    POSE_SOURCES,
    POSES,
    TOPICS,
    RecordedSensors,
    topic_called,
    topics_with,
)
from rpf3d_ros.recording.bag_writer import CLOUDS_KEY, POSES_KEY

OPTIONS = {POSES: "--source-topics", CLOUD: "--source-cloud-topics"}
"""Command-line options with which a user names the topics of sources in a bag, by the type of the topics' messages."""

HELP = "topics of sources as {}, between commas, as the nodes' parameter; without it, the names noted in the bag"
"""Help text of the options in OPTIONS; the braces stand for the kind of the messages: poses or clouds."""


def sensors_in(reader: Any, poses: str | None = None, clouds: str | None = None) -> RecordedSensors:
    """Return the topics of sources in an open bag.

    reader : the open reader of the bag, from rosbags
    poses, clouds : names of topics from the user, separated by commas; None for the names that the recorder has noted
        in the bag, or for the default topic if no names are noted

    Raises InputError if a name is given twice, or is another topic of rpf3d.
    """
    noted = dict(reader.storage.metadata.custom or {})
    sensors = RecordedSensors(
        poses=_names(noted.get(POSES_KEY, POSE_SOURCES) if poses is None else poses),
        clouds=_names(noted.get(CLOUDS_KEY, CLOUD_SOURCES) if clouds is None else clouds),
    )
    sensors.check()
    return sensors


def unread_topics(reader: Any, namespace: str, sensors: RecordedSensors) -> list[str]:
    """Return a sentence for each topic of an open bag that may have sources, but is not one of the topics in `sensors`.

    Such a topic is not read. The result does not name topics of rpf3d in other namespaces.

    reader : the open reader of the bag, from rosbags
    namespace : namespace of the topics in the bag; sensors : topics of sources that are read
    """
    topics = topics_with(sensors)
    return [
        f"{each.topic} is not read: if a sensor publishes sources on this topic, name it in {OPTIONS[each.msgtype]}"
        for each in reader.connections
        if each.msgcount and each.msgtype in OPTIONS and not topic_called(each.topic, namespace, topics)
        and not any(each.topic.endswith(f"/{known}") for known in OTHERS)
    ]  # fmt: skip


OTHERS = tuple(topic for topic in TOPICS if topic not in (POSE_SOURCES, CLOUD_SOURCES))
"""The topics of rpf3d that have no sources of a sensor."""


def _names(text: object) -> tuple[str, ...]:
    return tuple(name for each in str(text).split(",") if (name := each.strip()))
