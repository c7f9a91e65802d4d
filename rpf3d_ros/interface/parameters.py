"""Parameters of the nodes that are not fields of a scene: frozen dataclasses whose fields are declared as parameters.

`declared_parameters.py` declares and reads them on a node.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.live.plausible import STEEP, TALLEST_FACE
from rpf3d_core.live.survey import MOST_POINTS
from rpf3d_core.scene.releases import FASTEST
from rpf3d_ros.interface.recorded_topics import CLOUD_SOURCES, POSE_SOURCES, RecordedSensors
from rpf3d_ros.messages.map_frame import MapFrame

SENSOR_PARAMETERS = "source_topics, source_cloud_topics, expected_topics and optional_topics"

LARGEST_COUNT = 2**31 - 1
"""Upper end of the range of an integer parameter that has no other upper limit, because a ROS range needs both ends."""


def parameter(
    default: Any, description: str, low: float | None = None, high: float | None = None, choices: tuple[str, ...] = ()
) -> Any:
    """Return a dataclass field with the default, description, range and choices of its ROS parameter.

    low, high : ends of the range, both allowed; None for no range
    choices : allowed values; () for any value
    """
    about = {"description": description, "low": low, "high": high, "choices": choices}
    return field(default=default, metadata=about)


@dataclass(frozen=True)
class FrameParameters:
    """Parameters that name the frames of messages, and the origin of the map frame."""

    map_frame: str = parameter("map", "frame of every output, and of inputs in local coordinates")
    survey_frame: str = parameter("", "frame of inputs in survey coordinates, shifted by map_origin; empty: none")
    map_origin: tuple[float, ...] = parameter((0.0, 0.0, 0.0), "survey coordinates E, N, H of the map's origin (m)")
    mesh_frame: str = parameter("map", "frame of terrain/mesh, whose message has no header")

    @property
    def frame(self) -> MapFrame:
        """The map frame and its relation to survey coordinates. Raises InputError if the parameters are invalid."""
        if len(self.map_origin) != 3 or not all(math.isfinite(value) for value in self.map_origin):
            raise InputError(f"map_origin is {list(self.map_origin)}; it must be three finite numbers E, N, H in m")
        if not self.map_frame or self.map_frame.startswith("/") or self.map_frame == self.survey_frame:
            raise InputError("map_frame must be a name without a leading slash, and not the name of survey_frame")
        x, y, z = self.map_origin
        return MapFrame(name=self.map_frame, survey=self.survey_frame, origin=(x, y, z))


@dataclass(frozen=True)
class InputParameters(FrameParameters):
    """Parameters for the reception of terrain, and of inputs in frames other than those of `FrameParameters`."""

    terrain_durability: str = parameter(
        "volatile",
        "with transient_local the node also receives the last terrain of a latched publisher, but nothing from a "
        "volatile publisher",
        choices=("volatile", "transient_local"),
    )
    use_tf: bool = parameter(
        False, "whether inputs in other frames are transformed by tf2 (/tf, /tf_static); needs tf2_ros_py"
    )
    transforms_max_age_s: float = parameter(
        1.0,
        "largest age (s) of a transform at the stamp of its message; with an older transform the message is refused; "
        "static transforms have no age limit",
        0.0, 1e6,
    )  # fmt: skip


@dataclass(frozen=True)
class SourceParameters(InputParameters):
    """The topics of sources: parameters of the simulator, and of the recorder, which must record the same topics."""

    source_topics: tuple[str, ...] = parameter(
        (POSE_SOURCES,), "topics of sources as poses, one for each sensor, each with one publisher"
    )
    source_cloud_topics: tuple[str, ...] = parameter(
        (CLOUD_SOURCES,), "topics of sources as clouds, one for each sensor, each with one publisher"
    )

    @property
    def recorded_sensors(self) -> RecordedSensors:
        """The topics of sources. Raises InputError if a topic is given twice, or is a topic of rpf3d for other data."""
        sensors = RecordedSensors(poses=_not_empty(self.source_topics), clouds=_not_empty(self.source_cloud_topics))
        sensors.check()
        return sensors


class SensorTopics(NamedTuple):
    """The topics of sources, one for each sensor.

    poses, clouds : topics with pose messages, and with cloud messages
    expected : topics of either kind that must publish; the silence of an expected topic is a fault
    """

    poses: tuple[str, ...]
    clouds: tuple[str, ...]
    expected: tuple[str, ...]


@dataclass(frozen=True)
class SimulatorParameters(SourceParameters):
    """Parameters of `rpf3d_simulator` except the fields of the scene (`scene_parameters`)."""

    autostart: bool = parameter(True, "whether the node configures and activates itself when it starts")
    first_rocks: int = parameter(200, "rocks of the first stage of an answer", 1, LARGEST_COUNT)
    release_speed: float = parameter(0.0, "speed along the x axis of each source's pose (m/s)", 0.0, FASTEST)
    above_ground: float = parameter(
        -1.0,
        "height (m) of each source above the terrain, which replaces the height of its pose; negative: use the pose",
        -1.0, 1e3,
    )  # fmt: skip
    highest_source: float = parameter(
        20.0,
        "largest distance (m) of a source from the ground; a farther source is a fault, often because z points down in "
        "the terrain or the sources",
        0.0, 1e5,
    )  # fmt: skip
    position_spread: float = parameter(
        2.0, "half-width in plan of the square around a source in which its rocks start (m)", 0.0, 1e3
    )
    velocity_spread: float = parameter(
        0.5,
        "half-width (m/s) of the range of release velocities around the source's velocity, in each direction",
        0.0, FASTEST,
    )  # fmt: skip
    region_size: float = parameter(
        50.0,
        "side (m) of squares in plan; a message of sources replaces a waiting message of its topic if each square with "
        "a source of the waiting message also has a source of the new message. No effect if the site file has a "
        "scan_period_s",
        1.0, 1e5,
    )  # fmt: skip
    expected_topics: tuple[str, ...] = parameter(
        ("",),
        "topics of sources that must publish; the level is fault until they do. Empty: all topics of source_topics and "
        "source_cloud_topics, except that a list equal to its default ([sources], [source_cloud]) requires no topic of "
        "its own; with both defaults, one of the two topics is enough",
    )
    optional_topics: tuple[str, ...] = parameter(
        ("",),
        "topics of sources that need not publish: they cause no fault before they have had a publisher. For sensors "
        "that are not always there",
    )
    publisher_overlap: float = parameter(
        25.0, "time (s) for which a topic may have two publishers; a killed publisher stays visible for 20 s", 0.0, 1e6
    )
    clock_patience: float = parameter(
        3.0, "with use_sim_time: wall-clock time (s) without a change of /clock after which there is a fault", 0.1, 1e6
    )
    waiting_sources: int = parameter(
        10,
        "number of source messages that may wait. If more wait: with a site file, the oldest message is answered last; "
        "without a site file, the oldest message is deleted",
        1, 10_000,
    )  # fmt: skip
    waiting_patches: int = parameter(
        32,
        "largest number of waiting patches; also the largest number of recent patches kept, to apply them again after "
        "a late whole survey",
        1, 10_000,
    )  # fmt: skip
    most_ahead: float = parameter(
        10.0,
        "time (s) by which a stamp may be ahead of the node's clock; messages with later stamps are refused. With a "
        "site file, the smaller of this time and clock_tolerance_s counts",
        0.0, 1e9,
    )  # fmt: skip
    most_points: int = parameter(MOST_POINTS, "largest number of points or vertices of a terrain", 4, LARGEST_COUNT)
    longest_edge: float = parameter(
        0.0,
        "longest side in plan (m) of a triangle between points of a survey or patch; longer triangles are gaps without "
        "ground. 0: for scattered points 10 times the median of the triangles' longest sides, for grids no limit",
        0.0, 1e6,
    )  # fmt: skip
    tallest_face: float = parameter(
        TALLEST_FACE,
        f"largest height (m) of a survey's triangle that is steeper than {STEEP:g} degrees; a survey with a taller "
        "triangle is refused, because one of its heights may mean \"no data\"",
        0.1, 1e6,
    )  # fmt: skip
    equipment_radius: float = parameter(
        15.0, "radius (m) of the circle around each machine of areas/equipment", 0.6, 1e3
    )
    store: str = parameter("", "folder of the last good terrain, which a restarted node loads; empty: none")
    site_file: str = parameter("", "site file: areas and the thresholds of alerts; empty: no alerts")
    decision_log: str = parameter("", "folder of the decision log; empty: a folder next to the site file")
    acknowledged_by: str = parameter("", "NAME: REASON of an acknowledgement; to be set before ~/acknowledge is called")
    trajectory_step: float = parameter(1.0, "longest step between published points of a flight (m)", 0.01, 1e3)
    displayed_trajectories: int = parameter(200, "largest number of rocks in the trajectories MarkerArray", 2, 10_000)
    points_per_trajectory: int = parameter(50, "largest number of points of each trajectory", 2, 10_000)

    @property
    def sensors(self) -> SensorTopics:
        """The topics of sources.

        Raises InputError in the cases of `recorded_sensors`, if an expected or optional topic is not a topic of
        sources, and if a topic is both expected and optional.
        """
        poses, clouds = self.recorded_sensors
        expected, optional = _not_empty(self.expected_topics), _not_empty(self.optional_topics)
        for name in (*expected, *optional):
            if name not in (*poses, *clouds):
                given_in = "expected_topics" if name in expected else "optional_topics"
                known = f"source_topics or source_cloud_topics ({', '.join((*poses, *clouds))})"
                raise InputError(f"{name} is in {given_in}, but not in {known}: write the name exactly as there")
            if name in expected and name in optional:
                raise InputError(f"{name} is in expected_topics and in optional_topics: see {SENSOR_PARAMETERS}")
        must = expected or (*self._named("source_topics"), *self._named("source_cloud_topics"))
        return SensorTopics(poses=poses, clouds=clouds, expected=tuple(name for name in must if name not in optional))

    def _named(self, parameter_name: str) -> tuple[str, ...]:
        """Return the topics that a user listed in a parameter; () for the default list: its topics might not exist."""
        default = next(each.default for each in fields(self) if each.name == parameter_name)
        value = tuple(getattr(self, parameter_name))
        return () if value == default else _not_empty(value)


def _not_empty(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names that are not empty: a ROS parameter for no names is a list with an empty name."""
    return tuple(name for name in names if name)


