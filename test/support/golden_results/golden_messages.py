"""Replay a ROS session without processes: fixed messages in, digests of the published and recorded messages out.

The session calls the functions of the simulator: they convert each message to terrain, an area or sources, answer the
sources, decide on each answer, and convert answers and decisions to messages. The recorder's log then converts all
messages, received and published. The times are the stamps of the messages; the duration of an answer is a constant.
Sentences are not digested.

The session has neither the threads of the nodes nor DDS: other tests check the order and times of published answers.
"""

import dataclasses
import itertools
from array import array
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Point32, PointStamped, Polygon, PolygonStamped, Pose, PoseArray, Quaternion
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from shape_msgs.msg import Mesh, MeshTriangle
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from golden_results.golden_digests import SENTENCE, digest_of

# The modules of rpf3d under test: if they move, only these lines change.
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence, areas_of, unfinished_of, untouched
from rpf3d_core.alerts.levels import Acknowledgement, Alert, acknowledgement
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.live.answers import Answer, EnsembleSize, answers
from rpf3d_core.live.evidence import together
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.scene import live_scene
from rpf3d_core.live.standing import PreparedTerrain, stand_after, stand_on
from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.interface.answer_publishers import messages_of
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.messages.alert_messages import alarm_message, alerts_message
from rpf3d_ros.messages.area_messages import rings_of_equipment, rings_of_polygon
from rpf3d_ros.messages.source_messages import Sources, sources_of_cloud, sources_of_point, sources_of_poses
from rpf3d_ros.messages.terrain_messages import mesh_of_cdr, survey_of_cloud
from rpf3d_ros.recording.message_log import MessageLog

SECOND = 1_000_000_000
"""One second in nanoseconds."""
START = 1_800_000_000
"""Time of the session's second 0 (s since the epoch)."""
LATER = 2 * SECOND
"""Time (ns) from a message of sources to the first stage of its answer, and from each stage to the next stage."""
TOOK = 0.25
"""Duration (s) of each answer in the messages `results`, in place of the measured duration."""

PARAMETERS = SimulatorParameters(
    survey_frame="survey", map_origin=(1024.0, 2048.0, 128.0), first_rocks=24, release_speed=2.0, equipment_radius=6.0,
    displayed_trajectories=20, points_per_trajectory=30,
)  # fmt: skip
SCENE = {
    "materials.default.normal_restitution": 0.45, "materials.default.tangential_restitution": 0.9,
    "materials.default.friction_angle_deg": 30.0, "target.half_width": 0.001, "target.most_rocks": 96,
    "hazard.cell": 2.0, "seed": 3,
}  # fmt: skip
LIMITS = {
    "watch": {"reach_probability": 0.3},
    "restrict": {"reach_probability": 0.8, "p95_energy_j": 800_000.0},
    "evacuate": {"reach_probability": 0.95, "first_arrival_s": {"evacuation": 2, "margin": 1}},
}
"""Limits of an area at which the alert level of the session rises step by step."""
SITE = {
    "site": "golden", "valid_s": 10, "alarm_from": "restrict", "areas": {"live_area": LIMITS, "equipment": LIMITS},
    "evidence": {
        "sources_max_age_s": 60, "terrain_max_age_s": 3600, "clock_tolerance_s": 0.5, "fewest_rocks": 48,
        "most_unfinished": 0.1,
    },
}  # fmt: skip

Content = Any
"""A value that `digest_of` accepts: number, string, bytes, array, or a mapping or sequence of such values."""


# --- messages in


def _header(second: int, frame: str = "map") -> Header:
    """Return a header with the stamp `second` + 0.125 s after the start of the session."""
    return Header(frame_id=frame, stamp=Time(sec=START + second, nanosec=125_000_000))


def _hill(rows: int, columns: int, lift: float = 0.0) -> np.ndarray:
    """Return points (rows, columns, 3) m of an uneven slope that falls to the east, and of a floor at its toe.

    All coordinates are multiples of 1/8 m. lift : height (m) that is added to all points
    """
    j, i = np.mgrid[0:rows, 0:columns]
    z = np.maximum(48.0 - 1.5 * i, 6.0) + 0.25 * ((7 * i + 5 * j) % 4) + lift
    return np.stack([2.0 * i, 2.0 * j, z], axis=-1)


