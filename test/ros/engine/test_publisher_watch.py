"""A publisher that is never received, or one too many, is found; and so is a clock that stands still."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rclpy.qos import qos_profile_sensor_data

from rpf3d_ros.engine.clock_watch import ClockWatch
from rpf3d_ros.engine.publisher_watch import PublisherWatch, SeenPublisher, WatchedTopic, sentences_by_topic
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
    assert sentence.startswith("source_cloud: nothing of /lidar is received") and "Best effort publisher" in sentence


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
    """Each stays visible for 20 s after its end."""
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


def test_a_clock_stands_still_where_it_shows_the_same_time_for_too_long():
    watch = ClockWatch(3.0)
    assert not watch.stands(0, 0.0) and not watch.stands(0, 99.0), "it does not run yet"
    assert not watch.stands(5, 100.0) and not watch.stands(5, 103.0)
    assert watch.stands(5, 103.1)
    assert not watch.stands(6, 200.0) and not watch.stands(4, 204.0)
