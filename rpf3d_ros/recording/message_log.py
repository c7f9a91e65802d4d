"""Convert received messages to entries of a recording, with one method for each topic.

A refused message gives no entry.

No message class is imported: messages are read by the names of their fields, from rclpy or from a bag.
"""

import hashlib
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.alert_reading import ReceivedLevel, alerts_of, decided_at_ns
from rpf3d_ros.messages.cloud_reading import columns_of_cloud, positions_of_cloud
from rpf3d_ros.messages.grid_reading import percent_of_grid
from rpf3d_ros.messages.health import healths_of
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_reading import AREAS, HAZARD, facets_of_markers, outlines_of_markers, strips_of_markers
from rpf3d_ros.messages.moving_rocks import motion_of
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.source_reading import placed
from rpf3d_ros.messages.survey_terrain import ground_mesh
from rpf3d_ros.messages.terrain_messages import MeshSurvey, grid_of_cloud, mesh_of_cdr
from rpf3d_ros.recording.stream import Recording

COUNT_OF_RECORDED = "rpf3d_recorder: recording"
"""Name of the status that changes with every recorded message; its own recording would make it change again."""

SECOND = 1_000_000_000
"""One second in nanoseconds."""

EVENTS_KEPT = 1000
"""Number of stamps with a remembered event; a result after more than a thousand newer stamps counts as a new event."""

UPDATES_SHOWN = 200
"""Number of terrain patches that are shown together; the next patch replaces the oldest."""

LARGEST_PATCH = 10_000_000
"""Largest number of points in a patch."""

LEVELS_OF_AREA = ("held", "evident")
"""Levels in the values of an area's alert, in addition to the shown level."""

Drawn = TypeVar("Drawn")


class Entry(NamedTuple):
    """Rows of a recording at one time.

    stamp_ns, event : the time and the event of the rows
    draw : logs the rows
    keeps : name of the state that the entry replaces, "" if it is not a state; a new file begins with the last entry of
        each state
    """

    stamp_ns: int
    event: int
    draw: Callable[[Recording], None]
    keeps: str = ""


class EventNumbers:
    """Numbers of events by their stamps (ns), counted from 1; results may arrive long after newer sources."""

    def __init__(self) -> None:
        self.last = 0
        self._known: OrderedDict[int, int] = OrderedDict()

    def of(self, stamp_ns: int) -> int:
        """Return the event of a stamp; an unknown stamp begins the next event."""
        if stamp_ns not in self._known:
            self.last += 1
            self._known[stamp_ns] = self.last
            if len(self._known) > EVENTS_KEPT:
                self._known.popitem(last=False)
        return self._known[stamp_ns]


