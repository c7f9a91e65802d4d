"""The inputs of an active simulator: each message is checked, converted if that is quick, and put in a queue."""

import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from geometry_msgs.msg import PointStamped, PolygonStamped, PoseArray
from rclpy._rclpy_pybind11 import RMWError
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh
from std_msgs.msg import Header

from rpf3d_core.errors import InputError
from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.alerts.source_topics import BY_HAND
from rpf3d_ros.engine.large_messages import LargeMessages, LargeTopic
from rpf3d_ros.engine.message_gaps import MessageGaps, Numbered
from rpf3d_ros.engine.station import Station
from rpf3d_ros.engine.survey_in_use import Arrival
from rpf3d_ros.engine.waiting_terrain import Moment, QueueFull
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.interface.qos import EVENTS, OVERRIDABLE, SOURCES, depth_of, terrain_qos
from rpf3d_ros.interface.transforms import AREAS_STAY, MESH_HAS_NO_STAMP, InputFrames, TransformLookup
from rpf3d_ros.messages.area_messages import EQUIPMENT, LIVE_AREA, rings_of_equipment, rings_of_polygon
from rpf3d_ros.messages.health import ERROR, OK, WARN
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.source_messages import (
    Sources,
    doubt_of_poses,
    sources_of_cloud,
    sources_of_point,
    sources_of_poses,
)
from rpf3d_ros.messages.stamps import nanoseconds
from rpf3d_ros.messages.terrain_messages import Buffer, check_cloud, check_mesh, mesh_of_cdr, survey_of_cloud
from rpf3d_ros.nodes.frames_on_arrival import FramesOnArrival
from rpf3d_ros.nodes.publisher_reports import PublisherReports

TERRAIN_KINDS = {"terrain/points": "whole", "terrain/mesh": "whole", "terrain/update": "patch"}
"""The topics of terrain, and whether their messages are whole surveys or patches."""


def part_of(topic: str) -> str:
    """Return the part of the diagnostics that reports on an input topic.

    >>> part_of("terrain/update"), part_of("areas/polygon"), part_of("source_cloud")
    ('terrain', 'areas', 'sources')
    """
    part = topic.partition("/")[0]
    return part if part in ("terrain", "areas") else "sources"


