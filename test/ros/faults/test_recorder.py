"""Tests of the process rpf3d_recorder under faults: killed, disk full, no viewer, invalid messages."""

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("rerun", reason="rerun-sdk is not installed")

from messages import recorded_messages as made
from messages.live_peer import PATIENCE
from programs.ports import free_port

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.content import content_of, repair, rows_by_entity, verify
from rpf3d_ros.interface.health_report import PERIOD
from rpf3d_ros.messages.health import ERROR, OK, WARN
from rpf3d_ros.recording.files import numbered_files

NODE = "rpf3d_recorder"
LONGEST_WAIT = 0.9
"""Longest additional time (s) until a message is in the file while a viewer hangs; the feed waits 2 s for a viewer."""

LONGEST_END = 5.0
"""Longest time (s) that the recorder takes to end while a viewer hangs."""

TIMES = 4.0
"""On a slow machine: longest time until the recorder ends, over the usual time of one message."""


STYLE = 1
"""Number of rows with the style of a series or a lane."""


def recorded(peer, topic, count):
    """Wait until the recorder has recorded at least `count` messages of a topic; return the time (s) of the wait."""
    began = time.monotonic()
    peer.wait(
        lambda: (health := peer.health.get(f"{NODE}: recording")) and int(health.values.get(topic, 0)) >= count,
        f"{count} of {topic} recorded",
    )
    return time.monotonic() - began


def impacts(second):
    """Return a message of impacts that differs from second to second, because equal messages are recorded once."""
    return made.answers(second, float(second))["impacts"]


@pytest.mark.long
def test_after_a_kill_everything_up_to_the_last_event_is_saved(stage):
    file = stage.folder / "live.rrd"
    process = stage.node("recorder_node", file=file)
    peer = stage.peer(publishes=("terrain/mesh", "sources", "impacts", "alerts"))
    peer.wait_for_subscribers()
    peer.send("terrain/mesh", made.mesh())
    for second in range(1, 6):
        peer.send("sources", made.poses(second, (8.0, 2.0, 20.0)))
        peer.send("impacts", impacts(second))
        peer.send("alerts", made.alerts(second, "watch"))
        recorded(peer, "alerts", second)
    for topic in ("impacts", "sources"):  # the topics may arrive in any order
        recorded(peer, topic, 5)
    process.send_signal(signal.SIGKILL)
    process.wait()
    with pytest.raises(InputError, match="refuses it"):
        verify(file)
    saved = stage.folder / "saved.rrd"
    content = repair(file, saved)
    verify(saved)
    assert {e: content.rows[e] for e in ("/terrain", "/sources", "/impacts", "/alert_level")} == {
        "/terrain": 1, "/sources": 5, "/impacts": 5, "/alert_level": 5 + STYLE,
    }  # fmt: skip
    assert content == content_of(saved)
    assert not rows_by_entity(file).keys() - content.rows.keys(), "the broken file is left as it is"


@pytest.mark.long
@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="the room of a process can be limited on Linux only")
def test_without_room_the_node_says_so_lives_on_and_begins_a_new_file_when_there_is_room_again(stage):
    file = stage.folder / "live.rrd"
    process = stage.node("recorder_node", file=file)
    peer = stage.peer(publishes=("terrain/mesh", "impacts", "alerts"))
    peer.wait_for_subscribers()
    peer.send("terrain/mesh", made.mesh())
    recorded(peer, "terrain/mesh", 1)
    unlimited = resource.RLIM_INFINITY
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (file.stat().st_size + 100, unlimited))
    peer.send("impacts", impacts(1))
    assert peer.wait_for_health(f"{NODE}: file", "could not be written").level == ERROR
    for second in range(2, 5):
        peer.send("alerts", made.alerts(second, "evacuate"))
    for _ in range(3):  # so the recorder receives the impacts before the disk has room again
        seen = peer.wait_for_health(f"{NODE}: recording", "could not be written")
        peer.wait(lambda seen=seen: peer.health[f"{NODE}: recording"] is not seen, "a repetition of the diagnostics")
    assert process.poll() is None
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (unlimited, unlimited))
    assert peer.wait_for_health(f"{NODE}: file", "written again").level == WARN
    peer.send("impacts", impacts(6))
    recorded(peer, "impacts", 1)
    assert stage.clear() == [0]
    (after,) = numbered_files(file)
    verify(after)
    rows = rows_by_entity(after)
    # The impacts that could not be written are the state with which the new file begins.
    assert (rows["/terrain"], rows["/impacts"], rows["/alert_state/site"]) == (1, 2, 1 + STYLE)
    assert repair(file, stage.folder / "saved.rrd").rows["/terrain"] == 1


