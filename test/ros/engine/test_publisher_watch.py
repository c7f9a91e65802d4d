"""Tests that mute publishers, too many publishers of a topic, and a clock that stands still are found."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rclpy.qos import qos_profile_sensor_data

from rpf3d_ros.engine.clock_watch import ClockWatch
from rpf3d_ros.engine.publisher_watch import (
    MUTE_AREA,
    MUTE_SENSOR,
    MuteTopics,
    PublisherWatch,
    SeenPublisher,
    WatchedTopic,
    sentences_by_topic,
)
from rpf3d_ros.interface.qos import EVENTS, LATCHED
from rpf3d_ros.interface.recorded_topics import CLOUD, POSES

OVERLAP = 25.0
TOPICS = (
    WatchedTopic("sources", POSES, EVENTS, group="sources"),
    WatchedTopic("source_cloud", CLOUD, EVENTS, group="sources"),
    WatchedTopic("terrain/points", CLOUD, LATCHED, group="terrain"),
    WatchedTopic("terrain/update", CLOUD, EVENTS, is_single=False),
    WatchedTopic("alarm", "std_msgs/msg/Bool", None),
)
RADAR = SeenPublisher("/radar", POSES, EVENTS)
SURVEY = SeenPublisher("/survey", CLOUD, LATCHED)
OURS = SeenPublisher("/rpf3d_simulator", "std_msgs/msg/Bool", LATCHED)
ALL_IS_WELL = {"sources": [RADAR], "terrain/points": [SURVEY], "alarm": [OURS]}


@pytest.fixture
def watch():
    return PublisherWatch(TOPICS, OVERLAP)


def faults(watch, at=0.0, **seen):
    seen = {name.replace("__", "/"): publishers for name, publishers in seen.items()}
    found = watch.findings({**ALL_IS_WELL, **seen}, at)
    return [each.sentence for each in found if each.is_fault]


def test_one_publisher_of_each_is_well(watch):
    assert watch.findings(ALL_IS_WELL, 0.0) == []


def test_a_best_effort_publisher_is_a_fault_at_once(watch):
    (sentence,) = faults(watch, source_cloud=[SeenPublisher("/lidar", CLOUD, qos_profile_sensor_data)])
    assert sentence.startswith("source_cloud: messages from /lidar cannot be received")
    assert "Best effort publisher" in sentence


def test_a_volatile_publisher_of_latched_terrain_and_a_wrong_type_are_faults(watch):
    (sentence,) = faults(watch, terrain__points=[SeenPublisher("/drone", CLOUD, EVENTS)])
    assert "Volatile publisher and transient local subscription" in sentence
    (sentence,) = faults(watch, sources=[RADAR, SeenPublisher("/lidar", CLOUD, EVENTS)])
    assert sentence.endswith(f"it publishes {CLOUD}; the type must be {POSES}")


@pytest.mark.parametrize(("topic", "one"), [("sources", RADAR), ("terrain__points", SURVEY), ("alarm", OURS)])
def test_two_publishers_are_a_warning_and_after_a_while_a_fault_that_names_both(watch, topic, one):
    two = {topic: [one, one._replace(node="/other")]}
    name = topic.replace("__", "/")
    assert faults(watch, 0.0, **two) == []
    assert [each.topic for each in watch.findings({**ALL_IS_WELL, name: two[topic]}, 1.0)] == [name]
    assert faults(watch, OVERLAP - 0.1, **two) == []
    (sentence,) = faults(watch, OVERLAP, **two)
    assert "/other" in sentence and one.node in sentence
    assert faults(watch, OVERLAP + 1.0) == []
    assert faults(watch, OVERLAP + 2.0, **two) == [], "that is another second one"


def test_a_simulator_that_is_killed_again_and_again_is_no_second_one(watch):
    """ROS still lists each killed process as a publisher for 20 s after its end."""
    starts = [(3.0 + 15.0 * n, 38.0 + 15.0 * n) for n in range(6)]
    for at in map(float, range(90)):
        visible = [OURS._replace(identity=n) for n, (begin, end) in enumerate(starts) if begin <= at < end]
        assert faults(watch, at, alarm=visible) == [], at


def test_several_scanners_may_send_patches(watch):
    scanners = [SeenPublisher(f"/scanner_{n}", CLOUD, EVENTS) for n in range(3)]
    assert watch.findings({**ALL_IS_WELL, "terrain/update": scanners}, 0.0) == []
    assert faults(watch, 9 * OVERLAP, terrain__update=scanners) == []


def test_no_publisher_of_sources_or_of_terrain_is_a_warning_and_one_of_either_topic_is_enough(watch):
    lacking = watch.findings({"alarm": [OURS]}, 0.0)
    assert [(each.topic, each.is_fault) for each in lacking] == [("sources", False), ("terrain", False)]
    assert "no publisher of sources: sources, source_cloud" in lacking[0].sentence
    lidar = SeenPublisher("/lidar", CLOUD, EVENTS)
    assert watch.findings({**ALL_IS_WELL, "sources": [], "source_cloud": [lidar]}, 0.0) == []


def test_each_topic_has_its_faults_in_one_sentence_and_none_where_all_is_well(watch):
    bad = SeenPublisher("/lidar", POSES, qos_profile_sensor_data)
    found = watch.findings({**ALL_IS_WELL, "sources": [bad, bad._replace(node="/radar_2")]}, 0.0)
    told = sentences_by_topic(found, [topic.name for topic in TOPICS])
    assert "/lidar" in told["sources"] and "/radar_2" in told["sources"] and told["alarm"] == ""


LONGEST = 30.0


@pytest.fixture
def sensors():
    return MuteTopics(TOPICS[:2], LONGEST, MUTE_SENSOR)


def mute(sensors, at, *publishers, topic="sources"):
    return [each.sentence for each in sensors.findings({topic: publishers}, at)]


def test_a_sensor_that_is_connected_and_mute_is_a_fault_after_the_age_of_sources(sensors):
    assert mute(sensors, 100.0, RADAR) == mute(sensors, 100.0 + LONGEST, RADAR) == []
    (sentence,) = mute(sensors, 100.1 + LONGEST, RADAR)
    assert sentence.startswith("sources has had a publisher (/radar) for more than 30 s, but no valid message")
    assert mute(sensors, 100.2 + LONGEST, RADAR) == [sentence], "a changed sentence would be a decision each second"
    sensors.understood("source_cloud")
    assert mute(sensors, 200.0, RADAR)
    sensors.understood("sources")
    assert mute(sensors, 300.0, RADAR) == []


def test_a_sensor_that_publishes_within_the_age_is_no_fault(sensors):
    for at in (0.0, 1.0, 29.0):
        assert mute(sensors, at, RADAR) == []
    sensors.understood("sources")
    assert mute(sensors, 31.0, RADAR) == mute(sensors, 1e6, RADAR) == []


def test_a_topic_without_publisher_is_no_mute_sensor_and_neither_is_one_that_came_and_went(sensors):
    assert mute(sensors, 0.0) == mute(sensors, 1000.0) == []
    assert mute(sensors, 1001.0, RADAR) == []
    assert [mute(sensors, 1001.0 + at) for at in (10.0, 31.0, 32.0, 200.0)] == [[]] * 4
    assert mute(sensors, 2000.0, RADAR) == mute(sensors, 2030.0, RADAR) == [], "the time counts anew"


def test_a_sensor_that_crashes_again_and_again_before_it_speaks_is_a_fault_also_while_it_is_gone(sensors):
    found = [
        mute(sensors, float(at), *((RADAR._replace(identity=at // 20),) if at % 20 < 9 else ())) for at in range(60)
    ]
    assert not any(found[:40]) and all(found[41:])
    assert "(which has ended)" in found[55][0]
    assert mute(sensors, 59.0 + LONGEST) == []


def test_a_publisher_that_cannot_be_received_is_no_second_fault(sensors):
    deaf = SeenPublisher("/lidar", CLOUD, qos_profile_sensor_data)
    assert [mute(sensors, at, deaf, topic="source_cloud") for at in (0.0, 100.0)] == [[], []]


def test_of_two_publishers_of_a_topic_one_that_is_heard_hides_the_mute_one(sensors):
    """Messages do not name their sender; two publishers on one topic are a separate fault."""
    two = (RADAR, RADAR._replace(node="/other"))
    sensors.understood("sources")
    assert [mute(sensors, at, *two) for at in (0.0, 100.0)] == [[], []]


def test_without_an_age_of_sources_no_sensor_is_mute():
    sensors = MuteTopics(TOPICS[:2], float("inf"), MUTE_SENSOR)
    assert [mute(sensors, at, RADAR) for at in (0.0, 1e9)] == [[], []]


def test_the_fault_of_a_mute_topic_of_areas_says_what_to_publish():
    areas = MuteTopics([WatchedTopic("areas/equipment", POSES, EVENTS)], LONGEST, MUTE_AREA)
    dispatch = SeenPublisher("/dispatch", POSES, LATCHED)
    assert mute(areas, 0.0, dispatch, topic="areas/equipment") == []
    (sentence,) = mute(areas, 31.0, dispatch, topic="areas/equipment")
    assert sentence.startswith("areas/equipment has had a publisher (/dispatch) for more than 30 s, but no valid")
    assert "publish the area again" in sentence and "an empty message if there is no area" in sentence


def test_a_clock_stands_still_where_it_shows_the_same_time_for_too_long():
    watch = ClockWatch(3.0)
    assert not watch.stands(0, 0.0) and not watch.stands(0, 99.0), "it does not run yet"
    assert not watch.stands(5, 100.0) and not watch.stands(5, 103.0)
    assert watch.stands(5, 103.1)
    assert not watch.stands(6, 200.0) and not watch.stands(4, 204.0)
