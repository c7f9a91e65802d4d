"""Received messages -> rows of a recording, one method a topic; what is refused leaves no row."""

from collections import OrderedDict
from collections.abc import Callable

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from rpf3d_ros.cloud_reading import columns_of_cloud, positions_of_cloud
from rpf3d_ros.health import Health, healths_of
from rpf3d_ros.map_frame import MapFrame
from rpf3d_ros.marker_reading import facets_of_markers, strips_of_markers
from rpf3d_ros.recording import Recording
from rpf3d_ros.source_messages import sources_of_poses
from rpf3d_ros.survey_terrain import ground_mesh
from rpf3d_ros.terrain_messages import grid_of_cloud, mesh_of_cdr

COUNT_OF_RECORDED = "rpf3d_recorder: recording"
"""The state that changes with every message recorded, so that logging it would log itself."""

SECOND = 1_000_000_000
"""Nanoseconds."""

EVENTS_KEPT = 1000
"""Stamps whose event is remembered: results later than a thousand further sources count as an event of their own."""


class EventNumbers:
    """Stamp (ns) -> number of its event, counted from 1; results may come long after the next sources."""

    def __init__(self) -> None:
        self.last = 0
        self._known: OrderedDict[int, int] = OrderedDict()

    def of(self, stamp_ns: int) -> int:
        """The event of a stamp; a stamp that is not known begins the next one."""
        if stamp_ns not in self._known:
            self.last += 1
            self._known[stamp_ns] = self.last
            if len(self._known) > EVENTS_KEPT:
                self._known.popitem(last=False)
        return self._known[stamp_ns]


class MessageLog:
    """Writes messages into a recording; an event is everything with the stamp of one message of sources."""

    def __init__(self, recording: Recording, frame: MapFrame, mesh_frame: str, now: Callable[[], Time]) -> None:
        """mesh_frame : frame of terrain/mesh; now : the node's time, for messages that carry none."""
        self._recording, self._frame, self._mesh_frame, self._now = recording, frame, mesh_frame, now
        self._events = EventNumbers()
        self._last_mesh = b""
        self._last_health: dict[str, Health] = {}

    def grid(self, cloud: PointCloud2) -> None:
        """terrain/points."""
        mesh = ground_mesh(grid_of_cloud(cloud, self._frame))
        self._between_events(cloud.header.stamp)
        self._recording.terrain(mesh.vertices, mesh.triangles)
        self._last_mesh = b""

    def mesh(self, data: bytes) -> None:
        """terrain/mesh, in CDR; a repetition of the last one is not logged again."""
        if data != self._last_mesh:
            mesh = mesh_of_cdr(data, self._frame, self._mesh_frame)
            self._between_events(self._now())
            self._recording.terrain(mesh.vertices, mesh.triangles)
            self._last_mesh = data

    def sources(self, poses: PoseArray) -> None:
        """sources."""
        sources = sources_of_poses(poses, self._frame)
        self._at(poses.header.stamp)
        self._recording.sources(sources.positions, sources.directions)

    def trajectories(self, array: MarkerArray) -> None:
        """trajectories."""
        strips = strips_of_markers(array, self._frame)
        self._at_markers(array)
        self._recording.trajectories(strips)

    def cloud(self, entity: str, cloud: PointCloud2) -> None:
        """trajectories/points, impacts, deposits; a cloud without points takes the last event's off the screen."""
        self._frame.check(cloud.header.frame_id)
        if cloud.width == 0:
            self._at(cloud.header.stamp)
            self._recording.clear(entity)
            return
        points = self._frame.points(positions_of_cloud(cloud), cloud.header.frame_id).reshape(-1, 3)
        energy = columns_of_cloud(cloud, ("energy",))["energy"].ravel()
        self._at(cloud.header.stamp)
        self._recording.points(entity, points, energy)

    def hazard(self, array: MarkerArray) -> None:
        """hazard/zones."""
        levels = facets_of_markers(array, self._frame)
        self._at_markers(array)
        self._recording.clear("hazard")
        for level, (corners, colour) in levels.items():
            self._recording.hazard(level, corners, colour)

    def diagnostics(self, array: DiagnosticArray) -> None:
        """/diagnostics; what a node repeats every second is logged once, the count of what is recorded not at all."""
        for health in healths_of(array):
            if self._last_health.get(health.name) != health and health.name != COUNT_OF_RECORDED:
                self._last_health[health.name] = health
                self._between_events(array.header.stamp)
                self._recording.health(health)

    def _at_markers(self, array: MarkerArray) -> None:
        if array.markers:
            self._at(array.markers[0].header.stamp)
        else:
            self._between_events(self._now())

    def _between_events(self, stamp: Time) -> None:
        self._recording.at(_nanoseconds(stamp), self._events.last)

    def _at(self, stamp: Time) -> None:
        self._recording.at(_nanoseconds(stamp), self._events.of(_nanoseconds(stamp)))


def _nanoseconds(stamp: Time) -> int:
    return int(stamp.sec) * SECOND + int(stamp.nanosec)
