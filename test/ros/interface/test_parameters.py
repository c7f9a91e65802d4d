"""Tests that parameters are declared from the dataclasses, and that a refusal of a wrong value names the parameter."""

import re
from dataclasses import fields

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.declared_parameters import declare, descriptor
from rpf3d_ros.interface.parameters import RecorderParameters, ScenePublisherParameters, SimulatorParameters
from rpf3d_ros.interface.recorded_topics import RecordedSensors

DECIMALS = "a list of numbers with decimal points"
KINDS = [SimulatorParameters, RecorderParameters, ScenePublisherParameters]


@pytest.fixture
def node_with():
    """Yield a function that makes a node with the given parameters, in a separate context."""
    made = []

    def make(**values):
        context = Context()
        context.init(domain_id=1)
        given = [f"{name}:={value}" for name, value in values.items()]
        arguments = ["--ros-args", *[word for each in given for word in ("-p", each)]]
        made.append((Node("rpf3d_tested", context=context, cli_args=arguments), context))
        return made[-1][0]

    yield make
    for node, context in made:
        node.destroy_node()
        context.try_shutdown()


@pytest.mark.parametrize("kind", KINDS)
def test_the_defaults_of_the_dataclass_are_the_defaults_in_ros(kind, node_with):
    assert declare(node_with(), kind) == kind()


@pytest.mark.parametrize("kind", KINDS)
def test_every_parameter_has_a_description_and_its_default_lies_in_its_range(kind):
    for each in fields(kind):
        meta = each.metadata
        assert meta["description"]
        assert descriptor(each).read_only
        assert meta["low"] is None or meta["low"] <= each.default <= meta["high"]
        assert not meta["choices"] or each.default in meta["choices"]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("equipment_radius", -0.1),
        ("equipment_radius", ".nan"),
        ("equipment_radius", "wide"),
        ("equipment_radius", 1),
        ("first_rocks", 0),
        ("displayed_trajectories", 1),
        ("terrain_durability", "latched"),
    ],
)
def test_a_wrong_value_is_refused_by_name(name, value, node_with):
    with pytest.raises(InputError, match=f"parameter {name}"):
        declare(node_with(**{name: value}), SimulatorParameters)


@pytest.mark.parametrize("origin", ["[1.0, 2.0]", "[.nan, 0.0, 0.0]", "[.inf, 0.0, 0.0]"])
def test_a_map_origin_that_is_no_place_is_refused(origin, node_with):
    with pytest.raises(InputError, match="map_origin"):
        declare(node_with(map_origin=origin), SimulatorParameters).frame  # noqa: B018


@pytest.mark.parametrize("frame", ["/map", "''", "utm"])
def test_a_map_frame_that_cannot_be_one_is_refused(frame, node_with):
    with pytest.raises(InputError, match="map_frame"):
        declare(node_with(map_frame=frame, survey_frame="utm"), SimulatorParameters).frame  # noqa: B018


def test_parameters_cannot_be_changed_while_the_node_runs(node_with):
    node = node_with()
    declare(node, SimulatorParameters)
    result = node.set_parameters([Parameter("first_rocks", value=3)])[0]
    assert not result.successful


@pytest.mark.parametrize("kind", KINDS)
def test_the_clock_of_a_running_node_cannot_be_exchanged(kind, node_with):
    node = node_with()
    declare(node, kind)
    result = node.set_parameters([Parameter("use_sim_time", value=True)])[0]
    assert not result.successful and "use_sim_time cannot change while the node runs" in result.reason
    assert not node.get_clock().ros_time_is_active


@pytest.mark.parametrize(("given", "expected"), [
    ({}, ()),
    ({"source_topics": ("radar_n", "radar_s")}, ("radar_n", "radar_s")),
    ({"source_topics": ("radar_n",), "source_cloud_topics": ("lidar", "")}, ("radar_n", "lidar")),
    ({"source_topics": ("radar_n", "radar_s"), "optional_topics": ("radar_s",)}, ("radar_n",)),
    ({"source_topics": ("radar_n", "radar_s"), "expected_topics": ("radar_s",)}, ("radar_s",)),
    ({"expected_topics": ("sources",)}, ("sources",)),
    ({"source_topics": ("sources",), "source_cloud_topics": ("",)}, ()),
])  # fmt: skip
def test_a_topic_that_the_site_names_must_publish_unless_it_says_otherwise(given, expected):
    assert SimulatorParameters(**given).sensors.expected == expected


