"""Launch and parameter files: launch itself cannot be installed by pip, so stubs of it stand in."""

import ast
import sys
from dataclasses import fields
from pathlib import Path
from types import ModuleType

import pytest
import yaml

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_core.live.scene import SCENE, live_parameters
from rpf3d_ros import recorder_node, scene_publisher_node, simulator_node
from rpf3d_ros.parameters import FrameParameters, RecorderParameters, ScenePublisherParameters, SimulatorParameters

ROOT = Path(__file__).resolve().parents[2]
LAUNCH_FILES = sorted((ROOT / "launch").glob("*.launch.py"))
PARAMETERS = {
    "/**": FrameParameters,
    simulator_node.NAME: SimulatorParameters,
    recorder_node.NAME: RecorderParameters,
    scene_publisher_node.NAME: ScenePublisherParameters,
}


def known_to(node):
    """Parameter -> a value of its type, of a node or of all of them."""
    known = {field.name: field.default for field in fields(PARAMETERS[node])}
    if node == simulator_node.NAME:
        known |= {field.key: field.kind() for field in live_parameters()} | {SCENE: ""}
    return known


def flat(section, above=""):
    """Parameter -> value of a nested section of a parameter file."""
    for name, value in section.items():
        if isinstance(value, dict):
            yield from flat(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def calls(tree, name):
    return [n for n in ast.walk(tree) if isinstance(n, ast.Call) and getattr(n.func, "id", None) == name]


def keywords(call):
    return {k.arg: k.value.value for k in call.keywords if isinstance(k.value, ast.Constant)}


@pytest.mark.parametrize("path", LAUNCH_FILES, ids=lambda path: path.name)
def test_a_launch_file_compiles_and_describes_a_launch(path):
    tree = ast.parse(path.read_text())
    compile(tree, str(path), "exec")
    functions = [n for n in tree.body if isinstance(n, ast.FunctionDef)]
    assert [f.name for f in functions] == ["generate_launch_description"]
    assert not functions[0].args.args
    assert isinstance(functions[0].body[-1], ast.Return)


@pytest.mark.parametrize("path", LAUNCH_FILES, ids=lambda path: path.name)
def test_every_launched_node_is_one_of_the_package(path):
    tree = ast.parse(path.read_text())
    nodes = [keywords(call) for call in calls(tree, "Node")]
    assert nodes or calls(tree, "IncludeLaunchDescription")
    assert {node["package"] for node in nodes} <= {"rpf3d"}
    assert {node["executable"] for node in nodes} <= set(PARAMETERS)


@pytest.mark.parametrize("path", LAUNCH_FILES, ids=lambda path: path.name)
def test_a_launch_configuration_is_declared_as_an_argument(path):
    tree = ast.parse(path.read_text())
    declared = {call.args[0].value for call in calls(tree, "DeclareLaunchArgument")}
    used = {call.args[0].value for call in calls(tree, "LaunchConfiguration")}
    assert used <= declared


class Made:
    """Anything of launch: remembers the arguments it was made with."""

    def __init__(self, *arguments, **named):
        self.arguments, self.named = arguments, named


STUBS = {
    "launch": ["LaunchDescription"],
    "launch.actions": ["DeclareLaunchArgument", "IncludeLaunchDescription", "SetEnvironmentVariable"],
    "launch.conditions": ["IfCondition"],
    "launch.launch_description_sources": ["PythonLaunchDescriptionSource"],
    "launch.substitutions": [
        "EqualsSubstitution", "IfElseSubstitution", "LaunchConfiguration", "NotEqualsSubstitution",
        "PathJoinSubstitution",
    ],
    "launch_ros": [],
    "launch_ros.actions": ["Node"],
    "launch_ros.parameter_descriptions": ["ParameterValue"],
    "launch_ros.substitutions": ["FindPackageShare"],
}  # fmt: skip


@pytest.fixture
def described(request, monkeypatch):
    """The entities that a launch file describes, by the name of their class."""
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


def chosen(default):
    """The paths that the default of an argument may come to."""
    if isinstance(default, str):
        return []
    choice = [default.named[name] for name in ("if_value", "else_value") if name in default.named]
    return choice or [default]


def resolved(path):
    """The file of this source tree that a PathJoinSubstitution in the package's share names."""
    ((share, *parts),) = path.arguments
    assert (type(share).__name__, share.arguments) == ("FindPackageShare", ("rpf3d",))
    return ROOT.joinpath(*parts)


@pytest.mark.parametrize("described", LAUNCH_FILES, ids=lambda path: path.name, indirect=True)
def test_a_launch_file_names_files_that_are_there(described):
    defaults = [argument.named["default_value"] for argument in described["DeclareLaunchArgument"]]
    includes = [include.arguments[0].arguments[0] for include in described.get("IncludeLaunchDescription", [])]
    paths = [path for default in defaults for path in chosen(default)] + includes
    assert paths
    assert all(resolved(path).is_file() for path in paths)


@pytest.mark.parametrize("described", LAUNCH_FILES, ids=lambda path: path.name, indirect=True)
def test_a_launched_node_gets_the_parameter_file_and_only_parameters_that_it_has(described):
    for node in described.get("Node", []):
        given, *own = node.named["parameters"]
        assert given.arguments == ("params_file",)
        known = known_to(node.named["executable"])
        assert {name for section in own for name in section} <= set(known)


def set_by(file):
    """Node -> parameter -> value of a parameter file."""
    content = yaml.safe_load((ROOT / "config" / file).read_text())
    return {node: dict(flat(section["ros__parameters"])) for node, section in content.items()}


@pytest.mark.parametrize("file", ["rpf3d.yaml", "rpf3d_scene.yaml"])
def test_a_parameter_file_sets_only_parameters_that_exist_and_of_their_type(file):
    for node, given in set_by(file).items():
        known = known_to(node)
        for name, value in given.items():
            assert name in known, f"{node}: {name}"
            assert isinstance(value, list if isinstance(known[name], tuple) else type(known[name])), f"{node}: {name}"


def test_the_parameter_file_beside_a_scene_differs_from_the_other_by_the_keys_of_a_scene_alone():
    keys = {field.key for field in live_parameters()}
    without = {node: {n: v for n, v in given.items() if n not in keys} for node, given in set_by("rpf3d.yaml").items()}
    assert without != set_by("rpf3d.yaml")
    assert set_by("rpf3d_scene.yaml") == without


@pytest.mark.parametrize("described", [ROOT / "launch" / "rpf3d.launch.py"], ids=["rpf3d"], indirect=True)
def test_a_scene_file_takes_the_parameter_file_that_sets_no_key_of_a_scene(described):
    (default,) = [
        each.named["default_value"] for each in described["DeclareLaunchArgument"]
        if each.arguments[0] == "params_file"
    ]  # fmt: skip
    (condition,) = default.arguments
    scene, nothing = condition.arguments
    assert (type(condition).__name__, scene.arguments, nothing) == ("EqualsSubstitution", ("scene",), "")
    files = [resolved(default.named[name]).name for name in ("if_value", "else_value")]
    assert files == ["rpf3d.yaml", "rpf3d_scene.yaml"]


@pytest.mark.parametrize("described", [ROOT / "launch" / "rpf3d.launch.py"], ids=["rpf3d"], indirect=True)
def test_the_simulator_is_always_launched_and_the_others_are_by_argument(described):
    conditions = {node.named["executable"]: node.named.get("condition") for node in described["Node"]}
    assert conditions[simulator_node.NAME] is None
    assert all(conditions[name] for name in (recorder_node.NAME, scene_publisher_node.NAME))


@pytest.mark.parametrize("described", [ROOT / "launch" / "rpf3d.launch.py"], ids=["rpf3d"], indirect=True)
def test_every_argument_of_a_launch_file_reaches_a_node_with_its_type(described):
    given = {}
    for node in described["Node"]:
        for section in node.named["parameters"][1:]:
            given |= {value.arguments[0].arguments[0]: value.named["value_type"] for value in section.values()}
    declared = {argument.arguments[0] for argument in described["DeclareLaunchArgument"]}
    assert declared == set(given) | {"params_file", "record", "discovery_range"}
    assert given.pop("autostart") is bool
    assert set(given.values()) == {str}, "an empty name is a name, and no null"


@pytest.mark.parametrize("described", [ROOT / "launch" / "rpf3d.launch.py"], ids=["rpf3d"], indirect=True)
def test_nodes_are_launched_for_this_machine_alone_unless_told(described):
    (variable,) = described["SetEnvironmentVariable"]
    name, value = variable.arguments
    defaults = {each.arguments[0]: each.named["default_value"] for each in described["DeclareLaunchArgument"]}
    assert (name, defaults[value.arguments[0]]) == ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
