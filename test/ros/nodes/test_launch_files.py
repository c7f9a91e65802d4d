"""Tests of launch and parameter files, with stubs for the package launch, which pip cannot install."""

import ast
import sys
from dataclasses import fields
from pathlib import Path
from types import ModuleType

import pytest
import yaml

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_core.live.scene import SCENE, live_parameters
from rpf3d_ros.interface.declared_parameters import SHARED
from rpf3d_ros.interface.parameters import (
    FrameParameters,
    RecorderParameters,
    ScenePublisherParameters,
    SimulatorParameters,
)
from rpf3d_ros.nodes import recorder, scene_publisher, simulator

ROOT = Path(__file__).resolve().parents[3]
LAUNCH_FILES = sorted((ROOT / "launch").glob("*.launch.py"))
PARAMETERS = {
    "/**": FrameParameters,
    simulator.NAME: SimulatorParameters,
    recorder.NAME: RecorderParameters,
    scene_publisher.NAME: ScenePublisherParameters,
}

OVERRIDABLE = ("use_tf", "autostart")
"""Parameters that users set by `-p` or a launch argument: the shipped files set them in the section of all nodes."""

IN_ANY_NAMESPACE = "/**/"
"""Prefix of a node's name in a parameter file: the section applies in every namespace."""


def known_to(node):
    """Return parameter -> a value of its type, for all parameters of a node."""
    node = node.removeprefix(IN_ANY_NAMESPACE)
    known = {field.name: field.default for field in fields(PARAMETERS[node])} | {"use_sim_time": False}
    if node == "/**":
        known |= {name: known_to(recorder.NAME)[name] for name in SHARED}
        known |= {name: known_to(simulator.NAME)[name] for name in OVERRIDABLE}
    if node == simulator.NAME:
        known |= {field.key: field.kind() for field in live_parameters()} | {SCENE: ""}
    return known


