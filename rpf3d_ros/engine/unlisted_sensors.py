"""Find topics that look like sources of a sensor, but that the simulator does not receive."""

from collections.abc import Iterable, Mapping, Sequence

from rpf3d_ros.engine.publisher_watch import PublisherFinding
from rpf3d_ros.interface.parameters import SensorTopics
from rpf3d_ros.interface.recorded_topics import CLOUD, CLOUD_SOURCES, POSE_SOURCES, POSES

UNLISTED = "unlisted sensors"
"""Name of the group of topics in the findings."""


def unlisted_topics(
    topics: Iterable[tuple[str, Sequence[str]]], sensors: SensorTopics, received: Iterable[str], namespace: str
) -> dict[str, str]:
    """Return the topics that look like sources of a sensor but are not received: full name -> parameter for the topic.

    A topic looks like sources if it is in the node's namespace, has the type of sources, and the last part of its name
    is that of a listed or default topic of this type: `radar_east/sources`, if `radar_north/sources` is listed.

    topics : full name and types of each topic in the ROS graph; sensors : the listed topics, as in the parameters
    received : full names of the topics that the node subscribes to; namespace : of the node, such as "/pit_a" or "/"
    """
    parameters = {POSES: "source_topics", CLOUD: "source_cloud_topics"}
    endings = {
        POSES: {_last_part(name) for name in (*sensors.poses, POSE_SOURCES)},
        CLOUD: {_last_part(name) for name in (*sensors.clouds, CLOUD_SOURCES)},
    }
    inside, known = namespace.rstrip("/") + "/", set(received)
    return {
        name: parameters[kind]
        for name, kinds in topics
        for kind in kinds
        if kind in endings and name.startswith(inside) and name not in known and _last_part(name) in endings[kind]
    }


def unlisted_findings(
    unlisted: Mapping[str, str], publishers: Mapping[str, Sequence[str]], receivers: Mapping[str, Sequence[str]],
    simulator: str,
) -> list[PublisherFinding]:  # fmt: skip
    """Return a warning for each topic of `unlisted_topics` that has a publisher and that no other simulator receives.

    publishers, receivers : full names of the nodes that publish and receive each topic
    simulator : name of the simulator's node without its namespace; another simulator has the same name
    """
    return [
        PublisherFinding(
            UNLISTED,
            f"{topic} of {', '.join(sorted(set(publishers[topic])))} is not received: if it is a sensor, add it to "
            f"{parameter}",
            is_fault=False,
        )
        for topic, parameter in sorted(unlisted.items())
        if publishers[topic] and simulator not in map(_last_part, receivers[topic])
    ]


def _last_part(name: str) -> str:
    """Return the last part of the name of a topic or node: "sources" for "/pit_a/radar_east/sources"."""
    return name.rpartition("/")[2]
