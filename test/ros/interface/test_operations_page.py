"""Tests that the pages on the live nodes and the files that start and show them agree with the code."""

import ast
import configparser
import json
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import fields
from itertools import pairwise
from pathlib import Path

import pytest
import yaml

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from parameter_tables import PAGE, with_tables

from rpf3d_core.live.scene import SCENE
from rpf3d_ros.interface.parameters import RecorderParameters, SimulatorParameters

ROOT = Path(__file__).resolve().parents[3]
SOURCES = sorted((ROOT / "rpf3d_ros").rglob("*.py"))
REFERENCE, HOWTO = ROOT / "docs" / "reference", ROOT / "docs" / "howto"
PARAMETERS = PAGE.read_text(encoding="utf-8")
TOPICS = (REFERENCE / "topics.md").read_text(encoding="utf-8")
DIAGNOSTICS = (REFERENCE / "diagnostics.md").read_text(encoding="utf-8")
PAGES = sorted([*REFERENCE.glob("*.md"), *HOWTO.glob("*.md")])
NOT_DRAWN_BY_RVIZ = {"terrain/mesh", "results", "alerts", "alarm", "/diagnostics"}
NOT_DRAWN_IN_3D = {"terrain/mesh", "results", "alerts", "alarm", "/diagnostics"}
ENDPOINTS = {"create_publisher", "create_lifecycle_publisher", "create_subscription", "_subscribe", "LargeTopic"}
OF_EVERY_NODE = {"parameter_events", "rosout", "clock", "~/transition_event"}
"""Topics that rclpy itself adds to each node."""


def documented(direction):
    """Return topic -> (type, quality of service) from the page's table of one direction."""
    table = TOPICS.partition(f"<!-- topics: {direction} -->")[2].partition("<!-- end -->")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.strip().splitlines()[2:]]
    return {row[0].strip("`"): (row[1], row[2]) for row in rows}


IN, OUT = documented("in"), documented("out")


def name_of(function):
    """Return the last name of a called function's syntax tree: `g` of `f.g`; "" if it has none."""
    return getattr(function, "attr", getattr(function, "id", ""))


def topics_in_code():
    """Yield (topic, name of the message class) of the publishers and subscriptions in the source files."""
    yield from ((topic, "PoseArray") for topic in SimulatorParameters().sensors.poses)
    yield from ((topic, "PointCloud2") for topic in SimulatorParameters().sensors.clouds)
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and name_of(node.func) in ENDPOINTS:
                named = {each.arg: each.value for each in node.keywords}
                kind, topic = (*node.args, named.get("kind"), named.get("name"))[:2]
                if isinstance(topic, ast.Constant) and isinstance(kind, ast.Name):
                    yield topic.value, kind.id
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "TOPICS":
                for key, value in zip(node.value.keys, node.value.values, strict=True):
                    yield key.value, getattr(value, "id", None)


def test_the_parameters_of_the_page_are_those_of_the_code():
    assert with_tables(PARAMETERS) == PARAMETERS, "run python docs/parameter_tables.py"


def test_every_topic_of_the_code_is_documented_with_its_type():
    found = set(topics_in_code()) - {("/clock", "Clock")}  # the clock of ROS, which the bag player may publish
    assert len(found) > 8, "the sources must have been understood"
    for topic, kind in found:
        documented_kind, _ = (IN | OUT).get(topic, ("", ""))
        assert documented_kind, topic
        assert kind is None or documented_kind.split("/")[-1] == kind, topic


def test_every_documented_topic_is_in_the_code():
    assert set(IN | OUT) <= {topic for topic, _ in topics_in_code()}


def test_every_part_that_reports_its_health_is_documented():
    section = DIAGNOSTICS.partition("## Diagnostics\n")[2].partition("\n## ")[0]
    parts = re.findall(r"^- \*\*`([a-z ]+)`\*\*", section, re.M)
    assert len(parts) > 8, "the list must have been found"
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text())):
            call = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "set"
            if call and getattr(node.func.value, "attr", "") in ("health", "_health") and node.args:
                first = node.args[0]
                assert not isinstance(first, ast.Constant) or first.value in parts, f"{path.name}: {first.value}"


