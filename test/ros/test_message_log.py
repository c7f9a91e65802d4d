"""Which event a message is recorded under."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Pose, PoseArray
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from rpf3d_core.live.zones import ShownZone
from rpf3d_ros.cloud_messages import cloud_of_columns
from rpf3d_ros.map_frame import MapFrame
from rpf3d_ros.marker_messages import trajectory_markers, zone_markers
from rpf3d_ros.message_log import EVENTS_KEPT, EventNumbers, MessageLog

COLUMNS = dict.fromkeys(("x", "y", "z", "t", "speed", "energy"), np.zeros(2)) | {"rock": np.zeros(2, dtype=int)}


class Rows:
    """Stands for a recording: which rows were logged at which second of which event."""

    def __init__(self):
        self.now, self.rows = None, []

    def at(self, stamp_ns, event):
        self.now = (stamp_ns // 1_000_000_000, event)

    def __getattr__(self, kind):
        return lambda *about: self.rows.append((kind, *self.now))


def header(second):
    return Header(frame_id="map", stamp=Time(sec=second))


@pytest.fixture
def log():
    return MessageLog(Rows(), MapFrame(), "map", lambda: Time(sec=99))


def sources(log, second):
    log.sources(PoseArray(header=header(second), poses=[Pose()]))


def sent(data):
    return deserialize_message(data, MarkerArray)


def results(log, second):
    log.cloud("impacts", cloud_of_columns(header(second), COLUMNS))
    log.trajectories(sent(trajectory_markers(header(second), COLUMNS, 9, 9)))
    log.hazard(sent(zone_markers(header(second), [ShownZone("0.1", np.zeros((1, 3, 3)), np.empty((0, 2, 3)))])))


def test_results_that_come_after_the_next_sources_belong_to_the_event_of_their_own(log):
    sources(log, 10)
    sources(log, 20)
    results(log, 10)
    sources(log, 30)
    results(log, 30)
    rows = log._recording.rows
    assert {row[1:] for row in rows} == {(10, 1), (20, 2), (30, 3)}
    assert [row[1:] for row in rows if row[0] == "points"] == [(10, 1), (30, 3)]


def test_results_of_unknown_sources_are_one_new_event(log):
    sources(log, 10)
    results(log, 5)
    sources(log, 5)
    assert {row[1:] for row in log._recording.rows} == {(10, 1), (5, 2)}


def test_only_so_many_stamps_are_remembered():
    numbers = EventNumbers()
    assert [numbers.of(stamp) for stamp in range(EVENTS_KEPT + 1)] == list(range(1, EVENTS_KEPT + 2))
    assert numbers.of(1) == 2
    assert numbers.of(0) == EVENTS_KEPT + 2
    assert len(numbers._known) == EVENTS_KEPT


def test_an_array_without_markers_is_recorded_now(log):
    sources(log, 10)
    log.trajectories(sent(trajectory_markers(header(10), {name: c[:0] for name, c in COLUMNS.items()}, 9, 9)))
    empty = sent(zone_markers(header(10), []))
    empty.markers = []
    log.hazard(empty)
    assert log._recording.rows[-1] == ("clear", 99, 1)