@dataclass(frozen=True)
class RecorderParameters(SourceParameters):
    """Parameters of `rpf3d_recorder`."""

    file: str = parameter(
        "rpf3d.rrd", "file of the recording; an existing file is replaced. With rotation: prefix of the file names"
    )
    rotate_mb: float = parameter(0.0, "megabytes after which the next file is begun; 0: never", 0.0, 1.0e6)
    rotate_minutes: float = parameter(0.0, "minutes after which the next file is begun; 0: never", 0.0, 1.0e6)
    keep_files: int = parameter(
        0, "with rotation: number of newest files, with their bags, to keep; 0: all", 0, LARGEST_COUNT
    )
    rocks_per_answer: int = parameter(
        50,
        "number of published rocks to record for each answer; those that reach an area are always recorded; 0: all",
        0, LARGEST_COUNT,
    )  # fmt: skip
    maps_every: float = parameter(
        10.0,
        "shortest time (s) between recorded hazard maps, except when an alert level changes; 0: no limit",
        0.0, 86_400.0,
    )  # fmt: skip
    bag: str = parameter("", "prefix of the MCAP bags to write next to the recording; empty: none")
    viewer: str = parameter(
        "none", "none; serve: viewers connect to the recorder; or the URL of a viewer, rerun+http://HOST:PORT/proxy"
    )
    viewer_bind: str = parameter(
        "127.0.0.1", "address on which viewers connect; any address but loopback is open to the network"
    )
    viewer_port: int = parameter(9876, "port on which viewers connect", 1, 65_535)