def policy():
    """Yield (node, rights) of the SROS2 policy; rights are publish, subscribe, reply, request -> set of names."""
    root = ElementTree.parse(ROOT / "config" / "sros2_policy.xml").getroot()
    for profile in root.iter("profile"):
        allowed = {"publish": set(), "subscribe": set(), "reply": set(), "request": set()}
        for group in profile:
            (action, allow), *more = group.attrib.items()
            assert (allow, more) == ("ALLOW", []), "nothing else is needed for least privilege"
            allowed[action] |= {item.text for item in group}
        yield profile.get("node"), allowed


def test_the_policy_has_no_comment_inside_because_sros2_takes_it_for_an_enclave():
    builder = ElementTree.TreeBuilder(insert_comments=True)
    path = ROOT / "config" / "sros2_policy.xml"
    root = ElementTree.parse(path, parser=ElementTree.XMLParser(target=builder)).getroot()
    assert {element.tag for element in root.iter() if not isinstance(element.tag, str)} == set()


def without_slash(topics):
    return {topic.lstrip("/") for topic in topics}


def test_the_policy_allows_each_node_the_documented_topics_and_no_more():
    nodes = dict(policy())
    simulator, recorder = nodes["rpf3d_simulator"], nodes["rpf3d_recorder"]
    assert simulator["subscribe"] - OF_EVERY_NODE == without_slash(IN)
    assert simulator["publish"] - OF_EVERY_NODE == without_slash(OUT)
    assert recorder["subscribe"] - OF_EVERY_NODE == without_slash(IN | OUT)
    assert recorder["publish"] - OF_EVERY_NODE == {"diagnostics"}
    assert nodes["rpf3d_scene_publisher"]["publish"] - OF_EVERY_NODE == {"terrain/mesh", "sources", "diagnostics"}
    assert nodes["rpf3d_play_bag"]["publish"] - OF_EVERY_NODE == without_slash(IN), "and clock"
    assert nodes["plc_bridge"]["publish"] <= OF_EVERY_NODE
    asked = {"rpf3d_simulator/acknowledge", "rpf3d_simulator/set_parameters"}
    assert nodes["rpf3d_acknowledge"]["request"] == asked and nodes["rpf3d_acknowledge"]["publish"] <= OF_EVERY_NODE


ONLY_WITH_SIMULATED_TIME = {"clock", "parameter_events"}
"""Subscriptions that rclpy makes only with `use_sim_time`, or only in some releases."""
SCENE_FILE = ROOT / "config" / "scenes" / "shift.yaml"
NODES = {"simulator_node": {}, "recorder_node": {}, "scene_publisher_node": {"scene": SCENE_FILE}}


@pytest.mark.long
@pytest.mark.parametrize("module", NODES)
def test_the_policy_allows_each_node_what_it_really_offers_and_no_more(stage, module):
    """Under Enforce a node whose profile lacks one of its own endpoints does not start."""
    writes = {"file": stage.folder / "recording.rrd"} if module == "recorder_node" else {}
    stage.node(module, **NODES[module], **writes)
    peer, name = stage.peer(), f"rpf3d_{module.removesuffix('_node')}"
    allowed = dict(policy())[name]
    graph = {
        "reply": peer.node.get_service_names_and_types_by_node,
        "publish": peer.node.get_publisher_names_and_types_by_node,
        "subscribe": peer.node.get_subscriber_names_and_types_by_node,
    }

    def offered(action):
        found = graph[action](name, "/")
        return {topic.replace(f"/{name}/", "~/").lstrip("/") for topic, _ in found} - ONLY_WITH_SIMULATED_TIME

    peer.wait(lambda: name in peer.node.get_node_names(), "the node")
    for action in graph:
        told = allowed[action] - ONLY_WITH_SIMULATED_TIME
        peer.wait(lambda a=action, t=told: offered(a) == t, f"{action} of {sorted(told)}")


def test_the_policy_has_no_wildcards():
    assert not any("*" in name for _, allowed in policy() for names in allowed.values() for name in names)


def displays():
    """Return topic -> display of the RViz configuration."""
    rviz = yaml.safe_load((ROOT / "config" / "rpf3d.rviz").read_text())["Visualization Manager"]
    assert rviz["Global Options"]["Fixed Frame"] == "map"
    return {display["Topic"]["Value"]: display for display in rviz["Displays"] if "Topic" in display}


def test_rviz_shows_every_topic_that_it_can_draw():
    assert without_slash(displays()) == without_slash(set(IN | OUT) - NOT_DRAWN_BY_RVIZ)