@pytest.mark.parametrize("kind", [SimulatorParameters, RecorderParameters])
def test_simulator_and_recorder_have_the_same_topics_of_sources(kind, node_with):
    node = node_with(source_topics="[radar_n, radar_s]", source_cloud_topics="['']")
    assert declare(node, kind).recorded_sensors == RecordedSensors(poses=("radar_n", "radar_s"), clouds=())


@pytest.mark.parametrize("kind", [SimulatorParameters, RecorderParameters])
@pytest.mark.parametrize(("given", "sentence"), [
    ({"source_cloud_topics": ("sources",)}, "sources is given twice"),
    ({"source_topics": ("alerts",)}, "alerts is a topic of rpf3d that has no sources of a sensor"),
    ({"source_topics": ("areas/equipment",)}, "areas/equipment is a topic of rpf3d"),
])  # fmt: skip
def test_topics_that_cannot_be_those_of_sensors_are_refused_by_simulator_and_recorder(kind, given, sentence):
    with pytest.raises(InputError, match=f"{sentence}.*: see source_topics and source_cloud_topics"):
        getattr(kind(**given), "sensors" if kind is SimulatorParameters else "recorded_sensors")


@pytest.mark.parametrize("kind", KINDS)
def test_topics_of_sources_that_a_file_sets_for_all_nodes_cause_no_warning(kind, node_with, capfd):
    declare(node_with(source_topics="[radar_n]", source_cloud_topics="['']"), kind)
    assert "no parameter" not in capfd.readouterr().err


@pytest.mark.parametrize(("given", "sentence"), [
    ({"optional_topics": ("radar",)}, r"radar is in optional_topics, but not .* \(sources, source_cloud\)"),
    ({"expected_topics": ("radar",)}, "radar is in expected_topics, but not in source_topics"),
    ({"expected_topics": ("sources",), "optional_topics": ("sources",)}, "sources is in expected_topics and in"),
])  # fmt: skip
def test_topics_that_contradict_each_other_are_refused(given, sentence):
    with pytest.raises(InputError, match=sentence):
        SimulatorParameters(**given).sensors  # noqa: B018


@pytest.mark.parametrize(("name", "given", "sentence"), [
    ("release_speed", "2", "release_speed is 2; it must be a number with a decimal point: write 2.0"),
    ("map_origin", "[1, 2, 3]", f"map_origin is [1, 2, 3]; it must be {DECIMALS}: write [1.0, 2.0, 3.0]"),
    ("map_origin", "[a, b, c]", f"map_origin is ['a', 'b', 'c']; it must be {DECIMALS}"),
    ("source_topics", "radar", "source_topics is 'radar'; it must be a list of texts"),
    ("source_topics", "[1, 2]", "source_topics is [1, 2]; it must be a list of texts"),
    ("use_tf", "perhaps", "use_tf is 'perhaps'; it must be true or false"),
    ("first_rocks", "2.5", "first_rocks is 2.5; it must be a whole number"),
    ("first_rocks", "-2", "first_rocks is -2; it must be from 1 to 2147483647"),
    ("release_speed", "-2.5", "release_speed is -2.5; it must be from 0 to 10000"),
    ("decision_log", "3", "decision_log is 3; it must be a text"),
])  # fmt: skip
def test_a_value_of_the_wrong_type_or_range_is_refused_with_what_to_write(name, given, sentence, node_with):
    with pytest.raises(InputError, match=f"^parameter {re.escape(sentence)}$"):
        declare(node_with(**{name: given}), SimulatorParameters)


def test_a_parameter_that_the_node_does_not_know_is_warned_of_with_the_nearest_name(node_with, capfd):
    declare(node_with(first_roks=3), SimulatorParameters)
    assert "no parameter first_roks, so its value has no effect; did you mean first_rocks?" in (
        capfd.readouterr().err
    )