def _cloud(header: Header, names: tuple[str, ...], values: np.ndarray) -> PointCloud2:
    """Return a PointCloud2 of values (H, W, C) in single precision; names : names of the C fields."""
    height, width, count = values.shape
    fields = [PointField(name=n, offset=4 * k, datatype=PointField.FLOAT32, count=1) for k, n in enumerate(names)]
    return PointCloud2(
        header=header, height=height, width=width, fields=fields, point_step=4 * count, row_step=4 * count * width,
        data=values.astype("<f4").tobytes(), is_dense=not bool(np.isnan(values).any()),
    )  # fmt: skip


def _survey() -> PointCloud2:
    """Return a survey of the hill in survey coordinates, with a missing point at a place that no rock reaches."""
    points = _hill(32, 40) + np.array(PARAMETERS.map_origin)
    points[30, 12] = np.nan
    return _cloud(_header(0, "survey"), tuple("xyz"), points)


def _grid_patch() -> PointCloud2:
    """Return a patch of the hill as an organised point cloud, 1.5 m above the ground."""
    return _cloud(_header(20), tuple("xyz"), _hill(32, 40, lift=1.5)[4:12, 18:28])


def _scattered_patch() -> PointCloud2:
    """Return a patch of the hill as an unorganised point cloud, 0.75 m above the ground."""
    points = _hill(32, 40, lift=0.75)[14:20, 20:27].reshape(1, -1, 3) + np.array([0.5, 0.25, 0.0])
    return _cloud(_header(40), tuple("xyz"), points)


def _mesh() -> bytes:
    """Return a smaller hill, 2 m higher, as the CDR bytes of a mesh message."""
    points, square = _hill(20, 36, lift=2.0), np.arange(20 * 36).reshape(20, 36)
    a, b, c, d = square[:-1, :-1], square[:-1, 1:], square[1:, 1:], square[1:, :-1]
    corners = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.uint32)
    vertices = [Point(x=x, y=y, z=z) for x, y, z in points.reshape(-1, 3).tolist()]
    triangles = [MeshTriangle(vertex_indices=each) for each in corners]
    return bytes(serialize_message(Mesh(triangles=triangles, vertices=vertices)))


def _poses(second: int, *places: tuple[float, float, float], turned: bool = True) -> PoseArray:
    """Return poses at places (x, y, z) m; the directions are in turn east, 33 degrees north of east, and none.

    turned : False if all directions are east
    """
    turns = [Quaternion(w=1.0), Quaternion(z=0.28, w=0.96), Quaternion(x=0.0, y=0.0, z=0.0, w=0.0)]
    poses = [
        Pose(position=Point(x=x, y=y, z=z), orientation=turns[number % 3 if turned else 0])
        for number, (x, y, z) in enumerate(places)
    ]
    return PoseArray(header=_header(second), poses=poses)


def _thrown() -> PointCloud2:
    """Return sources with velocities and sizes; one size is unknown."""
    names = ("x", "y", "z", "diameter", "vx", "vy", "vz")
    rows = [[8, 12, 50, 0.75, 3, 0, 0.5], [8, 20, 50, np.nan, 2, -1, 0], [12, 28, 47, 1.5, 0, 0, 0]]
    return _cloud(_header(60), names, np.array([rows]))


def messages_in() -> Iterator[tuple[str, Any]]:
    """Yield topic and message of each input of the session, in order; a mesh is given as CDR bytes."""
    toe = ((52.0, 8.0), (72.0, 8.0), (72.0, 52.0), (60.0, 30.0), (52.0, 52.0))
    corners = [Point32(x=x, y=y, z=6.0) for x, y in toe]
    yield "terrain/points", _survey()
    yield "areas/polygon", PolygonStamped(header=_header(1), polygon=Polygon(points=corners))
    yield "areas/equipment", _poses(2, (58.0, 24.0, 6.0), (64.0, 28.0, 6.0), turned=False)
    yield "sources", _poses(5)  # no sources
    yield "sources", _poses(10, (6.0, 12.0, 48.0), (8.0, 30.0, 47.0), (10.0, 40.0, 46.0))
    yield "terrain/update", _grid_patch()
    yield "clicked_point", PointStamped(header=_header(30), point=Point(x=8.0, y=16.0, z=48.5))
    yield "terrain/update", _scattered_patch()
    yield "source_cloud", _thrown()
    yield "terrain/mesh", _mesh()
    yield "sources", _poses(80, (6.0, 12.0, 50.0), (500.0, 12.0, 50.0))  # the second source is off the terrain
    yield "sources", _poses(90)
    yield "source_cloud", _cloud(_header(91), tuple("xyz"), np.empty((1, 0, 3)))


