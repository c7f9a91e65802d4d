"""The node rpf3d_recorder: subscribes to terrain, sources, results and diagnostics and logs them to a .rrd."""

from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh
from visualization_msgs.msg import MarkerArray

from rpf3d_core.errors import InputError
from rpf3d_ros.health import ERROR, OK, WARN
from rpf3d_ros.health_report import HealthReport
from rpf3d_ros.message_log import COUNT_OF_RECORDED, MessageLog
from rpf3d_ros.parameters import RecorderParameters, declare
from rpf3d_ros.qos import EVENTS, OVERRIDABLE, RESULTS, terrain_qos
from rpf3d_ros.recorder_node import NAME
from rpf3d_ros.recording import Recording

RECORDING = COUNT_OF_RECORDED.removeprefix(f"{NAME}: ")
"""The part of /diagnostics that counts the messages recorded, by topic."""

DIAGNOSTICS = "/diagnostics"


class RecorderNode(Node):
    """Receives, converts, logs; every message is in the file before the next one is taken."""

    def __init__(self) -> None:
        super().__init__(NAME)
        parameters = declare(self, RecorderParameters)
        self.file = parameters.file
        self.recording = Recording(Path(parameters.file))
        self.recorded: Counter[str] = Counter()
        self.health = HealthReport(self)
        self._say_recorded()
        log = MessageLog(self.recording, parameters.frame, parameters.mesh_frame, self._now)
        self._subscribe(log, terrain_qos(parameters.terrain_durability))

    def _now(self) -> Time:
        return self.get_clock().now().to_msg()

    def _subscribe(self, log: MessageLog, terrain: QoSProfile) -> None:
        self._listen(PointCloud2, "terrain/points", log.grid, terrain)
        self._listen(Mesh, "terrain/mesh", log.mesh, terrain, raw=True)
        self._listen(PoseArray, "sources", log.sources, EVENTS)
        self._listen(MarkerArray, "trajectories", log.trajectories, RESULTS)
        for topic in ("trajectories/points", "impacts", "deposits"):
            self._listen(PointCloud2, topic, partial(log.cloud, topic), RESULTS)
        self._listen(MarkerArray, "hazard/zones", log.hazard, RESULTS)
        self._listen(DiagnosticArray, DIAGNOSTICS, log.diagnostics, EVENTS)

    def _listen(self, kind: Any, topic: str, log: Callable[[Any], None], qos: QoSProfile, raw: bool = False) -> None:
        receive = partial(self._record, topic, log)
        self.create_subscription(kind, topic, receive, qos, qos_overriding_options=OVERRIDABLE, raw=raw)

    def _record(self, topic: str, log: Callable[[Any], None], message: Any) -> None:
        try:
            log(message)
            self.recording.flush()
        except InputError as refusal:
            self.health.set(topic, WARN, f"message refused: {refusal}")
        except (OSError, RuntimeError) as error:  # rerun raises either where the file cannot be written
            self.health.set(topic, ERROR, f"{self.file} could not be written: {error}")
        else:
            self._count(topic)

    def _count(self, topic: str) -> None:
        if topic != DIAGNOSTICS:  # counting these would make another one each time
            self.recorded[topic] += 1
            self._say_recorded()

    def _say_recorded(self) -> None:
        counts = {topic: str(count) for topic, count in self.recorded.items()}
        self.health.set(RECORDING, OK, f"writing {self.file}", counts)

    def destroy_node(self) -> None:
        """Close the recording: a file without its footer has to be repaired before it verifies."""
        self.health.closed = True
        if hasattr(self, "recording"):
            try:
                self.recording.close()
            except (OSError, RuntimeError) as error:
                self.get_logger().error(f"{self.file} could not be closed and may not verify: {error}")
        super().destroy_node()