class MessageLog:
    """Converts messages to entries; an event is all messages with the stamp of one message of sources."""

    def __init__(self, frame: MapFrame, mesh_frame: str, now: Callable[[], int]) -> None:
        """Begin without terrain, areas or alerts.

        mesh_frame : frame of terrain/mesh
        now : returns the time (ns since the epoch) for messages without a stamp
        """
        self._frame, self._mesh_frame, self._now = frame, mesh_frame, now
        self._events = EventNumbers()
        self._terrain, self._updates = b"", 0
        self._said: dict[str, object] = {}
        self._areas_with_alerts: set[str] = set()
        self._levels: set[str] = set()
        self._outlined: set[str] = set()

    def entries(self, topic: str, message: Any) -> list[Entry]:
        """Return the entries of a message of a topic of TOPICS; terrain/mesh is given as CDR bytes.

        Raises MessageRefused.
        """
        methods = {
            "terrain/points": self._grid,
            "terrain/mesh": self._mesh,
            "terrain/update": self._update,
            "sources": self._sources,
            "/clicked_point": self._clicked,
            "source_cloud": self._source_cloud,
            "areas/polygon": self._polygon,
            "areas/equipment": self._equipment,
            "trajectories": self._trajectories,
            "hazard/zones": self._zones,
            "areas/outlines": self._outlines,
            "hazard/points": self._reach,
            "hazard/grid": self._reach_grid,
            "results": self._results,
            "alerts": self._alerts,
            "alarm": self._alarm,
            "/diagnostics": self._diagnostics,
        }
        method = methods.get(topic)
        return list(method(message) if method else self._cloud(topic, message))

    def _grid(self, cloud: Any) -> Iterator[Entry]:
        survey = grid_of_cloud(cloud, self._frame)
        digest = hashlib.sha256(survey.points.tobytes()).digest()
        if digest != self._terrain:
            yield self._ground(ground_mesh(survey), digest, _nanoseconds(cloud.header.stamp))

    def _mesh(self, data: bytes) -> Iterator[Entry]:
        digest = hashlib.sha256(data).digest()
        if digest != self._terrain:
            yield self._ground(mesh_of_cdr(data, self._frame, self._mesh_frame), digest, self._now())

    def _ground(self, mesh: MeshSurvey, digest: bytes, stamp_ns: int) -> Entry:
        self._terrain, self._updates = digest, 0
        return self._between(stamp_ns, lambda r: r.terrain(mesh.vertices, mesh.triangles), "terrain")

    def _update(self, cloud: Any) -> Iterator[Entry]:
        if cloud.width * cloud.height > LARGEST_PATCH:
            raise MessageRefused(f"the patch holds {cloud.width * cloud.height} points; {LARGEST_PATCH} is the most")
        points = self._frame.points(positions_of_cloud(cloud).reshape(-1, 3), cloud.header.frame_id)
        points = points[~np.isnan(points).any(axis=1)]
        number = self._updates % UPDATES_SHOWN
        self._terrain, self._updates = b"", self._updates + 1  # no digest: the same survey again undoes the patch
        stamp_ns = _nanoseconds(cloud.header.stamp)
        yield self._between(stamp_ns, lambda r: r.update(number, points), f"terrain/updates/{number}")

    def _sources(self, poses: Any) -> Iterator[Entry]:
        positions, directions = placed(poses, self._frame)
        yield self._at(poses, lambda r: r.sources(positions, directions), "sources")

    def _clicked(self, point: Any) -> Iterator[Entry]:
        at = np.array([[point.point.x, point.point.y, point.point.z]], dtype=float)
        yield self._released(point, self._finite(at, point.header.frame_id), np.zeros((1, 3)))

    def _source_cloud(self, cloud: Any) -> Iterator[Entry]:
        """Yield the sources of a cloud; a cloud without points means that no rock is moving."""
        if cloud.width * cloud.height == 0:
            self._frame.check(cloud.header.frame_id)
            yield self._released(cloud, np.empty((0, 3)), np.empty((0, 3)))
            return
        points = self._positions(cloud)
        names = [field.name for field in cloud.fields]
        directions = np.zeros_like(points)
        if {"vx", "vy", "vz"} <= set(names) and len(points):
            velocity = np.stack([_column(cloud, name) for name in ("vx", "vy", "vz")], axis=-1).astype(float)
            with np.errstate(over="ignore"):
                speed = np.linalg.norm(velocity, axis=1, keepdims=True)
            directions = np.divide(velocity, speed, out=directions, where=(speed > 0.0) & np.isfinite(speed))
        yield self._released(cloud, points, directions)

    def _released(self, message: Any, positions: FloatArray, directions: FloatArray) -> Entry:
        return self._at(message, lambda r: r.sources(positions, directions), "sources")

    def _polygon(self, polygon: Any) -> Iterator[Entry]:
        corners = np.array([(p.x, p.y, p.z) for p in polygon.polygon.points], dtype=float).reshape(-1, 3)
        corners = self._finite(corners, polygon.header.frame_id)
        stamp_ns = _nanoseconds(polygon.header.stamp)
        yield self._between(stamp_ns, lambda r: r.area("live_area", corners), "areas/live_area")

    def _equipment(self, poses: Any) -> Iterator[Entry]:
        positions, _ = placed(poses, self._frame)
        stamp_ns = _nanoseconds(poses.header.stamp)
        yield self._between(stamp_ns, lambda r: r.places("equipment", positions), "areas/equipment")

    def _trajectories(self, array: Any) -> Iterator[Entry]:
        strips = strips_of_markers(array, self._frame)
        yield self._at_markers(array, lambda r: r.trajectories(strips))

    def _cloud(self, topic: str, cloud: Any) -> Iterator[Entry]:
        """Yield trajectories/points, impacts or deposits.

        A cloud without points clears the entity of the last event.
        """
        self._frame.check(cloud.header.frame_id)
        if cloud.width == 0:
            yield self._at(cloud, lambda r: r.clear(topic))
            return
        points = self._positions(cloud)
        energy = _column(cloud, "energy")
        if topic == "trajectories/points":
            motion = motion_of(points, _column(cloud, "t").astype(float), _column(cloud, "rock"))
            yield self._at(cloud, lambda r: r.motion(motion))
        yield self._at(cloud, lambda r: r.points(topic, points, energy))
        if topic == "impacts":
            yield self._at(cloud, lambda r: r.energies(energy))

    def _zones(self, array: Any) -> Iterator[Entry]:
        levels = _by_name(facets_of_markers(array, self._frame), HAZARD, "level")
        outlines = _by_name(outlines_of_markers(array, self._frame), HAZARD, "level")
        for level in sorted(self._levels):
            yield self._at_markers(array, lambda r, level=level: r.clear_hazard(level))
        self._levels = {*levels, *outlines}
        for level, (corners, colour) in levels.items():
            yield self._at_markers(array, lambda r, n=level, k=corners, c=colour: r.hazard(n, k, c))
        for level, (lines, colour) in outlines.items():
            yield self._at_markers(array, lambda r, n=level, k=lines, c=colour: r.outline(n, k, c))

    def _outlines(self, array: Any) -> Iterator[Entry]:
        """Yield the outline of each area that has changed, and clear the outlines that the message lacks.

        The entries carry the current time, because the answer to older sources may contain newer areas.
        """
        areas = _by_name(outlines_of_markers(array, self._frame), AREAS, "name")
        for name in sorted(self._outlined - set(areas)):
            self._said.pop(f"outline/{name}")
            yield self._between(self._now(), lambda r, n=name: r.clear_area(n), f"outline/{name}")
        self._outlined = set(areas)
        for name, (lines, _) in areas.items():
            if self._is_new(f"outline/{name}", [line.tobytes() for line in lines]):
                yield self._between(self._now(), lambda r, n=name, k=lines: r.area_outline(n, k), f"outline/{name}")

    def _reach(self, cloud: Any) -> Iterator[Entry]:
        self._frame.check(cloud.header.frame_id)
        if cloud.width == 0:
            yield self._at(cloud, lambda r: r.clear("hazard/points"))
            return
        points, reach = self._positions(cloud), _column(cloud, "reach_probability")
        given = {field.name for field in cloud.fields}
        beside = {
            name: _column(cloud, name) for name in ("p95_energy", "first_arrival", "rocks", "result") if name in given
        }
        yield self._at(cloud, lambda r: r.reach(points, reach, beside))

    def _reach_grid(self, grid: Any) -> Iterator[Entry]:
        percent = percent_of_grid(grid, self._frame)
        yield self._at(grid, lambda r: r.grid(percent))

    def _results(self, array: Any) -> Iterator[Entry]:
        for health in healths_of(array):
            yield self._at(array, lambda r, health=health: r.text("results", health))

    def _alerts(self, array: Any) -> Iterator[Entry]:
        """Yield the level of the site, and the texts and lanes that have changed.

        The level is logged every time, because it is a series. Text and lane of the site are logged if the level or the
        sentence changes, those of an area if one of its levels changes. The lane of an area ends if the message lacks
        the area, for example because a machine has left.

        The entries carry the time of the decision, if the message has it. The stamp of the message is the stamp of the
        sources. A decision that finds these sources stale has the same stamp as the decision before, so the stamp would
        order the two wrongly.
        """
        alerts = alerts_of(array)
        stamp_ns = decided_at_ns(alerts) or _nanoseconds(array.header.stamp)
        for alert in alerts:
            if alert.area is None:
                yield self._between(stamp_ns, lambda r, a=alert: r.alert(a.level), "alert/level")
            lane, said = _lane_of(alert.area), alert.health
            news = said.message if alert.area is None else [said.values.get(name) for name in LEVELS_OF_AREA]
            if self._is_new(f"alert/{lane}", (alert.level, news)):
                yield self._between(stamp_ns, lambda r, a=alert: _draw_alert(r, a), f"alert/{lane}")
        told = {alert.area for alert in alerts if alert.area is not None}
        for lane in map(_lane_of, sorted(self._areas_with_alerts - told)):
            self._said.pop(f"alert/{lane}", None)
            yield self._between(stamp_ns, lambda r, at=lane: r.alert_state(at, None), f"alert/{lane}")
        self._areas_with_alerts = told

    def _alarm(self, alarm: Any) -> Iterator[Entry]:
        state = "on" if alarm.data else "off"
        if self._is_new("alarm", state):
            yield self._between(self._now(), lambda r: r.alert_state("alarm", state), "alarm")

    def _diagnostics(self, array: Any) -> Iterator[Entry]:
        """Yield a state if it has changed.

        A node repeats its states every second. The count of recorded messages is left out.
        """
        stamp_ns = _nanoseconds(array.header.stamp)
        for health in healths_of(array):
            if health.name != COUNT_OF_RECORDED and self._is_new(f"health/{health.name}", health):
                yield self._between(stamp_ns, lambda r, h=health: r.text("diagnostics", h))

    def _is_new(self, name: str, state: object) -> bool:
        if self._said.get(name) == state:
            return False
        self._said[name] = state
        return True

    def _positions(self, cloud: Any) -> FloatArray:
        """Return the points (N, 3) m of a cloud in the map frame. Raises MessageRefused if a point is not finite."""
        return self._finite(positions_of_cloud(cloud).reshape(-1, 3), cloud.header.frame_id)

    def _finite(self, points: FloatArray, frame_id: str) -> FloatArray:
        if not bool(np.isfinite(points).all()):
            raise MessageRefused("a point is not finite")
        return self._frame.points(points, frame_id)

    def _at_markers(self, array: Any, draw: Callable[..., None]) -> Entry:
        return self._at(array.markers[0], draw) if array.markers else self._between(self._now(), draw)

    def _between(self, stamp_ns: int, draw: Callable[..., None], keeps: str = "") -> Entry:
        return Entry(stamp_ns, self._events.last, draw, keeps)

    def _at(self, message: Any, draw: Callable[..., None], keeps: str = "") -> Entry:
        stamp_ns = _nanoseconds(message.header.stamp)
        return Entry(stamp_ns, self._events.of(stamp_ns), draw, keeps)


def _by_name(drawn: Mapping[str, Drawn], root: str, what: str) -> dict[str, Drawn]:
    """Return the drawn shapes by the name of their namespace below a root.

    Raises MessageRefused for a namespace outside the root.
    """
    for namespace in drawn:
        if not namespace.removeprefix(root).strip("/") or not namespace.startswith(root):
            raise MessageRefused(f"a marker is in namespace '{namespace}'; it must be {root}<{what}>")
    return {namespace.removeprefix(root): each for namespace, each in drawn.items()}


def _draw_alert(recording: Recording, alert: ReceivedLevel) -> None:
    recording.alert_state(_lane_of(alert.area), alert.state)
    recording.text("alerts", replace(alert.health, name=alert.area or "site"))


def _lane_of(area: str | None) -> str:
    """Return the lane of an area, or of the site for None.

    The prefix of areas prevents that an area named "site" or "alarm" shares the lane of the site or of the alarm.
    """
    return "site" if area is None else f"area/{area}"


def _column(cloud: Any, name: str) -> np.ndarray:
    return columns_of_cloud(cloud, (name,))[name].ravel()


def _nanoseconds(stamp: Any) -> int:
    return int(stamp.sec) * SECOND + int(stamp.nanosec)
