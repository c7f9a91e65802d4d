"""Parameters of the nodes: frozen dataclasses whose defaults are the core's, each declared once, from here.

They are read when a node starts and are read-only from then on: a run is described by one set of them.
"""

import math
from dataclasses import MISSING, Field, dataclass, field, fields
from difflib import get_close_matches
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from rpf3d_core.errors import InputError
from rpf3d_core.io.scene_model import Material, RockSpec, Scene
from rpf3d_core.io.scene_models import OneOf
from rpf3d_ros.map_frame import MapFrame

ROS_OWN = ("use_sim_time", "start_type_description_service", "qos_overrides")
"""Parameters that rclpy declares by itself."""

LARGEST_COUNT = 2**31 - 1
LARGEST_NUMBER = 1.0e12
"""Upper ends of ranges that have none in the physics; a descriptor must have both ends."""

P = TypeVar("P")


def parameter(
    default: Any, description: str, low: float | None = None, high: float | None = None, choices: tuple[str, ...] = ()
) -> Any:
    """A field with the default, description and closed range or choices that its ROS parameter has."""
    about = {"description": description, "low": low, "high": high, "choices": choices}
    return field(default=default, metadata=about)


def _scene_default(name: str) -> Any:
    default = Scene.model_fields[name].get_default(call_default_factory=True)
    return default.name if isinstance(default, OneOf) else default


def _material_default(name: str) -> Any:
    return Material.model_fields[name].default


@dataclass(frozen=True)
class FrameParameters:
    """Which frames messages may be in."""

    map_frame: str = parameter("map", "frame of every output, and of inputs in local coordinates")
    survey_frame: str = parameter("", "frame of inputs in survey coordinates, shifted by map_origin; empty: none")
    map_origin: tuple[float, ...] = parameter((0.0, 0.0, 0.0), "survey coordinates E, N, H of the map's origin (m)")
    mesh_frame: str = parameter("map", "frame of terrain/mesh, whose message has no header")

    @property
    def frame(self) -> MapFrame:
        """The frame as a value. Raises InputError where it cannot be one."""
        if len(self.map_origin) != 3 or not all(math.isfinite(value) for value in self.map_origin):
            raise InputError(f"map_origin is {list(self.map_origin)}; it must be three finite numbers E, N, H in m")
        if not self.map_frame or self.map_frame.startswith("/") or self.map_frame == self.survey_frame:
            raise InputError("map_frame must be a name without a leading slash, and not the name of survey_frame")
        x, y, z = self.map_origin
        return MapFrame(self.map_frame, self.survey_frame, (x, y, z))


@dataclass(frozen=True)
class InputParameters(FrameParameters):
    """How terrain is received."""

    terrain_durability: str = parameter(
        "volatile",
        "transient_local gets the last terrain of a latched publisher, and nothing at all of a volatile one",
        choices=("volatile", "transient_local"),
    )


@dataclass(frozen=True)
class SimulatorParameters(InputParameters):
    """What `rpf3d_simulator` does with a source; the same words, units and defaults as a scene file."""

    normal_restitution: float = parameter(0.5, "R_n (-) of the ground; thesis table 5-1", 0.0, 1.0)
    tangential_restitution: float = parameter(0.8, "R_t (-) of the ground; thesis table 5-1", 0.0, 1.0)
    friction_angle_deg: float = parameter(
        _material_default("friction_angle_deg"), "friction angle of the ground (degrees)", 0.0, 89.9
    )
    stop_speed: float = parameter(
        _scene_default("stop_speed"), "speed below which a rock on the ground stops (m/s)", 0.0, LARGEST_NUMBER
    )
    rebound: str = parameter(_scene_default("rebound"), "rebound model", choices=("constant", "thesis_literal"))
    ground: str = parameter(_scene_default("ground"), "what follows bouncing", choices=("none", "sliding"))
    gravity: float = parameter(_scene_default("gravity"), "gravity (m/s^2)", 1e-3, LARGEST_NUMBER)
    smallest_bounce: float = parameter(
        _scene_default("smallest_bounce"), "rise (m) below which the rest of bouncing is summed", 1e-9, LARGEST_NUMBER
    )
    max_time: float = parameter(_scene_default("max_time"), "longest flight of a rock (s)", 1e-3, LARGEST_NUMBER)
    max_impacts: int = parameter(_scene_default("max_impacts"), "most impacts of a rock", 1, LARGEST_COUNT)
    engine: str = parameter(_scene_default("engine"), "engine", choices=("auto", "reference", "compiled"))
    weld: float = parameter(1e-4, "vertices of terrain/mesh nearer than this are one (m)", 0.0, LARGEST_NUMBER)
    density: float = parameter(RockSpec.model_fields["density"].default, "of the rocks (kg/m^3)", 1.0, LARGEST_NUMBER)
    diameter: float = parameter(1.0, "of the sphere of the same volume (m)", 1e-3, 1e3)
    release_speed: float = parameter(0.0, "speed along the x axis of each source's pose (m/s)", 0.0, 1e3)
    above_ground: float = parameter(
        -1.0, "height of each source above the terrain, in place of its pose's (m); negative: the pose's", -1.0, 1e3
    )
    trajectory_step: float = parameter(1.0, "longest step between published points of a flight (m)", 0.01, 1e3)
    displayed_trajectories: int = parameter(200, "most rocks in the trajectories MarkerArray", 2, 10_000)
    points_per_trajectory: int = parameter(50, "most points of each of them", 2, 10_000)


