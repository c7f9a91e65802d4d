"""Tests that a bag converted without ROS gives the recording of the live recorder, and that nodes can replay it."""

import os
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("rerun", reason="rerun-sdk is not installed")
pytest.importorskip("rosbags", reason="rosbags is not installed")

from messages import recorded_messages as made
from messages.live_peer import PATIENCE
from rosbags.rosbag2 import StoragePlugin, Writer

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.content import rows_by_entity, verify
from rpf3d_ros.interface.recorded_topics import EVENT, TOPICS
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.nodes.play_bag import inputs_of, with_times
from rpf3d_ros.recording.bag_writer import BagWriter, typestore
from rpf3d_ros.recording.from_bag import Raw, convert, messages_of, topics_of
from rpf3d_ros.recording.incident_bag import IncidentBag
from rpf3d_ros.recording.thinning import WHOLE, Thinning

ROOT = Path(__file__).resolve().parents[3]
NODE = "rpf3d_recorder"
NO_ROS = """
import sys
for name in ("rclpy", "builtin_interfaces", "std_msgs", "sensor_msgs", "geometry_msgs", "nav_msgs", "shape_msgs",
             "visualization_msgs", "diagnostic_msgs", "rcl_interfaces", "rosgraph_msgs"):
    sys.modules[name] = None
from rpf3d_core.cli import main
sys.argv = ["rpf3d", *sys.argv[1:]]
main()
"""


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bags") / "shift"
    made.write_bag(folder, made.shift())
    return folder


def without_ros(*arguments):
    """Run the command line in a process that cannot import ROS; return the completed process."""
    return subprocess.run(
        [sys.executable, "-c", NO_ROS, *map(str, arguments)],
        capture_output=True, text=True, check=False, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def test_a_bag_becomes_a_recording_where_there_is_no_ros(bag, tmp_path):
    done = without_ros("from-bag", bag, "--out", tmp_path / "shift.rrd")
    assert done.returncode == 0, done.stderr
    verify(tmp_path / "shift.rrd")
    rows = rows_by_entity(tmp_path / "shift.rrd")
    assert (rows["/terrain"], rows["/sources"], rows["/impacts"], rows["/trajectories"]) == (2, 6, 2, 2)
    assert rows["/trajectories/rocks"] == 1 + 2 * 41, "frames of four seconds each, and the style"


def test_a_bag_that_is_none_is_refused_in_a_sentence_with_exit_code_2(tmp_path):
    (tmp_path / "bad.mcap").write_bytes(b"\x89MCAP0\r\n and no more")
    made.write_bag(tmp_path / "whole", made.shift())
    whole = next((tmp_path / "whole").glob("*.mcap")).read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "other.mcap").write_bytes(b"no bag at all")
    told = {"nowhere": "no such bag", "bad.mcap": "mcap recover", "cut.mcap": "mcap recover", "other.mcap": "be read"}
    for name, sentence in told.items():
        done = without_ros("from-bag", tmp_path / name, "--out", tmp_path / "out.rrd")
        assert done.returncode == 2
        assert sentence in " ".join(done.stderr.split())
        assert "Traceback" not in done.stderr
    assert not (tmp_path / "out.rrd").exists()


def test_a_bag_that_a_kill_cut_off_is_told_from_others_as_a_folder_too(tmp_path):
    made.write_bag(tmp_path / "shift", made.shift())
    file = next((tmp_path / "shift").glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-20])
    (tmp_path / "shift" / "metadata.yaml").unlink()
    with pytest.raises(InputError, match="the file is incomplete"):
        topics_of(tmp_path / "shift")


def test_a_bag_whose_topics_are_in_another_namespace_is_refused_and_leaves_no_file(tmp_path):
    sources = [(5, "sources", made.poses(5, (1.0, 2.0, 3.0)))]
    made.write_bag(tmp_path / "mine", sources, namespace="/mine/")
    with pytest.raises(InputError, match="namespace"):
        inputs_of(tmp_path / "mine", "/yours")
    with pytest.raises(InputError, match="namespace"):
        convert(tmp_path / "mine", tmp_path / "out.rrd", MapFrame(), "map")
    assert not (tmp_path / "out.rrd").exists()
    assert convert(tmp_path / "mine", tmp_path / "out.rrd", MapFrame(), "map", "mine").messages == {"sources": 1}


