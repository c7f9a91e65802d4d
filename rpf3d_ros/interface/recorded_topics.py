"""The recorded topics and their message types, for the live recorder and all programs that write or read bags."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError

CLOUD, MARKERS, DIAGNOSTICS = (
    "sensor_msgs/msg/PointCloud2",
    "visualization_msgs/msg/MarkerArray",
    "diagnostic_msgs/msg/DiagnosticArray",
)
POSES = "geometry_msgs/msg/PoseArray"

STATE, EVENT, RESULT, TERRAIN = "state", "event", "result", "terrain"
"""Kinds of topics; the kind of a topic determines its quality of service.

STATE : the last message is latched; EVENT : not latched; RESULT : latched, and many messages may wait
TERRAIN : a parameter sets the durability
"""


class RecordedTopic(NamedTuple):
    """A topic that the recorder records: the type of its messages, and its quality of service.

    kind : ROS type of the messages, such as "sensor_msgs/msg/PointCloud2"
    offered : STATE, EVENT, RESULT or TERRAIN; this value decides the quality of service of the topic (`qos`)
    given : True if the topic is an input of the simulator, False if a node of rpf3d publishes the topic
    """

    kind: str
    offered: str
    given: bool = False

    @property
    def message_class(self) -> Any:
        """The class of the topic's messages in rclpy; only this property needs ROS, the rest of the file does not."""
        module, _, name = self.kind.rpartition("/")
        return getattr(import_module(module.replace("/", ".")), name)


TOPICS: dict[str, RecordedTopic] = {
    "terrain/points": RecordedTopic(kind=CLOUD, offered=TERRAIN, given=True),
    "terrain/mesh": RecordedTopic(kind="shape_msgs/msg/Mesh", offered=TERRAIN, given=True),
    "terrain/update": RecordedTopic(kind=CLOUD, offered=EVENT, given=True),
    "sources": RecordedTopic(kind=POSES, offered=EVENT, given=True),
    "clicked_point": RecordedTopic(kind="geometry_msgs/msg/PointStamped", offered=EVENT, given=True),
    "source_cloud": RecordedTopic(kind=CLOUD, offered=EVENT, given=True),
    "areas/polygon": RecordedTopic(kind="geometry_msgs/msg/PolygonStamped", offered=EVENT, given=True),
    "areas/equipment": RecordedTopic(kind=POSES, offered=EVENT, given=True),
    "trajectories": RecordedTopic(kind=MARKERS, offered=RESULT),
    "trajectories/points": RecordedTopic(kind=CLOUD, offered=RESULT),
    "impacts": RecordedTopic(kind=CLOUD, offered=RESULT),
    "deposits": RecordedTopic(kind=CLOUD, offered=RESULT),
    "hazard/zones": RecordedTopic(kind=MARKERS, offered=RESULT),
    "areas/outlines": RecordedTopic(kind=MARKERS, offered=RESULT),
    "hazard/points": RecordedTopic(kind=CLOUD, offered=RESULT),
    "hazard/grid": RecordedTopic(kind="nav_msgs/msg/OccupancyGrid", offered=RESULT),
    "results": RecordedTopic(kind=DIAGNOSTICS, offered=RESULT),
    "alerts": RecordedTopic(kind=DIAGNOSTICS, offered=RESULT),
    "alarm": RecordedTopic(kind="std_msgs/msg/Bool", offered=STATE),
    "/diagnostics": RecordedTopic(kind=DIAGNOSTICS, offered=EVENT),
}
"""The recorded topics; a topic is listed after the topics on which its content depends.

A topic with a leading slash is outside every namespace.
"""


POSE_SOURCES, CLOUD_SOURCES = "sources", "source_cloud"
"""The topics of TOPICS on which sensors publish sources, if a site does not name other topics."""


class RecordedSensors(NamedTuple):
    """The recorded topics of sources, one for each sensor, as in the parameters of the nodes.

    poses, clouds : topics with messages of type POSES, and of type CLOUD
    """

    poses: tuple[str, ...] = (POSE_SOURCES,)
    clouds: tuple[str, ...] = (CLOUD_SOURCES,)

    def check(self) -> None:
        """Raise InputError if a topic is given twice, or is a topic of rpf3d for other data than sources."""
        given = (*self.poses, *self.clouds)
        for name in given:
            if given.count(name) > 1:
                raise InputError(f"{name} is given twice: see {IN_PARAMETERS}")
            if name in TOPICS and name not in (POSE_SOURCES, CLOUD_SOURCES):
                raise InputError(f"{name} is a topic of rpf3d that has no sources of a sensor: see {IN_PARAMETERS}")


def check_full_names(sensors: Sequence[str], full_name: Callable[[str], str]) -> None:
    """Raise InputError if two topics of sources are one topic, or if one is a topic of rpf3d for other data.

    Two spellings, such as `a` and `/a`, or a remapping, may mean the same topic.

    sensors : names of the topics as in the parameters; full_name : returns the full name of a topic, after remapping
    """
    known = {full_name(name): name for name in TOPICS if name not in (POSE_SOURCES, CLOUD_SOURCES)}
    for name in sensors:
        full = full_name(name)
        if full in known:
            other = "a topic of rpf3d without sources" if known[full] in TOPICS else f"the same topic as {known[full]}"
            raise InputError(f"{name} is {other}, {full}: see {IN_PARAMETERS}")
        known[full] = name


DEFAULT_SENSORS = RecordedSensors()

IN_PARAMETERS = "source_topics and source_cloud_topics"
"""The parameters of the nodes that name the topics of sources."""


def topics_with(sensors: RecordedSensors) -> dict[str, RecordedTopic]:
    """Return TOPICS with the topics of these sensors in place of `sources` and `source_cloud`, in the same order."""
    replaced = {POSE_SOURCES: sensors.poses, CLOUD_SOURCES: sensors.clouds}
    return {name: topic for key, topic in TOPICS.items() for name in replaced.get(key, (key,))}


def topic_called(name: str, namespace: str = "", topics: Mapping[str, RecordedTopic] = TOPICS) -> str | None:
    """Return the key in `topics` of a topic with a given full name; None if the topic is not recorded.

    name : full name, as in a bag; namespace : namespace of the nodes, with or without slashes; "" for none

    >>> topic_called("/mine/terrain/mesh", "/mine"), topic_called("/diagnostics", "/mine"), topic_called("/odom")
    ('terrain/mesh', '/diagnostics', None)
    """
    if name in topics:
        return name
    root = "/" + namespace.strip("/")
    inside = name.removeprefix(root.rstrip("/") + "/")
    return inside if inside != name and inside in topics else None
