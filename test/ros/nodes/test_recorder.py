"""Tests of rpf3d_recorder without ROS: a file that cannot be written, and subscriptions."""

from collections import Counter

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from diagnostic_msgs.msg import DiagnosticArray
from messages import recorded_messages as made

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.parameters import RecorderParameters
from rpf3d_ros.interface.qos import recorded_qos
from rpf3d_ros.interface.recorded_topics import RESULT, TOPICS, topic_called
from rpf3d_ros.messages.health import ERROR, OK, WARN
from rpf3d_ros.nodes.recorder import FILE, RECORDING, RecorderNode, _opened
from rpf3d_ros.recording.alert_entries import COUNT_OF_RECORDED
from rpf3d_ros.recording.incident_bag import IncidentBag
from rpf3d_ros.recording.message_log import Reading


class Stub(RecorderNode):
    """A recorder without ROS whose file cannot be written while `fault` is set."""

    def __init__(self, fault=None):
        self.recorded, self.health, self.feed, self.log = Counter(), self, None, self
        self.files, self.path, self.lost = self, "live.rrd", 0
        self.fault, self.states, self.unreadable = fault, {}, None

    def set(self, part, level, message, values=None):
        self.states[part] = (level, message)

    def received(self, topic, read):
        yield Reading(topic, self.entries)

    def due(self):
        yield Reading("hazard/zones", self.entries)

    def check(self):
        pass

    def entries(self):
        if self.unreadable:
            raise self.unreadable
        return []

    def write(self, entries):
        if self.fault:
            raise self.fault


@pytest.mark.parametrize("error", [OSError("no room"), TimeoutError("no room"), RuntimeError("no room")])
@pytest.mark.parametrize("topic", ["impacts", "/diagnostics"])
def test_a_file_that_cannot_be_written_is_a_diagnostic_and_the_node_lives_on(error, topic):
    node = Stub(error)
    node._take(topic, None)
    assert node.states[FILE] == (ERROR, "live.rrd could not be written: no room")
    assert node.states[RECORDING][0] == ERROR
    node.fault = None
    node._take("impacts", None)
    assert node.states[RECORDING][0] == OK
    assert node.recorded == {"impacts": 1}


def test_rows_that_were_lost_are_told_after_the_fault():
    node = Stub()
    node.lost = 3
    node._take("impacts", None)
    assert node.states[FILE] == (WARN, "the file is written again; entries lost before: 3")


@pytest.mark.parametrize(("error", "level"), [(InputError("bad"), WARN), (ZeroDivisionError("bad"), ERROR)])
def test_a_message_that_cannot_be_taken_apart_is_refused_and_the_node_lives_on(error, level):
    node = Stub()
    node.unreadable = error
    node._take("impacts", None)
    assert node.states["impacts"][0] == level
    assert "refused" in node.states["impacts"][1]
    assert not node.recorded


def test_a_map_that_has_waited_and_is_refused_is_reported_under_its_own_topic(monkeypatch):
    node = Stub()
    monkeypatch.setattr(Stub, "_now_ns", lambda self: 1)
    node.bag, node.unreadable = IncidentBag(""), InputError("bad")
    node._look_after()
    assert node.states["hazard/zones"] == (WARN, "message refused: bad")
    assert node.states[RECORDING][0] == OK


def test_diagnostics_are_recorded_as_all_else_and_not_counted():
    node = Stub()
    node._take("/diagnostics", DiagnosticArray)
    assert not node.recorded and not node.states
    assert COUNT_OF_RECORDED.endswith(RECORDING)


def test_results_of_several_runs_may_wait_for_the_recorder():
    results = [topic for topic in TOPICS.values() if topic.offered == RESULT]
    assert len(results) == 10
    assert all(recorded_qos(topic.offered, "volatile").depth >= 10 for topic in results)


def test_a_topic_is_known_by_its_full_name_with_or_without_a_namespace():
    assert [topic_called(name) for name in ("/terrain/mesh", "terrain/mesh", "/mine/terrain/mesh")] == [
        "terrain/mesh", "terrain/mesh", None,
    ]  # fmt: skip
    assert topic_called("/mine/terrain/mesh", "mine") == "terrain/mesh"
    assert topic_called("/mine/clicked_point", "/mine/") == "clicked_point"
    assert topic_called("/diagnostics", "/mine/") == "/diagnostics"


def test_a_recording_that_cannot_be_created_is_refused_in_a_sentence(tmp_path):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    with pytest.raises(InputError, match="cannot be written"):
        _opened(RecorderParameters(file=str(tmp_path)), IncidentBag(""))


def test_the_messages_of_the_tests_cover_every_topic_but_the_grid_of_heights():
    assert {topic for _, topic, _ in made.shift()} == set(TOPICS) - {"terrain/points"}