def test_rviz_asks_for_what_is_offered():
    for topic, display in displays().items():
        _, quality = (IN | OUT).get(topic.lstrip("/")) or (IN | OUT)[topic]
        latched = display["Topic"]["Durability Policy"] == "Transient Local"
        assert latched == (quality in ("latched", "terrain")), f"{topic}; terrain as in config/rpf3d.yaml"
        assert display["Topic"]["Reliability Policy"] == "Reliable"


def panels(layout):
    """Return the ids of the panels of a Foxglove layout, in order."""
    return [layout] if isinstance(layout, str) else [*panels(layout["first"]), *panels(layout["second"])]


def test_the_foxglove_layout_has_a_configuration_for_each_panel_and_draws_every_topic():
    layout = json.loads((ROOT / "config" / "rpf3d_foxglove.json").read_text())
    assert sorted(panels(layout["layout"])) == sorted(layout["configById"])
    kinds = {panel.split("!")[0] for panel in layout["configById"]}
    assert kinds >= {"3D", "RawMessages", "Plot", "DiagnosticSummary", "CallService"}
    drawn = layout["configById"]["3D!rpf3d"]
    assert drawn["followTf"] == "map"
    assert without_slash(drawn["topics"]) == without_slash(set(IN | OUT) - NOT_DRAWN_IN_3D)


def service_of(name):
    """Return the section [Service] of a systemd unit in `config/`, and the text of the unit."""
    unit = configparser.ConfigParser(strict=False, interpolation=None)
    unit.optionxform = str
    text = (ROOT / "config" / name).read_text()
    unit.read_string(text)
    return unit["Service"], text


@pytest.mark.parametrize("name", ["rpf3d.service", "rpf3d_recorder.service"])
def test_a_service_starts_again_and_stays_on_this_machine(name):
    service, text = service_of(name)
    assert (service["Restart"], service["RestartPreventExitStatus"]) == ("on-failure", "2")
    assert "Environment=ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST\n" in text
    assert (service["IPAddressDeny"], service["IPAddressAllow"]) == ("any", "localhost")
    assert service["NoNewPrivileges"] == "yes"


def test_the_service_of_the_simulator_ends_in_time_and_may_compile():
    service, text = service_of("rpf3d.service")
    assert service["TimeoutStopSec"] == "5"
    assert "MemoryDenyWriteExecute=" not in text, "the engine is compiled while it runs"


@pytest.mark.parametrize(
    ("name", "program", "parameters"),
    [
        ("rpf3d.service", "rpf3d_simulator", SimulatorParameters),
        ("rpf3d_recorder.service", "rpf3d_recorder", RecorderParameters),
    ],
)
def test_a_service_runs_a_program_with_files_where_it_may_write_and_parameters_that_it_has(name, program, parameters):
    service, _ = service_of(name)
    started, *words = service["ExecStart"].replace("\\\n", " ").split()
    assert Path(started).name == program
    assert (ROOT / "config" / Path(words[words.index("--params-file") + 1]).name).is_file()
    given = dict(word.split(":=") for flag, word in pairwise(words) if flag == "-p")
    known = {field.name: type(field.default) for field in fields(parameters)} | {SCENE: str}
    assert given and set(given) <= set(known)
    for key, value in given.items():
        known[key](value)
        if value.startswith("/"):
            assert value.startswith("/var/lib/rpf3d/" if key not in (SCENE, "site_file") else "/etc/rpf3d/"), key


def test_every_file_that_the_pages_name_is_there():
    named = {name for page in PAGES for name in re.findall(r"`((?:config|launch)/[\w./]+)`", page.read_text())}
    assert "config/rpf3d_scene.yaml" in named, "the pages must have been understood"
    for name in named:
        assert (ROOT / name).exists(), name


def test_every_fault_test_that_the_page_names_is_there():
    names = re.findall(r"`(\w+/test_\w+\.py)`", DIAGNOSTICS)
    assert len(names) > 8, "the list must have been found"
    for name in names:
        assert (ROOT / "test" / "ros" / name).is_file(), name


def test_every_argument_of_the_launch_file_is_documented():
    tree = ast.parse((ROOT / "launch" / "rpf3d.launch.py").read_text())
    names = [
        node.args[0].value for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "DeclareLaunchArgument"
    ]  # fmt: skip
    rows = PARAMETERS.partition("| argument |")[2].partition("\n\n")[0].splitlines()[2:]
    told = [name for row in rows for name in re.findall(r"`(\w+)`", row.split("|")[1])]
    assert sorted(names) == sorted(told)