class Inputs:
    """The subscriptions of an active simulator node, with a method for each kind of message."""

    def __init__(
        self, node: LifecycleNode, parameters: SimulatorParameters, station: Station, health: HealthReport,
        notice_jump: Callable[[], object], transforms: TransformLookup | None = None,
    ) -> None:  # fmt: skip
        """Subscribe to all topics.

        notice_jump : forgets all sources if the clock went back; called before each message of sources or areas is
            processed, so that this message is not forgotten together with older messages
        transforms : provider of transforms of other frames; None to refuse other frames
        """
        self._notice_jump = notice_jump
        self._node, self._parameters, self._station, self._health = node, parameters, station, health
        frames = InputFrames(parameters.frame, transforms, parameters.transforms_max_age_s)
        self._frames = FramesOnArrival(frames, is_patient=transforms is not None)
        self.guards = station.guards
        self._refused, self._lost, self._counting = 0, 0, threading.Lock()
        self._middleware = ""
        self._gaps: dict[str, MessageGaps] = {}
        self._doubts: dict[str, str] = {}
        terrain = terrain_qos(parameters.terrain_durability)
        many = QoSProfile(depth=parameters.waiting_patches, reliability=EVENTS.reliability)
        self._events = SubscriptionEventCallbacks(incompatible_qos=lambda _: self.publishers.look_soon())
        sensors = parameters.sensors
        self._subscriptions = {
            **{topic: self._subscribe_sensor(PoseArray, topic, self.on_poses) for topic in sensors.poses},
            **{topic: self._subscribe_sensor(PointCloud2, topic, self.on_cloud) for topic in sensors.clouds},
            BY_HAND: self._subscribe(PointStamped, "clicked_point", self.on_point, SOURCES),
            "areas/polygon": self._subscribe(PolygonStamped, "areas/polygon", self.on_polygon),
            "areas/equipment": self._subscribe(PoseArray, "areas/equipment", self.on_equipment),
        }  # gaps matter for sources and patches only: the last message of areas or a whole survey replaces all earlier
        for topic in (*sensors.poses, *sensors.clouds):
            self._gaps[topic] = MessageGaps(depth_of(self._subscriptions[topic].qos_profile))
        surveys = (
            LargeTopic(kind=PointCloud2, name="terrain/update", take=self.on_update, qos=many, lost=self._lose_patches),
            LargeTopic(kind=PointCloud2, name="terrain/points", take=self.on_points, qos=terrain),
            LargeTopic(kind=Mesh, name="terrain/mesh", take=self.on_mesh, qos=terrain),
        )
        self._surveys = LargeMessages(
            node, surveys, self._report_middleware, self._refuse_after_error, events=self._events
        )
        own = {topic: each.qos_profile for topic, each in self._subscriptions.items()}
        self.publishers = PublisherReports(node, {**own, **self._surveys.qos}, parameters, station, health)

    def close(self) -> None:
        """Unsubscribe from all inputs."""
        self._frames.close()
        self._surveys.close()
        if self._middleware:
            self._report_middleware("", time.time_ns())
        for subscription in self._subscriptions.values():
            self._node.destroy_subscription(subscription)
        self._subscriptions = {}

    # --- called on the thread that receives large messages

    def _report_middleware(self, why: str, at_ns: int) -> None:
        """Report a fault as long as the middleware cannot deliver terrain messages.

        Terrain messages may be lost during the fault. Therefore the terrain counts as out of date when the fault has
        ended, until a later whole survey is used.

        why : error of the middleware, "" as soon as messages can be taken; at_ns : current time (ns since the epoch)
        """
        if why:
            self._health.set("terrain", ERROR, why)
        else:
            self._station.terrain.refuse("whole", at_ns, self._middleware, stamp_ns=self._now() or None)
            self._station.terrain_refused(self._middleware)
        self._station.report_fault("middleware", f"terrain cannot be received: {why}" if why else "")
        self._middleware = why

    def _lose_patches(self, count: int, before_ns: int) -> None:
        """Report patches that were lost before they could be read: the terrain lacks them.

        count : number of patches; before_ns : when a later patch was published (ns)
        """
        self._station.terrain.refuse("patch", before_ns, count=count, stamp_ns=self._now() or None)
        self._report_lost("terrain/update", count)
        self._station.terrain_refused(f"{count} patches were lost before they could be read")

    def _report_lost(self, topic: str, count: int) -> None:
        with self._counting:
            self._lost += count
            lost = self._lost
        sentence = f"{count} messages on {topic} were lost before they could be read"
        self._health.set(part_of(topic), WARN, sentence, {"lost": str(lost)})

    def _refuse_after_error(self, topic: str, published_ns: int, error: BaseException) -> None:
        """Refuse a terrain message because an unforeseen error occurred while it was checked or queued."""
        why = f"{type(error).__name__}: {error}"
        self._refuse(topic, why, published_ns)
        self._health.set("terrain", ERROR, why)

    def on_points(self, data: Buffer, published_ns: int) -> None:
        """Queue a point cloud (CDR bytes) as the new terrain: points in rows, or scattered points.

        published_ns : when the message was published (ns)
        """
        self._survey("terrain/points", data, lambda cloud: self._whole(cloud, published_ns), published_ns)

    def on_mesh(self, data: Buffer, published_ns: int) -> None:
        """Queue a mesh (CDR bytes) as the new terrain; the time of arrival replaces the missing stamp.

        published_ns : when the message was published (ns)
        """
        now = self._now()

        def take() -> None:
            mesh_frame, most = self._parameters.mesh_frame, self._parameters.most_points
            frame = self._frames.static(mesh_frame, MESH_HAS_NO_STAMP)
            frame.check(mesh_frame)
            check_mesh(data, most)
            arrival = Arrival(
                convert=lambda: mesh_of_cdr(data, frame, mesh_frame, most),
                stamp_ns=now,
                data=data,
                moved_by=frame.other,
            )
            self._station.terrain.put_whole(arrival, Moment(published_ns))

        self._try("terrain/mesh", take, published_ns)

    def on_update(self, data: Buffer, published_ns: int) -> None:
        """Queue a point cloud (CDR bytes) as a patch, which replaces a part of the terrain.

        published_ns : when the message was published (ns)
        """

        def take(cloud: PointCloud2) -> None:
            arrival = self._arrival(cloud)
            self._station.terrain.put_patch(arrival, Moment(published_ns, arrival.stamp_ns))

        self._survey("terrain/update", data, take, published_ns)

    # --- called on the executor's thread

    def on_poses(self, topic: str, poses: PoseArray) -> None:
        """Queue all poses as sources of rocks; a message without poses means that no rock is moving."""
        speed = self._parameters.release_speed
        self._doubts[topic] = doubt_of_poses(poses, speed)
        self._sources(topic, poses.header, lambda frame: sources_of_poses(poses, frame, speed))

    def on_point(self, topic: str, point: PointStamped) -> None:
        """Queue a clicked point as a source of rocks."""
        self._sources(topic, point.header, lambda frame: sources_of_point(point, frame))

    def on_cloud(self, topic: str, cloud: PointCloud2) -> None:
        """Queue all points of a cloud as sources of rocks, with size and velocity if the cloud has these fields."""
        self._sources(topic, cloud.header, lambda frame: sources_of_cloud(cloud, frame))

    def on_polygon(self, topic: str, polygon: PolygonStamped) -> None:
        """Set the live area of interest to a polygon; a polygon without corners deletes the area."""
        self._area(topic, polygon.header, LIVE_AREA, lambda frame: rings_of_polygon(polygon, frame))

    def on_equipment(self, topic: str, poses: PoseArray) -> None:
        """Set the area of interest `equipment` to circles around machines; without poses, the area is deleted."""
        radius = self._parameters.equipment_radius
        self._area(topic, poses.header, EQUIPMENT, lambda frame: rings_of_equipment(poses, frame, radius))

    def _now(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)

    def _subscribe_sensor(self, kind: Any, topic: str, callback: Callable[[str, Any], None]) -> Any:
        """Subscribe to a topic of a sensor, and report a fault whenever messages of the topic were lost."""

        def take(_: str, message: Any, info: Mapping[str, Any]) -> None:
            self._check_gaps(topic, message.header, info)
            callback(topic, message)

        return self._subscribe(kind, topic, take, SOURCES)

    def _subscribe(self, kind: Any, topic: str, callback: Callable[..., None], qos: QoSProfile = EVENTS) -> Any:
        return self._node.create_subscription(
            kind, topic, partial(callback, topic), qos, event_callbacks=self._events,
            qos_overriding_options=OVERRIDABLE,
        )  # fmt: skip

    def _check_gaps(self, topic: str, header: Header, info: Mapping[str, Any]) -> None:
        """Report a fault if messages of a sensor were lost before this message; info : message information of rclpy."""
        message = Numbered(number=info["publication_sequence_number"], received_ns=info["received_timestamp"])
        lost = self._gaps[topic].lost_before(message, time.time_ns(), lambda: len(self.publishers.of(topic)))
        if lost:
            self._notice_jump()
            self._report_lost(topic, lost)
            self._station.input_lost(topic, self._now() or nanoseconds(header.stamp))  # the clock may not run yet

    def _whole(self, cloud: PointCloud2, published_ns: int) -> None:
        arrival = self._arrival(cloud)
        self._station.terrain.put_whole(arrival, Moment(published_ns, arrival.stamp_ns))
        self.guards.note("terrain/update", arrival.stamp_ns)  # a patch with an older stamp is out of date

    def _survey(self, topic: str, data: Buffer, take: Callable[[PointCloud2], None], published_ns: int) -> None:
        """Read a point cloud from its CDR bytes and process it with `take`; an unreadable message is refused.

        rclpy itself would drop an unreadable message silently.

        published_ns : when the message was published (ns)
        """
        try:
            cloud = deserialize_message(bytes(data), PointCloud2)
        except RMWError as error:
            self._refuse(topic, f"its bytes are not a valid sensor_msgs/PointCloud2: {error}", published_ns)
            return
        self._take(topic, cloud.header, lambda: take(cloud), published_ns)

    def _arrival(self, cloud: PointCloud2) -> Arrival:
        frame, most, stamp = self._frame_of(cloud.header), self._parameters.most_points, nanoseconds(cloud.header.stamp)
        check_cloud(cloud, frame, most)
        return Arrival(convert=lambda: survey_of_cloud(cloud, frame, most), stamp_ns=stamp)

    def _frame_of(self, header: Header) -> MapFrame:
        return self._frames.of(header.frame_id, nanoseconds(header.stamp))

    def _sources(self, topic: str, header: Header, convert: Callable[[MapFrame], Sources]) -> None:
        self._notice_jump()

        def take() -> None:
            found = convert(self._frame_of(header))
            stamp = nanoseconds(header.stamp)
            trigger = trigger_of(found.positions, found.velocities, found.diameters, stamp, topic)
            sentence = "received" if len(found.positions) else "received: the sensor sees no sources"
            doubts = [f"{each}: {doubt}" for each, doubt in sorted(self._doubts.items()) if doubt]
            values = {"sources": str(len(found.positions)), "topic": topic}
            self._health.set("sources", WARN if doubts else OK, "; ".join([sentence, *doubts]), values)
            self._station.submit(trigger)

        self._take(topic, header, take)

    def _area(self, topic: str, header: Header, name: str, convert: Callable[[MapFrame], Any]) -> None:
        self._notice_jump()

        def take() -> None:
            rings = convert(self._frames.static(header.frame_id, AREAS_STAY))
            self._station.set_areas(topic, {name: rings} if rings else {})
            self._health.set("areas", OK, "received", {"topic": topic, "rings": str(len(rings))})

        self._take(topic, header, take)

    def _take(self, topic: str, header: Header, take: Callable[[], None], published_ns: int = 0) -> None:
        """Process a message with `take`, and note its stamp; refuse a message with a wrong stamp (`StampGuards.check`).

        published_ns : when a terrain message was published (ns); 0 for other messages
        """
        stamp = nanoseconds(header.stamp)

        def guarded() -> None:
            self.guards.check(topic, stamp, self._now())
            take()
            self.guards.note(topic, stamp)

        self._try(topic, guarded, published_ns, stamp)

    def _try(self, topic: str, take: Callable[[], None], published_ns: int, stamp_ns: int | None = None) -> None:
        try:
            take()
        except QueueFull as refusal:
            self._refuse(topic, str(refusal), published_ns, is_counted=True)
        except InputError as refusal:
            self._refuse(topic, str(refusal), published_ns, stamp_ns=stamp_ns)
        else:
            if topic not in TERRAIN_KINDS:
                self.publishers.understood(topic)
                self._station.input_understood(topic, lambda: len(self.publishers.of(topic)))

    def _refuse(
        self, topic: str, why: str, published_ns: int, is_counted: bool = False, stamp_ns: int | None = None
    ) -> None:
        """Report a refused message: a fault of the alert, because the message may report danger or changed terrain.

        published_ns : when a terrain message was published (ns); 0 for other messages
        is_counted : True if the queue of terrain already counts the message as missing
        stamp_ns : stamp of the message (ns), None if it has none, or if it cannot be read
        """
        with self._counting:  # two threads may refuse at once
            self._refused += 1
            count = self._refused
        if topic not in TERRAIN_KINDS:
            self._station.input_refused(topic, why)
        else:
            if not is_counted:
                # A stamp from the future would make every later survey look older than the refused message.
                stamp = None if stamp_ns is None else min(stamp_ns, self._now())
                self._station.terrain.refuse(TERRAIN_KINDS[topic], published_ns, why, stamp_ns=stamp)
            self._station.terrain_refused(why)
        self._health.set(part_of(topic), WARN, f"message refused: {why}", {"refused": str(count)})