def viewer(port):
    command = [sys.executable, "-m", "rerun", "--serve-grpc", "--bind", "127.0.0.1", "--port", str(port)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_viewer_that_dies_or_hangs_delays_no_message_and_no_end(stage, number):
    port, file = free_port(), stage.folder / "live.rrd"
    program = viewer(port)
    try:
        process = stage.node("recorder_node", file=file, viewer=f"rerun+http://127.0.0.1:{port}/proxy")
        peer = stage.peer(publishes=("impacts",))
        peer.wait_for_subscribers()
        peer.wait_for_health(f"{NODE}: viewer", "fed")
        usual = PERIOD  # until the recorder's next report, which says that the message is recorded
        for second in range(1, 4):
            peer.send("impacts", impacts(second))
            usual = max(usual, recorded(peer, "impacts", second))
        os.killpg(program.pid, number)
        for second in range(4, 10):
            peer.send("impacts", impacts(second))
            assert recorded(peer, "impacts", second) < usual + LONGEST_WAIT
        if number == signal.SIGKILL:
            assert peer.wait_for_health(f"{NODE}: viewer", "no viewer receives").level == WARN
        began = time.monotonic()
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE) == 0
        assert time.monotonic() - began < max(LONGEST_END, TIMES * usual)
    finally:
        os.killpg(program.pid, signal.SIGKILL)
        program.wait()
    verify(file)
    assert rows_by_entity(file)["/impacts"] == 9


@pytest.mark.long
def test_a_viewer_that_is_absent_is_told_of_and_found_when_it_comes(stage):
    port, file = free_port(), stage.folder / "live.rrd"
    stage.node("recorder_node", file=file, viewer=f"rerun+http://127.0.0.1:{port}/proxy")
    peer = stage.peer(publishes=("impacts",))
    peer.wait_for_subscribers()
    peer.send("impacts", impacts(1))
    assert recorded(peer, "impacts", 1) < 5.0
    assert peer.wait_for_health(f"{NODE}: viewer", "no viewer receives").level == WARN
    program = viewer(port)
    try:
        peer.wait_for_health(f"{NODE}: viewer", "fed")
        assert peer.wait(
            lambda: (health := peer.health[f"{NODE}: viewer"]).level == OK and health, "the viewer to be fed"
        )
    finally:
        os.killpg(program.pid, signal.SIGKILL)
        program.wait()


def test_the_server_for_viewers_listens_on_loopback_only(stage):
    port = free_port()
    stage.node("recorder_node", file=stage.folder / "live.rrd", viewer="serve", viewer_port=port)
    peer = stage.peer()
    peer.wait_for_health(f"{NODE}: viewer", "fed")
    listening = {
        line.split()[1]
        for table in ("/proc/net/tcp", "/proc/net/tcp6")
        for line in Path(table).read_text().splitlines()[1:]
        if line.split()[3] == "0A" and line.split()[1].endswith(f":{port:04X}")
    }
    assert listening == {f"0100007F:{port:04X}"}


def test_a_viewer_that_is_none_is_refused_with_a_sentence(stage):
    process = stage.node("recorder_node", file=stage.folder / "live.rrd", viewer="browser")
    assert process.wait(PATIENCE) == 2
    assert "viewer is 'browser'" in stage.output("recorder_node")


@pytest.mark.long
def test_bytes_that_are_no_message_are_refused_with_a_diagnostic(stage):
    topics = ("impacts", "trajectories", "alerts", "hazard/grid", "sources", "alarm", "areas/polygon")
    process = stage.node("recorder_node", file=stage.folder / "live.rrd")
    peer = stage.peer(publishes=topics)
    peer.wait_for_subscribers()
    for topic in topics:
        peer.send(topic, bytes((0, 1, 0, 0)) + b"\xff" * 40 if topic != "alarm" else bytes((0, 1, 0, 0)))
        peer.wait_for_health(f"{NODE}: {topic}", "refused")
    assert process.poll() is None
