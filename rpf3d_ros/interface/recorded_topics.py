"""The topics that are recorded and their types: for the live recorder, the bag writer and both readers of bags."""

from typing import NamedTuple

CLOUD, MARKERS, DIAGNOSTICS = (
    "sensor_msgs/msg/PointCloud2",
    "visualization_msgs/msg/MarkerArray",
    "diagnostic_msgs/msg/DiagnosticArray",
)
POSES = "geometry_msgs/msg/PoseArray"

STATE, EVENT, RESULT, TERRAIN = "state", "event", "result", "terrain"
"""How a topic is offered: latched with the last one, not kept, latched with many waiting, as the parameter says."""


class RecordedTopic(NamedTuple):
    """kind : type of its messages; offered : one of the four above; given : whether it is an input of the simulator."""

    kind: str
    offered: str
    given: bool = False


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
"""In the order in which what they show depends on each other; a leading slash stands outside every namespace."""


def topic_called(name: str, namespace: str = "") -> str | None:
    """The key in TOPICS of a topic's full name, as in a bag; None where it is not one that is recorded.

    >>> topic_called("/mine/terrain/mesh", "/mine"), topic_called("/diagnostics", "/mine"), topic_called("/odom")
    ('terrain/mesh', '/diagnostics', None)
    """
    if name in TOPICS:
        return name
    root = "/" + namespace.strip("/")
    inside = name.removeprefix(root.rstrip("/") + "/")
    return inside if inside != name and inside in TOPICS else None
