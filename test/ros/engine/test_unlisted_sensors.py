"""Topics that look like sources of a sensor, but that the simulator does not receive."""

import pytest

from rpf3d_ros.engine.unlisted_sensors import UNLISTED, unlisted_findings, unlisted_topics
from rpf3d_ros.interface.parameters import SensorTopics
from rpf3d_ros.interface.recorded_topics import CLOUD, POSES

LISTED = SensorTopics(poses=("radar_north/sources",), clouds=("lidar/rocks",), expected=())
RECEIVED = ("/pit_a/radar_north/sources", "/pit_a/lidar/rocks", "/pit_a/areas/equipment")
EAST = "/pit_a/radar_east/sources"


def unlisted(*topics: tuple[str, str], namespace: str = "/pit_a") -> dict[str, str]:
    return unlisted_topics([(name, [kind]) for name, kind in topics], LISTED, RECEIVED, namespace)


def test_a_second_radar_that_is_not_listed_is_found_with_the_parameter_for_it() -> None:
    assert unlisted((EAST, POSES), ("/pit_a/radar_north/sources", POSES)) == {EAST: "source_topics"}
    assert unlisted(("/pit_a/other/rocks", CLOUD)) == {"/pit_a/other/rocks": "source_cloud_topics"}


@pytest.mark.parametrize(("name", "kind"), [("sources", POSES), ("source_cloud", CLOUD)])
def test_the_default_topics_are_found_if_they_are_not_listed(name: str, kind: str) -> None:
    assert list(unlisted((f"/pit_a/{name}", kind))) == [f"/pit_a/{name}"]
    assert list(unlisted((f"/{name}", kind), namespace="/")) == [f"/{name}"]


@pytest.mark.parametrize(("name", "kind"), [
    ("/pit_b/radar_east/sources", POSES), ("/pit_ab/sources", POSES), ("/pit_a/areas/equipment", POSES),
    ("/pit_a/lidar/points", CLOUD), ("/pit_a/radar_east/sources", CLOUD), ("/pit_a/radar/sources", "std_msgs/msg/Bool"),
    ("/pit_a/many_sources", POSES),
])  # fmt: skip
def test_other_namespaces_names_and_types_are_no_sensor(name: str, kind: str) -> None:
    assert unlisted((name, kind)) == {}


def test_a_topic_with_two_types_is_judged_by_each() -> None:
    found = unlisted_topics([(EAST, ["std_msgs/msg/Bool", POSES])], LISTED, RECEIVED, "/pit_a")
    assert found == {EAST: "source_topics"}


def test_the_warning_names_topic_publishers_and_parameter() -> None:
    (found,) = unlisted_findings(
        {EAST: "source_topics"}, {EAST: ["/b", "/a", "/b"]}, {EAST: ["rviz"]}, "rpf3d_simulator"
    )
    assert (found.topic, found.is_fault) == (UNLISTED, False)
    assert found.sentence == f"{EAST} of /a, /b is not received: if it is a sensor, add it to source_topics"


def test_a_topic_without_publisher_or_of_another_simulator_is_no_warning() -> None:
    unlisted = {EAST: "source_topics"}
    assert unlisted_findings(unlisted, {EAST: []}, {EAST: []}, "rpf3d_simulator") == []
    assert unlisted_findings(unlisted, {EAST: ["/a"]}, {EAST: ["rpf3d_simulator"]}, "rpf3d_simulator") == []
