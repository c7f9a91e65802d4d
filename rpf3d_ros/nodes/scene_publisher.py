"""The node rpf3d_scene_publisher: publishes a scene file's terrain and sources in place of a survey and a radar."""

from pathlib import Path

from geometry_msgs.msg import PoseArray
from rclpy.node import Node
from shape_msgs.msg import Mesh
from std_msgs.msg import Header

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.declared_parameters import declare
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.interface.parameters import ScenePublisherParameters
from rpf3d_ros.interface.qos import EVENTS, LATCHED, OVERRIDABLE
from rpf3d_ros.messages.health import OK
from rpf3d_ros.messages.scene_content import SceneContent, scene_content
from rpf3d_ros.messages.source_messages import poses_of_sources
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh

NAME = "rpf3d_scene_publisher"

LOOK_EVERY = 0.25
"""Time (s) between checks for new subscribers; the terrain is published again for each new subscriber."""


class ScenePublisherNode(Node):
    """Reads a scene once; publishes its terrain (latched, and again for new subscribers) and repeats its sources."""

    def __init__(self) -> None:
        super().__init__(NAME)
        self.parameters = declare(self, ScenePublisherParameters)
        self.frame = self.parameters.frame
        content = self._read()
        self.mesh = cdr_of_mesh(content.mesh)
        self.content = content
        self.served, self.repeated = 0, 0
        self.health = HealthReport(self)
        self._report(content)
        self.terrain = self.create_publisher(Mesh, "terrain/mesh", LATCHED, qos_overriding_options=OVERRIDABLE)
        self.sources = self.create_publisher(PoseArray, "sources", EVENTS, qos_overriding_options=OVERRIDABLE)
        self.create_timer(LOOK_EVERY, self.look)
        self.create_timer(self.parameters.repeat_every, self.repeat)
        self.terrain.publish(self.mesh)

    def _read(self) -> SceneContent:
        if not self.parameters.scene:
            raise InputError("parameter scene is not set; it must be the path of a scene file (-p scene:=demo.yaml)")
        return scene_content(Path(self.parameters.scene), self.frame)

    def _report(self, content: SceneContent) -> None:
        slow, fast = content.speeds
        asked = (
            f"{fast:.6g} m/s"
            if slow == fast
            else f"one value for all (the scene has {slow:.6g} to {fast:.6g} m/s)"
        )
        values = {"triangles": str(len(content.mesh.triangles)), "rocks": str(len(content.positions))}
        self.health.set("scene", OK, f"publishing {self.parameters.scene}", {**values, "release_speed": asked})
        counts = f"{len(content.mesh.triangles)} triangles and {len(content.positions)} sources"
        self.get_logger().info(f"publishing {self.parameters.scene}: {counts}")
        where = "in its section of the parameter file if it is set there, because -p does not override it"
        self.get_logger().info(f"poses have no speed: set release_speed of rpf3d_simulator to {asked}, {where}")

    def look(self) -> None:
        """Publish the terrain again if it has new subscribers, and the sources once they have enough subscribers.

        This call publishes the sources only for the first time; `repeat` repeats them.
        """
        subscribers = self.terrain.get_subscription_count()
        if subscribers > self.served:
            self.terrain.publish(self.mesh)
        self.served = subscribers
        if self.repeated == 0 and self.sources.get_subscription_count() >= self.parameters.subscribers:
            self.publish_sources()

    def repeat(self) -> None:
        """Publish the sources again, if they were published before and fewer than `repetitions` times.

        If the parameter `repetitions` is 0, there is no limit.
        """
        most = self.parameters.repetitions
        if self.repeated and (most == 0 or self.repeated < most):
            self.publish_sources()

    def publish_sources(self) -> None:
        """Publish the sources with the current time as stamp."""
        header = Header(stamp=self.get_clock().now().to_msg(), frame_id=self.frame.name)
        self.sources.publish(poses_of_sources(header, self.content.positions, self.content.velocities))
        self.repeated += 1
