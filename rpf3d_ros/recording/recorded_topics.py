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


class Topic(NamedTuple):
    """kind : type of its messages; offered : one of the four above; given : whether it is an input of the simulator."""

    kind: str
    offered: str
    given: bool = False


TOPICS: dict[str, Topic] = {
    "terrain/points": Topic(CLOUD, TERRAIN, given=True),
    "terrain/mesh": Topic("shape_msgs/msg/Mesh", TERRAIN, given=True),
    "terrain/update": Topic(CLOUD, EVENT, given=True),
    "sources": Topic(POSES, EVENT, given=True),
    "/clicked_point": Topic("geometry_msgs/msg/PointStamped", EVENT, given=True),
    "source_cloud": Topic(CLOUD, EVENT, given=True),
    "areas/polygon": Topic("geometry_msgs/msg/PolygonStamped", EVENT, given=True),
    "areas/equipment": Topic(POSES, EVENT, given=True),
    "trajectories": Topic(MARKERS, RESULT),
    "trajectories/points": Topic(CLOUD, RESULT),
    "impacts": Topic(CLOUD, RESULT),
    "deposits": Topic(CLOUD, RESULT),
    "hazard/zones": Topic(MARKERS, RESULT),
    "areas/outlines": Topic(MARKERS, RESULT),
    "hazard/points": Topic(CLOUD, RESULT),
    "hazard/grid": Topic("nav_msgs/msg/OccupancyGrid", RESULT),
    "results": Topic(DIAGNOSTICS, RESULT),
    "alerts": Topic(DIAGNOSTICS, RESULT),
    "alarm": Topic("std_msgs/msg/Bool", STATE),
    "/diagnostics": Topic(DIAGNOSTICS, EVENT),
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
