"""What rpf3d_recorder does where its file cannot be written, and how it listens."""

from collections import Counter

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from diagnostic_msgs.msg import DiagnosticArray

from rpf3d_core.errors import InputError
from rpf3d_ros import recorder
from rpf3d_ros.health import ERROR, OK
from rpf3d_ros.message_log import COUNT_OF_RECORDED
from rpf3d_ros.qos import LATCHED
from rpf3d_ros.recorder import RECORDING, RecorderNode
from rpf3d_ros.recording import Recording


class Stub(RecorderNode):
    """A recorder without ROS, whose file takes nothing while `full`."""

    def __init__(self):
        self.file, self.recorded, self.health, self.recording = "live.rrd", Counter(), self, self
        self.full, self.states = True, {}

    def set(self, part, level, message, values=None):
        self.states[part] = (level, message)

    def flush(self):
        if self.full:
            raise self.full

    def listen(self):
        self.heard = {}
        self._listen = lambda kind, topic, log, qos, raw=False: self.heard.update({topic: (log, qos)})


@pytest.mark.parametrize(
    "error", [OSError("no space left"), TimeoutError("no space left"), RuntimeError("no space left")]
)
@pytest.mark.parametrize("topic", ["impacts", "/diagnostics"])
def test_a_file_that_cannot_be_written_is_a_diagnostic_and_the_node_lives_on(error, topic):
    node = Stub()
    node.full = error
    node._record(topic, lambda message: None, None)
    assert node.states == {topic: (ERROR, "live.rrd could not be written: no space left")}
    node.full = None
    node._record("impacts", lambda message: None, None)
    assert node.states[RECORDING][0] == OK
    assert node.recorded == {"impacts": 1}


def test_diagnostics_are_recorded_as_all_else_and_not_counted():
    node = Stub()
    node.full = None
    node._record("/diagnostics", lambda message: None, DiagnosticArray())
    assert not node.recorded and not node.states
    assert COUNT_OF_RECORDED.endswith(RECORDING)


def test_results_of_several_runs_may_wait_for_the_recorder():
    class Log:
        def __getattr__(self, name):
            return lambda *message: None

    node = Stub()
    node.listen()
    node._subscribe(Log(), LATCHED)
    results = ("trajectories", "trajectories/points", "impacts", "deposits", "hazard/zones")
    assert all(node.heard[topic][1].depth >= 10 for topic in results)
    assert set(node.heard) == {*results, "terrain/points", "terrain/mesh", "sources", recorder.DIAGNOSTICS}


def test_a_recording_that_cannot_be_created_is_refused_in_a_sentence(tmp_path):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    with pytest.raises(InputError, match="cannot be written"):
        Recording(tmp_path)
