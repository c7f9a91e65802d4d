"""The inputs of an active simulator: each message is checked, converted if that is quick, and put in a queue."""

import threading
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PointStamped, PolygonStamped, PoseArray
from rclpy._rclpy_pybind11 import RMWError
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh
from std_msgs.msg import Header

from rpf3d_core.errors import InputError
from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.engine.builder import Arrival
from rpf3d_ros.engine.large_messages import LargeMessages, LargeTopic
from rpf3d_ros.engine.stamp_guards import StampGuards
from rpf3d_ros.engine.station import Station
from rpf3d_ros.engine.waiting_terrain import Moment
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.interface.qos import EVENTS, OVERRIDABLE, terrain_qos
from rpf3d_ros.messages.area_messages import EQUIPMENT, LIVE_AREA, rings_of_equipment, rings_of_polygon
from rpf3d_ros.messages.health import ERROR, OK, WARN
from rpf3d_ros.messages.source_messages import Sources, sources_of_cloud, sources_of_point, sources_of_poses
from rpf3d_ros.messages.stamps import nanoseconds
from rpf3d_ros.messages.terrain_messages import Buffer, check_cloud, check_mesh, mesh_of_cdr, survey_of_cloud


class Inputs:
    """The subscriptions of an active simulator node, and what is done with each message."""

    def __init__(
        self, node: LifecycleNode, parameters: SimulatorParameters, station: Station, health: HealthReport
    ) -> None:
        self._node, self._parameters, self._station, self._health = node, parameters, station, health
        self._frame = parameters.frame
        self.guards = StampGuards(parameters.most_ahead)
        self._refused, self._counting = 0, threading.Lock()
        terrain = terrain_qos(parameters.terrain_durability)
        many = QoSProfile(depth=parameters.waiting_patches, reliability=EVENTS.reliability)
        self._subscriptions = [
            self._subscribe(PoseArray, "sources", self.on_poses, EVENTS),
            self._subscribe(PointStamped, "/clicked_point", self.on_point, EVENTS),
            self._subscribe(PointCloud2, "source_cloud", self.on_cloud, EVENTS),
            self._subscribe(PolygonStamped, "areas/polygon", self.on_polygon, EVENTS),
            self._subscribe(PoseArray, "areas/equipment", self.on_equipment, EVENTS),
        ]
        surveys = (
            LargeTopic(kind=PointCloud2, name="terrain/update", take=self.on_update, qos=many),
            LargeTopic(kind=PointCloud2, name="terrain/points", take=self.on_points, qos=terrain),
            LargeTopic(kind=Mesh, name="terrain/mesh", take=self.on_mesh, qos=terrain),
        )
        self._surveys = LargeMessages(node, surveys, lambda why: health.set("terrain", ERROR, why))

    def close(self) -> None:
        """End all subscriptions."""
        self._surveys.close()
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions = []

    # --- on the thread of the surveys

    def on_points(self, data: Buffer, published_ns: int) -> None:
        """Take a point cloud (CDR bytes) as the new terrain: points in rows, or scattered points."""
        self._survey("terrain/points", data, lambda cloud: self._whole(cloud, published_ns))

    def on_mesh(self, data: Buffer, published_ns: int) -> None:
        """Take a mesh (CDR bytes) as the new terrain; its time of arrival counts as its stamp."""
        now = self._now()

        def take() -> None:
            frame, mesh_frame, most = self._frame, self._parameters.mesh_frame, self._parameters.most_points
            frame.check(mesh_frame)
            check_mesh(data, most)
            arrival = Arrival(convert=lambda: mesh_of_cdr(data, frame, mesh_frame, most), stamp_ns=now, data=data)
            self._station.terrain.put_whole(arrival, Moment(published_ns))

        self._try("terrain", take)

    def on_update(self, data: Buffer, published_ns: int) -> None:
        """Take a point cloud (CDR bytes) as a patch, which replaces a part of the terrain."""

        def take(cloud: PointCloud2) -> None:
            arrival = self._arrival(cloud)
            self._station.terrain.put_patch(arrival, Moment(published_ns, arrival.stamp_ns))

        self._survey("terrain/update", data, take)

    # --- on the executor's thread

    def on_poses(self, poses: PoseArray) -> None:
        """Take each pose as a source of rocks; a message without poses means that no rock is moving."""
        speed = self._parameters.release_speed
        self._sources("sources", poses.header, lambda: sources_of_poses(poses, self._frame, speed))

    def on_point(self, point: PointStamped) -> None:
        """Take a clicked point as a source of rocks."""
        self._sources("/clicked_point", point.header, lambda: sources_of_point(point, self._frame))

    def on_cloud(self, cloud: PointCloud2) -> None:
        """Take each point of a cloud as a source of rocks, with size and velocity if the cloud has these fields."""
        self._sources("source_cloud", cloud.header, lambda: sources_of_cloud(cloud, self._frame))

    def on_polygon(self, polygon: PolygonStamped) -> None:
        """Set the live area of interest to a polygon."""
        self._area("areas/polygon", polygon.header, LIVE_AREA, lambda: rings_of_polygon(polygon, self._frame))

    def on_equipment(self, poses: PoseArray) -> None:
        """Set the areas of interest around equipment to circles."""
        radius = self._parameters.equipment_radius
        self._area("areas/equipment", poses.header, EQUIPMENT, lambda: rings_of_equipment(poses, self._frame, radius))

    def _now(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)

    def _subscribe(self, kind: Any, topic: str, callback: Callable[[Any], None], qos: QoSProfile) -> Any:
        return self._node.create_subscription(kind, topic, callback, qos, qos_overriding_options=OVERRIDABLE)

    def _whole(self, cloud: PointCloud2, published_ns: int) -> None:
        arrival = self._arrival(cloud)
        self._station.terrain.put_whole(arrival, Moment(published_ns, arrival.stamp_ns))
        self.guards.note("terrain/update", arrival.stamp_ns)  # a patch with an older stamp is out of date

    def _survey(self, topic: str, data: Buffer, take: Callable[[PointCloud2], None]) -> None:
        """Take a point cloud as bytes, because rclpy would drop an unreadable message silently."""
        try:
            cloud = deserialize_message(bytes(data), PointCloud2)
        except RMWError as error:
            self._refuse("terrain", f"no sensor_msgs/PointCloud2 can be read from its bytes: {error}")
            return
        self._take("terrain", topic, cloud.header, lambda: take(cloud))

    def _arrival(self, cloud: PointCloud2) -> Arrival:
        frame, most, stamp = self._frame, self._parameters.most_points, nanoseconds(cloud.header.stamp)
        check_cloud(cloud, frame, most)
        return Arrival(convert=lambda: survey_of_cloud(cloud, frame, most), stamp_ns=stamp)

    def _sources(self, topic: str, header: Header, convert: Callable[[], Sources]) -> None:
        def take() -> None:
            found = convert()
            stamp = nanoseconds(header.stamp)
            trigger = trigger_of(found.positions, found.velocities, found.diameters, stamp, topic)
            sentence = "received" if len(found.positions) else "received: watched, and nothing seen"
            self._health.set("sources", OK, sentence, {"sources": str(len(found.positions)), "topic": topic})
            self._station.submit(trigger)

        self._take("sources", topic, header, take)

    def _area(self, topic: str, header: Header, name: str, convert: Callable[[], Any]) -> None:
        def take() -> None:
            rings = convert()
            self._station.flyer.set_areas(topic, {name: rings} if rings else {})
            self._health.set("areas", OK, "received", {"topic": topic, "rings": str(len(rings))})

        self._take("areas", topic, header, take)

    def _take(self, part: str, topic: str, header: Header, take: Callable[[], None]) -> None:
        """Take a message if its stamp is neither older than the last stamp of its topic nor in the future."""
        stamp = nanoseconds(header.stamp)

        def guarded() -> None:
            self.guards.check(topic, stamp, self._now())
            take()
            self.guards.note(topic, stamp)

        self._try(part, guarded)

    def _try(self, part: str, take: Callable[[], None]) -> None:
        try:
            take()
        except InputError as refusal:
            self._refuse(part, str(refusal))

    def _refuse(self, part: str, why: str) -> None:
        with self._counting:  # two threads may refuse at once
            self._refused += 1
            count = self._refused
        self._health.set(part, WARN, f"message refused: {why}", {"refused": str(count)})