@dataclass(frozen=True)
class ScenePublisherParameters(FrameParameters):
    """Parameters of `rpf3d_scene_publisher`."""

    scene: str = parameter("", "the scene file; there is no default")
    repeat_every: float = parameter(10.0, "time (s) between repetitions of the sources", 0.1, 86_400.0)
    subscribers: int = parameter(
        1, "number of subscribers to the sources that must be present before the first publication", 1, 1000
    )
    repetitions: int = parameter(
        0, "number of times that the sources are published; 0: until the node ends", 0, LARGEST_COUNT
    )


@dataclass(frozen=True)
class AlarmBridgeParameters:
    """Parameters of `rpf3d_alarm_bridge`."""

    stale_after: float = parameter(
        3.0, "time (s) without a message of alerts or alarm after which the alarm contact opens", 0.1, 3600.0
    )
    clock_offset_s: float = parameter(
        1.0,
        "time (s) by which the clock of the bridge may differ from that of the simulator; beyond this time, an alert "
        "whose validity has ended, or whose stamp is in the future, opens the alarm contact",
        0.0, 3600.0,
    )  # fmt: skip
    contact_file: str = parameter(
        "",
        "file that replaces a dry contact; the contact is closed while the file has the word closed, the node locks "
        "the file, and the valid_until in the file has not passed; empty: none",
    )
    contact_port: int = parameter(0, "port on loopback of the TCP contact; 0: none", 0, 65_535)