@dataclass(frozen=True)
class RecorderParameters(InputParameters):
    """Where `rpf3d_recorder` writes."""

    file: str = parameter(
        "rpf3d.rrd", "the recording to write; replaced where it exists, with rotation a prefix of the files' names"
    )
    rotate_mb: float = parameter(0.0, "megabytes after which the next file is begun; 0: never", 0.0, 1.0e6)
    rotate_minutes: float = parameter(0.0, "minutes after which the next file is begun; 0: never", 0.0, 1.0e6)
    keep_files: int = parameter(0, "files kept with rotation, the newest; 0: all", 0, LARGEST_COUNT)
    bag: str = parameter("", "prefix of the MCAP bags to write beside the recording; empty: none")
    viewer: str = parameter("none", "none, serve (viewers come here), or the url of a viewer, rerun+http://HOST:PORT/proxy")
    viewer_bind: str = parameter("127.0.0.1", "address to serve viewers on; any but loopback opens it to the network")
    viewer_port: int = parameter(9876, "port to serve viewers on", 1, 65_535)


@dataclass(frozen=True)
class ScenePublisherParameters(FrameParameters):
    """What `rpf3d_scene_publisher` publishes, and how often."""

    scene: str = parameter("", "the scene file; there is no default")
    repeat_every: float = parameter(10.0, "seconds between repetitions of the sources", 0.1, 86_400.0)
    subscribers: int = parameter(1, "subscribers of sources to wait for before the first publication", 1, 1000)
    repetitions: int = parameter(0, "how often the sources are published; 0: until the node ends", 0, LARGEST_COUNT)


def declare(node: Node, kind: type[P]) -> P:
    """Declare a dataclass' fields as parameters of the node and return them with the values in force.

    Raises InputError, naming the parameter, for a wrong type, a value outside its range, or none of the choices.
    A parameter that was given and is not declared is warned of, with the nearest name.
    """
    values = {each.name: _declared(node, each) for each in fields(kind)}  # type: ignore[arg-type]
    _warn_of_unknown(node, list(values))
    return kind(**values)


def descriptor(about: Field[Any]) -> ParameterDescriptor:
    """The description and range of a field as ROS tools show them."""
    meta = about.metadata
    described = ParameterDescriptor(description=meta["description"], read_only=True)
    if meta["choices"]:
        described.additional_constraints = "one of " + ", ".join(meta["choices"])
    if meta["low"] is None:
        return described
    if about.type in (int, "int"):
        described.integer_range = [IntegerRange(from_value=meta["low"], to_value=meta["high"])]
    else:
        described.floating_point_range = [FloatingPointRange(from_value=meta["low"], to_value=meta["high"])]
    return described


def _declared(node: Node, about: Field[Any]) -> Any:
    assert about.default is not MISSING, about.name
    try:
        value = node.declare_parameter(about.name, _as_ros(about.default), descriptor(about)).value
    except (InvalidParameterTypeException, InvalidParameterValueException) as error:
        raise InputError(f"parameter {about.name}: {error}") from error
    choices = about.metadata["choices"]
    if choices and value not in choices:
        raise InputError(f"parameter {about.name} is '{value}'; it must be one of {', '.join(choices)}")
    return tuple(value) if isinstance(about.default, tuple) else value


def _as_ros(default: Any) -> Any:
    return list(default) if isinstance(default, tuple) else default


def _warn_of_unknown(node: Node, known: list[str]) -> None:
    given = getattr(node, "_parameter_overrides", {})  # rclpy has no public name for what the command line gave
    for name in given:
        if name not in known and name.split(".")[0] not in ROS_OWN:
            near = get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            node.get_logger().warning(f"parameter {name} is not one of this node's and has no effect{hint}")
