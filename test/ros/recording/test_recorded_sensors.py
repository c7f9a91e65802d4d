"""Sensors with topics of their own are in the recording and in its bags, and replay into the nodes."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("rerun", reason="rerun-sdk is not installed")
pytest.importorskip("rosbags", reason="rosbags is not installed")

from geometry_msgs.msg import PoseArray
from messages import recorded_messages as made
from messages.live_peer import PATIENCE
from rosbags.rosbag2 import StoragePlugin, Writer
from sensor_msgs.msg import PointCloud2
from typer.testing import CliRunner

from rpf3d_core.cli import app
from rpf3d_core.errors import InputError
from rpf3d_core.recordings.content import rows_by_entity, verify
from rpf3d_ros.interface.qos import EVENTS
from rpf3d_ros.interface.recorded_topics import DEFAULT_SENSORS, TOPICS, RecordedSensors, topics_with
from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.nodes.play_bag import inputs_of
from rpf3d_ros.recording.bag_writer import BagWriter, typestore
from rpf3d_ros.recording.files import Head
from rpf3d_ros.recording.from_bag import convert, messages_of, sensors_of, topics_of, unread_of
from rpf3d_ros.recording.incident_bag import IncidentBag
from rpf3d_ros.recording.message_log import MessageLog

ROOT = Path(__file__).resolve().parents[3]
NODE = "rpf3d_recorder"
NORTH, SOUTH, LIDAR = "radar_north/sources", "radar_south/sources", "lidar/rocks"
SENSORS = RecordedSensors(poses=(NORTH, SOUTH), clouds=(LIDAR,))
ROWS = {f"/sources/{topic}": 1 for topic in (NORTH, SOUTH, LIDAR)}
"""Rows of a recording of one message of each sensor."""


def cloud(second):
    return cloud_of_columns(made.header(second), {name: np.full(2, 9.0) for name in "xyz"})


def messages(second=5):
    """Topic -> a message of each sensor."""
    return {
        NORTH: made.poses(second, (8.0, 2.0, 20.0)),
        SOUTH: made.poses(second, (30.0, 2.0, 20.0), (31.0, 2.0, 20.0)),
        LIDAR: cloud(second),
    }


def written(folder):
    """A bag with a message of each sensor, as the recorder writes it."""
    bag = BagWriter(folder, SENSORS)
    for topic, message in messages().items():
        bag.write(topic, f"/{topic}", 5, made.as_cdr(message))
    bag.close()
    return folder


def foreign(folder):
    """The same bag as another program writes it, without a note on the sensors."""
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, message in messages().items():
            kind = topics_with(SENSORS)[topic].kind
            writer.write(writer.add_connection(f"/{topic}", kind, typestore=typestore()), 5, made.as_cdr(message))
    return folder


def command(*arguments):
    done = CliRunner().invoke(app, ["from-bag", *map(str, arguments)])
    return done.exit_code, " ".join(done.output.split())


def test_topics_of_sensors_stand_in_place_of_the_default_topics():
    assert topics_with(DEFAULT_SENSORS) == TOPICS
    names = list(topics_with(SENSORS))
    assert names.index(NORTH) == list(TOPICS).index("sources") and names[names.index(NORTH) + 1] == SOUTH
    assert not {"sources", "source_cloud"} & set(names)
    assert {topics_with(SENSORS)[topic].kind.split("/")[-1] for topic in (NORTH, SOUTH)} == {"PoseArray"}
    assert topics_with(RecordedSensors(poses=(), clouds=("sources",)))["sources"].kind == TOPICS["source_cloud"].kind


@pytest.mark.parametrize(("sensors", "sentence"), [
    (RecordedSensors(poses=(NORTH, NORTH)), f"{NORTH} is given twice: see source_topics"),
    (RecordedSensors(poses=(NORTH,), clouds=(NORTH,)), "is given twice"),
    (RecordedSensors(poses=("areas/equipment",)), "areas/equipment is a topic of rpf3d that has no sources"),
])  # fmt: skip
def test_topics_that_cannot_be_those_of_sensors_are_refused(sensors, sentence):
    with pytest.raises(InputError, match=sentence):
        sensors.check()


def test_a_sensor_that_sees_nothing_does_not_hide_the_sources_of_another_not_even_in_the_next_file():
    log, head = MessageLog(MapFrame(), "map", lambda: 0, sensors=SENSORS), Head()
    for topic, message in {**messages(5), SOUTH: made.poses(6)}.items():
        head.note(log.entries(topic, message))
    assert [entry.keeps for entry in head.entries()] == [f"sources/{topic}" for topic in (NORTH, SOUTH, LIDAR)]


def test_the_recording_states_whose_sources_it_has():
    class About:
        def about(self, text):
            self.text = text

    (entry,) = MessageLog(MapFrame(), "map", lambda: 0, sensors=SENSORS).begin()
    entry.draw(about := About())
    assert f"Sources are recorded of these topics: `{NORTH}`, `{SOUTH}`, `{LIDAR}`, `clicked_point`." in about.text


@pytest.mark.parametrize("namespace", ["", "/mine"])
def test_a_bag_of_the_recorder_is_read_without_a_word_on_its_sensors(tmp_path, namespace):
    bags = IncidentBag(str(tmp_path / "incident"), SENSORS)
    bags.begin_with(tmp_path / "a.rrd")
    for topic, message in messages().items():
        bags.write(topic, f"{namespace}/{topic}", 5, made.as_cdr(message))
    bags.close()
    bag = tmp_path / "incident_a"
    assert sensors_of(bag) == SENSORS
    assert list(topics_of(bag, namespace)) == list(inputs_of(bag, namespace)) == [NORTH, SOUTH, LIDAR]
    assert [raw.topic for raw in messages_of(bag, namespace)] == [NORTH, SOUTH, LIDAR]
    done = convert(bag, tmp_path / "out.rrd", MapFrame(), "map", namespace)
    assert done.messages == dict.fromkeys((NORTH, SOUTH, LIDAR), 1) and not done.refused
    verify(tmp_path / "out.rrd")
    rows = rows_by_entity(tmp_path / "out.rrd")
    assert {entity: rows.get(entity) for entity in ROWS} == ROWS
    assert not unread_of(bag, namespace, SENSORS)


def test_the_options_name_the_sensors_of_another_bag(tmp_path):
    bag = foreign(tmp_path / "shift")
    code, said = command(
        bag, "--out", tmp_path / "out.rrd", "--source-topics", f"{NORTH}, {SOUTH}", "--source-cloud-topics", LIDAR,
    )  # fmt: skip
    assert code == 0 and f"3 messages ({NORTH} 1, {SOUTH} 1, {LIDAR} 1)" in said and "not read" not in said
    rows = rows_by_entity(tmp_path / "out.rrd")
    assert {entity: rows.get(entity) for entity in ROWS} == ROWS


def test_topics_that_may_be_those_of_sensors_and_are_not_read_are_reported_with_the_option(tmp_path):
    bag = foreign(tmp_path / "shift")
    code, said = command(bag, "--out", tmp_path / "out.rrd", "--source-topics", NORTH)
    assert code == 0
    for topic, option in ((SOUTH, "--source-topics"), (LIDAR, "--source-cloud-topics")):
        assert f"/{topic} is not read: if a sensor publishes sources on this topic, name it in {option}" in said
    assert f"/{NORTH} is not read" not in said


def test_a_bag_without_metadata_as_mcap_recover_writes_it_reports_the_sensors_that_it_does_not_name(tmp_path):
    file = next(written(tmp_path / "shift").glob("*.mcap"))
    assert sensors_of(file) == DEFAULT_SENSORS
    assert len(unread_of(file, "", DEFAULT_SENSORS)) == 3
    assert list(topics_of(file, "", sensors_of(file, f"{NORTH},{SOUTH}", LIDAR))) == [NORTH, SOUTH, LIDAR]


def test_terrain_and_answers_of_another_namespace_are_not_taken_for_sensors(tmp_path):
    made.write_bag(tmp_path / "two", made.shift(), namespace="/other/")
    assert unread_of(tmp_path / "two", "", DEFAULT_SENSORS) == [
        "/other/sources is not read: if a sensor publishes sources on this topic, name it in --source-topics",
        "/other/source_cloud is not read: if a sensor publishes sources on this topic, name it in "
        "--source-cloud-topics",
    ]


def test_an_option_with_a_topic_that_no_sensor_can_have_is_refused_and_leaves_no_file(tmp_path):
    given = [str(foreign(tmp_path / "a")), "--out", str(tmp_path / "out.rrd"), "--source-topics", "terrain/points"]
    with pytest.raises(InputError, match=r"^.{0,40}terrain/points is a topic of rpf3d"):
        CliRunner().invoke(app, ["from-bag", *given], catch_exceptions=False)
    assert not (tmp_path / "out.rrd").exists()


def sensor_peer(stage):
    """A peer that publishes as all sensors, and the terrain."""
    peer = stage.peer(publishes=("terrain/mesh",))
    for topic in (NORTH, SOUTH, LIDAR):
        kind = PointCloud2 if topic == LIDAR else PoseArray
        peer.publishers[topic] = peer.node.create_publisher(kind, topic, EVENTS)
    peer.wait_for_subscribers()
    return peer


@pytest.mark.long
def test_the_recorder_writes_the_sources_of_every_sensor_and_its_bag_replays_them(stage):
    named = {"source_topics": f"[{NORTH}, {SOUTH}]", "source_cloud_topics": f"[{LIDAR}]"}
    file = stage.folder / "live.rrd"
    stage.node("recorder_node", file=file, bag=stage.folder / "incident", **named)
    peer = sensor_peer(stage)
    for topic, message in {"terrain/mesh": made.mesh(), **messages()}.items():
        peer.send(topic, message)
        peer.wait(
            lambda t=topic: f"{NODE}: recording" in peer.health and peer.health[f"{NODE}: recording"].values.get(t),
            f"{topic} recorded",
        )
    assert stage.clear() == [0]
    verify(file)
    rows = rows_by_entity(file)
    assert {entity: rows.get(entity) for entity in ROWS} == ROWS and "/sources" not in rows
    bag = stage.folder / "incident_live"
    assert list(inputs_of(bag, "")) == ["terrain/mesh", NORTH, SOUTH, LIDAR]
    convert(bag, stage.folder / "again.rrd", MapFrame(), "map")
    again = rows_by_entity(stage.folder / "again.rrd")
    assert {entity: again.get(entity) for entity in ROWS} == ROWS


@pytest.mark.long
def test_the_sensors_of_a_bag_are_played_on_their_own_topics(stage):
    folder = written(stage.folder / "shift")
    peer = stage.peer()
    received = {topic: [] for topic in (NORTH, SOUTH, LIDAR)}
    for topic, kept in received.items():
        kind = PointCloud2 if topic == LIDAR else PoseArray
        peer.node.create_subscription(kind, topic, kept.append, EVENTS)
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    player = subprocess.Popen(
        [sys.executable, "-m", "rpf3d_ros.nodes.play_bag", str(folder)],
        env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        peer.wait(lambda: all(received.values()), "a message of every sensor")
        said, _ = player.communicate(timeout=PATIENCE)
    finally:
        player.kill()
    assert (player.returncode, said) == (0, f"played 1 of {NORTH}, 1 of {SOUTH}, 1 of {LIDAR}\n")
    assert received[SOUTH] == [messages()[SOUTH]]
