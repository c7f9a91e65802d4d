"""Judge the publishers of all topics, and report faults to the alert and to the part `inputs` of the diagnostics."""

import time
from collections.abc import Mapping, Sequence

from rclpy.node import Node
from rclpy.qos import QoSProfile

from rpf3d_ros.alerts.source_topics import BY_HAND
from rpf3d_ros.engine.publisher_watch import (
    MUTE_AREA,
    MUTE_SENSOR,
    MuteTopics,
    PublisherFinding,
    PublisherWatch,
    SeenPublisher,
    WatchedTopic,
    sentences_by_topic,
)
from rpf3d_ros.engine.station import Station
from rpf3d_ros.engine.unlisted_sensors import unlisted_findings, unlisted_topics
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.interface.parameters import SensorTopics, SimulatorParameters
from rpf3d_ros.interface.recorded_topics import CLOUD, POSES, TOPICS
from rpf3d_ros.messages.health import ERROR, OK, WARN

SHARED = (BY_HAND, "terrain/update")
"""Topics that several programs may publish: people click in several viewers, several scanners send patches."""

SENSORS = "sources"
"""Name of the group of topics on which sensors publish sources."""

LOOK = 1.0
"""Shortest time (s) between two checks of the publishers of all topics."""


def watched_topics(inputs: Mapping[str, QoSProfile], sensors: SensorTopics) -> list[WatchedTopic]:
    """Return the topics whose publishers are judged: all inputs, and the node's own alerts.

    inputs : quality of service of the subscription to each input, by topic; sensors : topics of sources
    """
    poses, clouds = sensors.poses, sensors.clouds
    groups = {**dict.fromkeys((*poses, *clouds), SENSORS), "terrain/points": "terrain", "terrain/mesh": "terrain"}
    kinds = {topic: POSES if topic in poses else CLOUD for topic in (*poses, *clouds)}
    kinds |= {topic: TOPICS[topic].kind for topic in inputs if topic not in kinds}
    return [
        *(
            WatchedTopic(name=topic, kind=kinds[topic], qos=qos, is_single=topic not in SHARED,
                         group=groups.get(topic, ""))
            for topic, qos in inputs.items()
        ),
        *(WatchedTopic(name=topic, kind=TOPICS[topic].kind, qos=None) for topic in ("alerts", "alarm")),
    ]  # fmt: skip


class PublisherReports:
    """Checks the publishers of all topics at intervals, and reports their faults. Only one thread may call this."""

    def __init__(
        self, node: Node, inputs: Mapping[str, QoSProfile], parameters: SimulatorParameters, station: Station,
        health: HealthReport,
    ) -> None:  # fmt: skip
        """Create an object that has not looked at any publisher yet.

        inputs : quality of service of the node's subscription to each input, by topic
        station, health : receive the faults, and the state of the part `inputs` of the diagnostics
        """
        self._node, self._station, self._health = node, station, health
        self._sensors = parameters.sensors
        self._watched = watched_topics(inputs, parameters.sensors)
        self._received = [node.resolve_topic_name(topic.name) for topic in self._watched]
        self._watch = PublisherWatch(self._watched, parameters.publisher_overlap)
        sensors = (topic for topic in self._watched if topic.group == SENSORS)
        areas = (topic for topic in self._watched if topic.name in station.watched_area_topics)
        self._mute = (
            MuteTopics(sensors, station.sources_max_age_s, MUTE_SENSOR),
            MuteTopics(areas, station.sources_max_age_s, MUTE_AREA),
        )
        self._may_be_mute = [name for each in self._mute for name in each.names]
        self._look_at = 0.0

    def look_soon(self) -> None:
        """Make the next call of `look` check all publishers, even within LOOK seconds of the last check."""
        self._look_at = 0.0

    def look(self) -> None:
        """Judge the publishers of all topics, at most every LOOK seconds; call this regularly."""
        now = time.monotonic()
        if now < self._look_at:
            return
        self._look_at = now + LOOK
        seen = {topic.name: self.of(topic.name) for topic in self._watched}
        wrong, mute = self._watch.findings(seen, now), [one for each in self._mute for one in each.findings(seen, now)]
        for topic, sentence in sentences_by_topic(wrong, seen).items():
            self._station.report_fault(f"publishers: {topic}", sentence)
        for topic, sentence in sentences_by_topic(mute, self._may_be_mute).items():
            self._station.report_fault(f"mute: {topic}", sentence)
        self._report([*wrong, *mute, *self._unlisted()], seen)

    def understood(self, topic: str) -> None:
        """Record that a message of a topic was accepted; the fault of a mute topic then ends at the next check."""
        for each in self._mute:
            each.understood(topic)

    def _unlisted(self) -> list[PublisherFinding]:
        """Return a warning for each topic that looks like sources of a sensor, but that no simulator receives."""
        graph, namespace = self._node.get_topic_names_and_types(), self._node.get_namespace()
        found = unlisted_topics(graph, self._sensors, self._received, namespace)
        publishers = {topic: [one.node for one in self.of(topic)] for topic in found}
        receivers = {
            topic: [one.node_name for one in self._node.get_subscriptions_info_by_topic(topic)] for topic in found
        }
        return unlisted_findings(found, publishers, receivers, self._node.get_name())

    def _report(self, findings: Sequence[PublisherFinding], seen: Mapping[str, Sequence[SeenPublisher]]) -> None:
        """Report all findings in the diagnostics, with the number of publishers of each topic."""
        level = ERROR if any(each.is_fault for each in findings) else WARN if findings else OK
        counts = {f"publishers.{topic}": str(len(found)) for topic, found in seen.items()}
        summary = "; ".join(each.sentence for each in findings)
        self._health.set("inputs", level, summary or "messages from every publisher can be received", counts)

    def of(self, topic: str) -> list[SeenPublisher]:
        """Return the publishers of a topic in the ROS graph."""
        return [
            SeenPublisher(
                node=f"{one.node_namespace.rstrip('/')}/{one.node_name}",
                kind=one.topic_type,
                qos=one.qos_profile,
                identity=tuple(one.endpoint_gid),
            )
            for one in self._node.get_publishers_info_by_topic(topic)
        ]
