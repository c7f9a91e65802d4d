"""Publish each answer on several latched topics, with the stamp of its sources, only while the node is active."""

from collections.abc import Iterator
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import OccupancyGrid
from rclpy.lifecycle import LifecycleNode
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from rpf3d_core.live.answers import Answer
from rpf3d_core.live.shown_areas import shown_areas
from rpf3d_core.live.zones import shown_zones
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.interface.publishing import publish
from rpf3d_ros.interface.qos import LATCHED, OVERRIDABLE
from rpf3d_ros.messages.answer_content import content_of, warnings_of
from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.diagnostic_messages import of_unit
from rpf3d_ros.messages.hazard_messages import hazard_points, occupancy_grid
from rpf3d_ros.messages.marker_messages import area_markers, trajectory_markers, zone_markers
from rpf3d_ros.messages.result_messages import ResultFacts, results_message
from rpf3d_ros.messages.stamps import stamp_of

TOPICS = {
    "trajectories": MarkerArray,
    "trajectories/points": PointCloud2,
    "impacts": PointCloud2,
    "deposits": PointCloud2,
    "hazard/grid": OccupancyGrid,
    "hazard/points": PointCloud2,
    "hazard/zones": MarkerArray,
    "areas/outlines": MarkerArray,
    "results": DiagnosticArray,
}


class AnswerPublishers:
    """The publishers of all messages of an answer, one for each topic in TOPICS."""

    def __init__(self, node: LifecycleNode) -> None:
        self._publishers = {
            topic: node.create_lifecycle_publisher(kind, topic, LATCHED, qos_overriding_options=OVERRIDABLE)
            for topic, kind in TOPICS.items()
        }
        self._node = node
        self.closed = False

    def publish(self, answer: Answer, parameters: SimulatorParameters, made: Time) -> None:
        """Publish all messages of an answer, `results` last; stop if the node is no longer active.

        DDS keeps no order between topics: a subscriber that has received `results` may still lack other messages.

        made : time when the answer was made
        """
        header = Header(frame_id=parameters.map_frame, stamp=stamp_of(answer.trigger.stamp_ns))
        for topic, message in messages_of(header, answer, parameters, made):
            if self.closed or not self._publishers[topic].is_activated:
                return
            if isinstance(message, DiagnosticArray):
                message = of_unit(message, self._node.get_namespace())
            publish(self._node, self._publishers[topic], message)


def messages_of(
    header: Header, answer: Answer, parameters: SimulatorParameters, made: Time
) -> Iterator[tuple[str, Any]]:
    """Yield (topic, message) for each topic of an answer; each message is made only when the caller asks for it.

    The hazard grid is first, because it is the most urgent message; `results` is last.

    header : frame and stamp of all messages; made : time when the answer was made
    """
    terrain, scene, result = answer.standing.ground.terrain, answer.standing.scene, answer.result
    cells = answer.standing.cells
    yield "hazard/grid", occupancy_grid(header, answer.maps, cells, terrain.frame, made)
    content = content_of(answer, parameters.trajectory_step)
    most, points_each = parameters.displayed_trajectories, parameters.points_per_trajectory
    yield "trajectories", trajectory_markers(header, content.trajectories, most, points_each, result)
    zones = shown_zones(answer.maps, terrain, scene.hazard.reach_levels)
    yield "hazard/zones", zone_markers(header, zones, result)
    yield "hazard/points", hazard_points(header, answer.maps, cells, terrain.frame, result)
    areas = shown_areas(answer.areas, cells, answer.maps.raster, terrain.frame)
    yield "areas/outlines", area_markers(header, areas, result)
    yield "trajectories/points", cloud_of_columns(header, content.trajectories)
    yield "impacts", cloud_of_columns(header, content.impacts)
    yield "deposits", cloud_of_columns(header, content.deposits)
    yield "results", results_message(header, facts_of_answer(answer))


def facts_of_answer(answer: Answer) -> ResultFacts:
    """Return the figures of an answer for the topic `results`."""
    return ResultFacts(
        result=answer.result, stage=answer.stage, complete=answer.complete, rocks=answer.rocks,
        sources=answer.sources, seed=answer.standing.scene.seed, seconds=answer.seconds,
        terrain_digest=answer.standing.ground.digest, sources_digest=answer.trigger.digest,
        outcomes={outcome.name.lower(): count for outcome, count in answer.outcomes.items()},
        warning="; ".join(warnings_of(answer)),
    )  # fmt: skip