# --- the simulator and the recorder


class Session:
    """A simulator and a recorder in one thread.

    parts : name of a part, as in `digests_of_session` -> its contents in order
    """

    def __init__(self, engine: str) -> None:
        self.parts: dict[str, list[Content]] = {}
        self._frame, self._scene = PARAMETERS.frame, live_scene({**SCENE, "engine": engine})
        self._workshop = Workshop(self._scene.terrain.weld, reference=engine == "reference")
        self._thresholds, self._results = Thresholds.model_validate(SITE), itertools.count(1)
        self._standing: PreparedTerrain | None = None
        self._areas: dict[str, Any] = {}
        self._evidence: dict[str, Evidence] = {}
        self._alert: Alert | None = None
        self._now = START * SECOND
        self._log = MessageLog(self._frame, PARAMETERS.mesh_frame, lambda: self._now)

    def take(self, topic: str, message: Any) -> None:
        """Process a message as the subscription of its topic does, and record it."""
        if not isinstance(message, bytes):
            self._now = _nanoseconds(message)
        self._record(topic, message)
        ways: dict[str, Callable[[Any], None]] = {
            "terrain/points": lambda cloud: self._stand_on(survey_of_cloud(cloud, self._frame)),
            "terrain/mesh": lambda data: self._stand_on(mesh_of_cdr(data, self._frame, PARAMETERS.mesh_frame)),
            "terrain/update": self._patch,
            "areas/polygon": lambda m: self._areas.update(live_area=rings_of_polygon(m, self._frame)),
            "areas/equipment": lambda m: self._areas.update(
                equipment=rings_of_equipment(m, self._frame, PARAMETERS.equipment_radius)
            ),
            "sources": lambda m: self._answer(topic, sources_of_poses(m, self._frame, PARAMETERS.release_speed)),
            "clicked_point": lambda m: self._answer(topic, sources_of_point(m, self._frame)),
            "source_cloud": lambda m: self._answer(topic, sources_of_cloud(m, self._frame)),
        }
        ways[topic](message)

    def acknowledge(self) -> None:
        """Advance the clock by one second, acknowledge the alert, and compute the alert level again."""
        self._now += SECOND
        self._decide(acknowledgement("A. Shift", "inspected from the other side", self._now))

    def _stand_on(self, survey: Any) -> None:
        """Replace the terrain by a whole survey."""
        self._take_over(stand_on(self._workshop.whole(survey, self._now), self._scene))

    def _patch(self, cloud: PointCloud2) -> None:
        """Replace a part of the terrain by the points of a cloud."""
        before = self._stood
        _ = before.cells
        ground = self._workshop.patched(before.ground, survey_of_cloud(cloud, self._frame), self._now)
        self._take_over(stand_after(before, ground))

    def _take_over(self, standing: PreparedTerrain) -> None:
        """Use a prepared terrain from now on, and note its arrays as copies, because a patch changes them in place."""
        self._standing, terrain = standing, standing.ground.terrain
        mesh = (terrain.frame.points_to_input(terrain.vertices), terrain.triangles.copy(), standing.ground.digest)
        self._note("terrain", [*mesh, *(column.copy() for column in standing.cells)])

    @property
    def _stood(self) -> PreparedTerrain:
        """The prepared terrain in use; it must exist."""
        assert self._standing is not None
        return self._standing

    def _answer(self, topic: str, sources: Sources) -> None:
        """Answer sources, publish all stages of the answer, and decide on each stage."""
        trigger = trigger_of(sources.positions, sources.velocities, sources.diameters, sources.stamp_ns, topic)
        around = ReleaseSpread(PARAMETERS.position_spread, PARAMETERS.velocity_spread)
        size = EnsembleSize(PARAMETERS.first_rocks)
        stages = answers(self._stood, trigger, around, self._areas, size, lambda stage: False, self._results)
        for answer in stages:
            self._now += LATER
            timed = dataclasses.replace(answer, seconds=TOOK)
            for name, message in messages_of(sources.header, timed, PARAMETERS, _stamp(self._now)):
                self._publish(name, message)
            others = self._evidence if answer.sources else {}  # without sources, earlier evidence is void
            self._evidence = {**others, topic: self._evidence_of(answer)}
            self._decide(None)

    def _evidence_of(self, answer: Answer) -> Evidence:
        """Return the evidence of an answer for the areas; sources that could not be released are a fault."""
        ground = self._stood.ground
        facts = {
            "result": answer.result, "stage": answer.stage, "at_ns": self._now, "version": "golden",
            "trigger_stamp_ns": answer.trigger.stamp_ns, "terrain_stamp_ns": ground.stamp_ns,
            "terrain_digest": ground.digest, "sources_digest": answer.trigger.digest, "sources": answer.sources,
            "seed": self._scene.seed, "unfinished": unfinished_of(answer.outcomes),
            "faults": (answer.left_out,) if answer.left_out else (),
        }  # fmt: skip
        if answer.sources:
            return Evidence(**facts, areas=areas_of(answer.maps))
        return Evidence(**facts, areas=untouched(answer.maps.area_names))

    def _decide(self, given: Acknowledgement | None) -> None:
        """Decide on the evidence of all topics, and publish the decision."""
        evidence = together(list(self._evidence.values()))
        self._alert = decide(self._alert, evidence, self._thresholds, self._now, given)
        header = Header(frame_id=PARAMETERS.map_frame, stamp=_stamp(evidence.trigger_stamp_ns))
        self._publish("alarm", alarm_message(self._alert))
        self._publish("alerts", alerts_message(header, self._alert, evidence.result))

    def _publish(self, topic: str, message: Any) -> None:
        """Note a published message, and record it as a subscriber receives it."""
        laid_out = isinstance(message, bytes)  # markers are published as bytes
        self._note(f"out {topic}", message if laid_out else content_of(message))
        sent, kind = (message, MarkerArray) if laid_out else (serialize_message(message), type(message))
        self._record(topic, deserialize_message(sent, kind))

    def _record(self, topic: str, message: Any) -> None:
        """Note the rows that the recorder logs for a message, with their stamp and event."""
        for entry in self._log.entries(topic, message):
            drawn = Drawn()
            entry.draw(drawn)
            self._note(f"recorded {topic}", [entry.stamp_ns, entry.event, content_of(drawn.rows)])

    def _note(self, part: str, content: Content) -> None:
        """Append content to a part of the session's results; part : key of `parts`."""
        self.parts.setdefault(part, []).append(content)