def flat(section, above=""):
    """Yield (parameter, value) of a nested section of a parameter file; `above` precedes the names."""
    for name, value in section.items():
        if isinstance(value, dict):
            yield from flat(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


@pytest.mark.parametrize("path", LAUNCH_FILES, ids=lambda path: path.name)
def test_a_launch_file_compiles_and_describes_a_launch(path):
    tree = ast.parse(path.read_text())
    compile(tree, str(path), "exec")
    functions = [n for n in tree.body if isinstance(n, ast.FunctionDef)]
    made = next(f for f in functions if f.name == "generate_launch_description")
    assert not made.args.args and isinstance(made.body[-1], ast.Return)
    assert all(f is made or f.name.startswith("_") for f in functions)


class Made:
    """Stands in for any class of launch; keeps the arguments with which it was made."""

    def __init__(self, *arguments, **named):
        self.arguments, self.named = arguments, named

    def perform(self, context):
        """Return the value in `context` of the launch argument that this LaunchConfiguration names."""
        return context[self.arguments[0]]


STUBS = {
    "launch": ["LaunchContext", "LaunchDescription"],
    "launch.actions": ["DeclareLaunchArgument", "IncludeLaunchDescription", "OpaqueFunction", "SetEnvironmentVariable"],
    "launch.launch_description_sources": ["PythonLaunchDescriptionSource"],
    "launch.substitutions": ["LaunchConfiguration", "PathJoinSubstitution"],
    "launch_ros": [],
    "launch_ros.actions": ["Node"],
    "launch_ros.parameter_descriptions": ["ParameterValue"],
    "launch_ros.substitutions": ["FindPackageShare"],
}


@pytest.fixture
def described(request, monkeypatch):
    """Return the entities that a launch file describes: class name -> list of entities."""
    for name, classes in STUBS.items():
        module = ModuleType(name)
        vars(module).update({each: type(each, (Made,), {}) for each in classes})
        monkeypatch.setitem(sys.modules, name, module)
    scope = {}
    exec(compile(request.param.read_text(), str(request.param), "exec"), scope)
    (entities,) = scope["generate_launch_description"]().arguments
    found = {}
    for entity in entities:
        found.setdefault(type(entity).__name__, []).append(entity)
    return found


def launched(described, **given):
    """Return program -> (parameter file, further parameters) of the nodes launched with the arguments `given`."""
    found = {}
    for program, node in nodes_of(described, **given).items():
        if program == "rviz2":
            continue
        assert node["package"] == "rpf3d"
        file, *own = node["parameters"]
        found[program] = file, {name: value for section in own for name, value in section.items()}
    return found


def nodes_of(described, **given):
    """Return program -> keyword arguments of each Node that is launched with the arguments `given`."""
    defaults = {each.arguments[0]: each.named["default_value"] for each in described["DeclareLaunchArgument"]}
    assert set(given) <= set(defaults)
    (function,) = described["OpaqueFunction"]
    return {node.named["executable"]: node.named for node in function.named["function"]({**defaults, **given})}


def resolved(path):
    """Return the file in this source tree for a PathJoinSubstitution in the package's share folder."""
    ((share, *parts),) = path.arguments
    assert (type(share).__name__, share.arguments) == ("FindPackageShare", ("rpf3d",))
    return ROOT.joinpath(*parts)


@pytest.mark.parametrize("described", LAUNCH_FILES, ids=lambda path: path.name, indirect=True)
def test_a_launch_file_names_files_that_are_there(described):
    defaults = [argument.named["default_value"] for argument in described["DeclareLaunchArgument"]]
    includes = [include.arguments[0].arguments[0] for include in described.get("IncludeLaunchDescription", [])]
    paths = [path for path in defaults if not isinstance(path, str)] + includes
    assert all(resolved(path).is_file() for path in paths)
    assert paths or described["OpaqueFunction"]


RPF3D = pytest.mark.parametrize("described", [ROOT / "launch" / "rpf3d.launch.py"], ids=["rpf3d"], indirect=True)


@RPF3D
def test_the_simulator_is_always_launched_and_the_others_are_by_argument(described):
    assert set(launched(described)) == {simulator.NAME, recorder.NAME}
    assert set(launched(described, record="false")) == {simulator.NAME}
    assert set(launched(described, publish_scene="demo.yaml")) == set(PARAMETERS) - {"/**"}


@RPF3D
def test_what_is_not_given_takes_the_place_of_nothing_in_the_parameter_file(described):
    assert launched(described)[simulator.NAME][1] == {}
    assert set(launched(described, map_frame="pit")[simulator.NAME][1]) == {"map_frame"}
    assert launched(described, params_file="mine.yaml")[recorder.NAME][0] == "mine.yaml"


@RPF3D
def test_a_scene_file_takes_the_parameter_file_that_sets_no_key_of_a_scene(described):
    for given, file in (({}, "rpf3d.yaml"), ({"scene": "pit.yaml"}, "rpf3d_scene.yaml")):
        for path, _ in launched(described, **given).values():
            assert resolved(path) == ROOT / "config" / file and resolved(path).is_file()


@RPF3D
def test_every_argument_of_the_launch_file_reaches_a_node_as_a_parameter_that_it_has_and_with_its_type(described):
    switches = {"record": "true", "respawn": "true", "rviz": "false"}
    every = {each.arguments[0]: "x" for each in described["DeclareLaunchArgument"]} | switches
    reached = set()
    for program, (_, own) in launched(described, **every).items():
        known = known_to(program) | known_to("/**")
        for name, value in own.items():
            assert value.arguments == ("x",) and value.named["value_type"] is type(known[name]), name
        reached |= set(own)
    of_launch = {"namespace", "log_level", *switches}
    told_otherwise = {"params_file", "record_to", "publish_scene", "discovery_range", *of_launch}
    assert reached == set(every) - told_otherwise | {"file"}


def set_by(file):
    """Return node -> parameter -> value of a parameter file in `config/`."""
    content = yaml.safe_load((ROOT / "config" / file).read_text())
    return {node: dict(flat(section["ros__parameters"])) for node, section in content.items()}


@pytest.mark.parametrize("file", ["rpf3d.yaml", "rpf3d_scene.yaml"])
def test_a_parameter_file_sets_only_parameters_that_exist_and_of_their_type(file):
    for node, given in set_by(file).items():
        known = known_to(node)
        for name, value in given.items():
            assert name in known, f"{node}: {name}"
            assert isinstance(value, list if isinstance(known[name], tuple) else type(known[name])), f"{node}: {name}"


@pytest.mark.parametrize("file", ["rpf3d.yaml", "rpf3d_scene.yaml"])
def test_the_section_of_a_node_sets_nothing_that_would_win_over_a_launch_argument(file):
    for node, given in set_by(file).items():
        assert not set(given) & {*OVERRIDABLE, "scene", "site_file", "decision_log", "store"} or node == "/**"
    assert set(OVERRIDABLE) <= set(set_by(file)["/**"])


def test_the_parameter_file_beside_a_scene_differs_from_the_other_by_the_keys_of_a_scene_alone():
    keys = {field.key for field in live_parameters()}
    without = {node: {n: v for n, v in given.items() if n not in keys} for node, given in set_by("rpf3d.yaml").items()}
    assert without != set_by("rpf3d.yaml")
    assert set_by("rpf3d_scene.yaml") == without


@RPF3D
def test_all_nodes_run_in_the_namespace_with_the_log_level_and_respawn_unless_told(described):
    for node in nodes_of(described, namespace="pit_a", log_level="warn", publish_scene="demo.yaml").values():
        assert (node["namespace"], node["ros_arguments"], node["respawn"]) == ("pit_a", ["--log-level", "warn"], True)
    assert not any(node["respawn"] for node in nodes_of(described, respawn="false").values())


@RPF3D
def test_rviz_is_launched_with_the_shipped_view_in_the_same_namespace_if_asked(described):
    assert "rviz2" not in nodes_of(described)
    view = nodes_of(described, namespace="pit_a", rviz="true")["rviz2"]
    assert view["namespace"] == "pit_a"
    assert resolved(view["arguments"][1]).is_file()


@RPF3D
@pytest.mark.parametrize("switch", ["record", "respawn", "rviz"])
def test_a_switch_that_is_neither_true_nor_false_is_refused_by_name(described, switch):
    with pytest.raises(ValueError, match=f"{switch} is 'perhaps'"):
        launched(described, **{switch: "perhaps"})


@pytest.mark.parametrize("file", ["rpf3d.yaml", "rpf3d_scene.yaml"])
def test_a_parameter_file_counts_in_every_namespace(file):
    assert all(node == "/**" or node.startswith(IN_ANY_NAMESPACE) for node in set_by(file))


@RPF3D
def test_nodes_are_launched_for_this_machine_alone_unless_told(described):
    (variable,) = described["SetEnvironmentVariable"]
    name, value = variable.arguments
    defaults = {each.arguments[0]: each.named["default_value"] for each in described["DeclareLaunchArgument"]}
    assert (name, defaults[value.arguments[0]]) == ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
