"""The topics that results go out on; all latched, all stamped as the sources that caused them."""

from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from rpf3d_ros.cloud_messages import cloud_of_columns
from rpf3d_ros.marker_messages import trajectory_markers, zone_markers
from rpf3d_ros.parameters import SimulatorParameters
from rpf3d_ros.qos import LATCHED, OVERRIDABLE
from rpf3d_ros.results import Results

TOPICS = {
    "trajectories/points": PointCloud2,
    "impacts": PointCloud2,
    "deposits": PointCloud2,
    "trajectories": MarkerArray,
    "hazard/zones": MarkerArray,
}


class ResultPublishers:
    """Publishers of trajectories, trajectories/points, impacts, deposits and hazard/zones."""

    def __init__(self, node: Node, parameters: SimulatorParameters) -> None:
        self._most, self._points_each = parameters.displayed_trajectories, parameters.points_per_trajectory
        self._publishers = {
            topic: node.create_publisher(kind, topic, LATCHED, qos_overriding_options=OVERRIDABLE)
            for topic, kind in TOPICS.items()
        }
        self._node = node
        self.closed = False

    def publish(self, header: Header, results: Results) -> None:
        """Publish everything of a run; hazard/zones comes last, so who waits for it has the rest."""
        messages = {
            "trajectories/points": cloud_of_columns(header, results.trajectories),
            "impacts": cloud_of_columns(header, results.impacts),
            "deposits": cloud_of_columns(header, results.deposits),
            "trajectories": trajectory_markers(header, results.trajectories, self._most, self._points_each),
            "hazard/zones": zone_markers(header, results.hazard),
        }
        for topic, message in messages.items():
            if not self.closed and self._node.context.ok():
                self._publishers[topic].publish(message)