class Drawn:
    """A replacement for a recording that keeps the arguments of every method call in `rows`."""

    def __init__(self) -> None:
        self.rows: list[Any] = []

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *given: self.rows.append(given)


def _nanoseconds(message: Any) -> int:
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def _stamp(ns: int) -> Time:
    return Time(sec=ns // SECOND, nanosec=ns % SECOND)


# --- digested content


def content_of(value: Any) -> Content:
    """Return a message, or the recorded rows of a message, as plain values, with SENTENCE in place of sentences."""
    if hasattr(value, "get_fields_and_field_types"):
        return _content_of_message(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return [content_of(getattr(value, each.name)) for each in dataclasses.fields(value)]
    if isinstance(value, Mapping):
        return {key: content_of(item) for key, item in value.items()}
    if isinstance(value, array):
        return np.frombuffer(value.tobytes(), dtype=value.typecode)
    if isinstance(value, list | tuple):
        return [content_of(item) for item in value]
    return SENTENCE if isinstance(value, str) and " " in value else value


def _content_of_message(message: Any) -> Content:
    """Return a dictionary from field name to content.

    The `name` of a status and the `key` of its values are kept, although they may contain blanks.
    """
    fields = {name: getattr(message, name) for name in message.get_fields_and_field_types()}
    kept = {"name": fields["name"]} if isinstance(message, DiagnosticStatus) else {}
    kept |= {"key": fields["key"]} if isinstance(message, KeyValue) else {}
    return {name: content_of(value) for name, value in fields.items()} | kept


def digests_of_session(engine: str) -> dict[str, str]:
    """Run the session on an engine; return a dictionary from part to digest.

    The parts are `terrain`, `out TOPIC` (published messages) and `recorded TOPIC` (recorded rows).
    """
    session = Session(engine)
    for topic, message in messages_in():
        session.take(topic, message)
    session.acknowledge()
    return {part: digest_of(content) for part, content in sorted(session.parts.items())}
