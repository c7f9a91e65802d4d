"""The recorded topics and their message types, for the live recorder, the bag writer and both readers of bags."""

from importlib import import_module
from typing import Any, NamedTuple

CLOUD, MARKERS, DIAGNOSTICS = (
    "sensor_msgs/msg/PointCloud2",
    "visualization_msgs/msg/MarkerArray",
    "diagnostic_msgs/msg/DiagnosticArray",
)
POSES = "geometry_msgs/msg/PoseArray"

STATE, EVENT, RESULT, TERRAIN = "state", "event", "result", "terrain"
"""Kinds of topics: last message latched; not latched; latched with many waiting messages; durability by parameter."""


class RecordedTopic(NamedTuple):
    """The type and kind of a recorded topic.

    kind : type of its messages
    offered : STATE, EVENT, RESULT or TERRAIN
    given : whether the topic is an input of the simulator
    """

    kind: str
    offered: str
    given: bool = False

    @property
    def message_class(self) -> Any:
        """Return rclpy's class of its messages; the only part of this file that needs ROS."""
        module, _, name = self.kind.rpartition("/")
        return getattr(import_module(module.replace("/", ".")), name)


TOPICS: dict[str, RecordedTopic] = {
    "terrain/points": RecordedTopic(CLOUD, TERRAIN, given=True),
    "terrain/mesh": RecordedTopic("shape_msgs/msg/Mesh", TERRAIN, given=True),
    "terrain/update": RecordedTopic(CLOUD, EVENT, given=True),
    "sources": RecordedTopic(POSES, EVENT, given=True),
    "/clicked_point": RecordedTopic("geometry_msgs/msg/PointStamped", EVENT, given=True),
    "source_cloud": RecordedTopic(CLOUD, EVENT, given=True),
    "areas/polygon": RecordedTopic("geometry_msgs/msg/PolygonStamped", EVENT, given=True),
    "areas/equipment": RecordedTopic(POSES, EVENT, given=True),
    "trajectories": RecordedTopic(MARKERS, RESULT),
    "trajectories/points": RecordedTopic(CLOUD, RESULT),
    "impacts": RecordedTopic(CLOUD, RESULT),
    "deposits": RecordedTopic(CLOUD, RESULT),
    "hazard/zones": RecordedTopic(MARKERS, RESULT),
    "areas/outlines": RecordedTopic(MARKERS, RESULT),
    "hazard/points": RecordedTopic(CLOUD, RESULT),
    "hazard/grid": RecordedTopic("nav_msgs/msg/OccupancyGrid", RESULT),
    "results": RecordedTopic(DIAGNOSTICS, RESULT),
    "alerts": RecordedTopic(DIAGNOSTICS, RESULT),
    "alarm": RecordedTopic("std_msgs/msg/Bool", STATE),
    "/diagnostics": RecordedTopic(DIAGNOSTICS, EVENT),
}
"""Recorded topics, each after the topics that its content depends on; a leading slash is outside every namespace."""


def topic_called(name: str, namespace: str = "") -> str | None:
    """Return the key in TOPICS of a topic's full name, as in a bag; None if the topic is not recorded.

    >>> topic_called("/mine/terrain/mesh", "/mine"), topic_called("/diagnostics", "/mine"), topic_called("/odom")
    ('terrain/mesh', '/diagnostics', None)
    """
    if name in TOPICS:
        return name
    root = "/" + namespace.strip("/")
    inside = name.removeprefix(root.rstrip("/") + "/")
    return inside if inside != name and inside in TOPICS else None