def test_a_sqlite_bag_is_read_too(tmp_path):
    types = typestore()
    with Writer(tmp_path / "old", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/sources", TOPICS["sources"].kind, typestore=types)
        writer.write(connection, 5, made.as_cdr(made.poses(5, (1.0, 2.0, 3.0))))
    assert [raw.topic for raw in messages_of(tmp_path / "old")] == ["sources"]


@pytest.mark.parametrize("thinning", [WHOLE, Thinning(rocks=3, maps_every=0.0)])
def test_damaged_messages_of_a_bag_are_refused_one_by_one(tmp_path, thinning):
    rng = np.random.default_rng(6)
    bag, tried = BagWriter(tmp_path / "damaged"), 0
    for stamp_ns, topic, message in made.shift():
        whole = np.frombuffer(made.as_cdr(message), dtype=np.uint8)
        for _ in range(12):
            data = whole[: rng.integers(4, len(whole) + 1)].copy() if rng.random() < 0.3 else whole.copy()
            data[rng.integers(4, len(data), 3) if len(data) > 4 else []] = rng.integers(0, 256)
            bag.write(topic, topic if topic.startswith("/") else f"/{topic}", stamp_ns, data.tobytes())
            tried += 1
    bag.close()
    done = convert(tmp_path / "damaged", tmp_path / "out.rrd", MapFrame(), "map", thinning=thinning)
    assert sum(done.messages.values()) + len(done.refused) == tried
    assert len(done.refused) > tried // 20, "damage must reach the readers and be noticed there"
    verify(tmp_path / "out.rrd")


def listens(peer, topics):
    for topic in topics:
        peer.wait(lambda t=topic: peer.publishers[t].get_subscription_count(), f"a subscriber of {topic}")


@pytest.mark.long
def test_the_live_recorder_and_its_own_bag_give_the_same_recording(stage):
    file = stage.folder / "live.rrd"
    stage.node("recorder_node", file=file, bag=stage.folder / "incident")
    messages = [item for item in made.shift() if item[1] != "/diagnostics"]
    sent = {topic for _, topic, _ in messages}
    peer = stage.peer(publishes=sorted(sent))
    listens(peer, sent)
    counts = Counter()
    for _, topic, message in messages:
        peer.send(topic, message)
        counts[topic] += 1
        peer.wait(
            lambda t=topic: int(peer.health[f"{NODE}: recording"].values.get(t, 0)) >= counts[t]
            if f"{NODE}: recording" in peer.health else False,
            f"{counts[topic]} of {topic} recorded",
        )  # fmt: skip
    assert stage.clear() == [0]
    done = convert(stage.folder / "incident_live", stage.folder / "again.rrd", MapFrame(), "map", thinning=Thinning())
    live, again = rows_by_entity(file), rows_by_entity(stage.folder / "again.rrd")
    assert not done.refused
    same = set(live) - {"/diagnostics"}
    assert {entity: again.get(entity) for entity in same} == {entity: live[entity] for entity in same}


def test_every_bag_begins_with_the_ground_so_that_it_replays_by_itself(tmp_path):
    bags = IncidentBag(str(tmp_path / "incident"))
    bags.begin_with(tmp_path / "a.rrd")
    for topic, message in {"terrain/mesh": made.mesh(), **made.inputs(3)}.items():
        bags.write(topic, topic if topic.startswith("/") else f"/{topic}", 3, made.as_cdr(message))
    bags.begin_with(tmp_path / "b.rrd")
    bags.write("sources", "/sources", 9, made.as_cdr(made.poses(9, (8.0, 2.0, 20.0))))
    bags.close()
    again = [(raw.topic, raw.stamp_ns) for raw in messages_of(tmp_path / "incident_b")]
    assert again == [("terrain/mesh", 9), ("terrain/update", 9), ("sources", 9)]


def test_a_bag_that_cannot_be_completed_does_not_prevent_the_next_bag(tmp_path, monkeypatch):
    bags = IncidentBag(str(tmp_path / "incident"))
    bags.begin_with(tmp_path / "a.rrd")

    def full(*_):
        raise OSError("No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(bags._writer, "close", full)
        bags.begin_with(tmp_path / "b.rrd")
    assert "incident_a" in bags.fault and "No space" in bags.fault
    bags.write("sources", "/sources", 9, made.as_cdr(made.poses(9, (8.0, 2.0, 20.0))))
    bags.close()
    assert [raw.topic for raw in messages_of(tmp_path / "incident_b")] == ["sources"]


def test_a_bag_keeps_the_last_patches_also_if_no_survey_came_before_them(tmp_path, monkeypatch):
    monkeypatch.setattr("rpf3d_ros.recording.incident_bag.PATCHES_KEPT", 2)
    bags = IncidentBag(str(tmp_path / "incident"))
    bags.begin_with(tmp_path / "a.rrd")
    inputs = made.inputs(3)
    for stamp in (3, 4, 5):
        bags.write("terrain/update", "/terrain/update", stamp, made.as_cdr(inputs["terrain/update"]))
    bags.begin_with(tmp_path / "b.rrd")
    bags.write("sources", "/sources", 9, made.as_cdr(inputs["sources"]))
    bags.close()
    assert [raw.topic for raw in messages_of(tmp_path / "incident_b")] == ["terrain/update"] * 2 + ["sources"]


@pytest.mark.long
def test_a_bag_replays_into_the_simulator(stage):
    folder = stage.folder / "shift"
    wanted = {"terrain/mesh", "sources"}
    made.write_bag(folder, ((ns, topic, message) for ns, topic, message in made.shift() if topic in wanted))
    stage.node("simulator_node", terrain_durability="transient_local")
    peer = stage.peer(subscribes=("hazard/zones",))
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    player = subprocess.Popen(
        [sys.executable, "-m", "rpf3d_ros.nodes.play_bag", str(folder), "--rate", "20", "--clock"],
        env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        last = max(ns // made.SECOND for ns, topic, _ in made.shift() if topic == "sources")
        peer.wait(
            lambda: any(array.markers[0].header.stamp.sec == last for array in peer.received["hazard/zones"]),
            "an answer to the last sources of the bag",
        )
        said, _ = player.communicate(timeout=PATIENCE)
        assert player.returncode == 0
        assert said == "played 2 of terrain/mesh, 2 of sources\n"
    finally:
        player.kill()


def test_what_was_received_before_the_clock_began_is_played_first_and_at_once():
    stamps = [0, 0, 70, 90]
    messages, begin = with_times(iter([Raw("sources", "/sources", stamp, b"") for stamp in stamps]))
    assert [raw.stamp_ns for raw in messages] == stamps and begin == 70


@pytest.mark.long
def test_a_player_without_a_subscriber_gives_up_and_one_that_is_stopped_ends(bag, stage):
    command = [sys.executable, "-m", "rpf3d_ros.nodes.play_bag", str(bag)]
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    environment = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run([*command, "--patience", "0.2"], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "fewer than 1 subscribers of terrain/mesh, " in done.stderr
    assert "check that the simulator runs" in done.stderr
    waiting = subprocess.Popen([*command, "--patience", "100"], env=environment, stderr=subprocess.PIPE, text=True)
    peer = stage.peer()
    peer.wait(lambda: peer.node.count_publishers("sources") or waiting.poll() is not None, "the player to wait")
    with pytest.raises(subprocess.TimeoutExpired):
        waiting.wait(4.0)
    waiting.send_signal(signal.SIGINT)
    assert waiting.wait(PATIENCE) == 130


def test_events_are_those_topics_that_are_not_latched():
    events = {name for name, topic in TOPICS.items() if topic.offered == EVENT}
    assert events >= {"sources", "/diagnostics"} and not events & {"alerts", "alarm", "results"}
