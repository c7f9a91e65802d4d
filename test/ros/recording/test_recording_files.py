"""Tests of the files of a recording: when the next file begins, with which content, and faults in writing."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("rerun", reason="rerun-sdk is not installed")

from messages import recorded_messages as made

from rpf3d_core.recordings.content import rows_by_entity, verify
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.recording.entries import RecordingEntry
from rpf3d_ros.recording.files import RETRY, Head, RecordingFiles, Rotation, numbered_files
from rpf3d_ros.recording.incident_bag import IncidentBag
from rpf3d_ros.recording.message_log import MessageLog

STANDING = (
    "/terrain", "/terrain/updates/0", "/sources", "/areas/live_area", "/areas/haul_ramp/outline", "/alert_level",
    "/alert_state/area/haul_ramp",
)  # fmt: skip
"""Entities with which each file begins after they were recorded once."""


class Clock:
    """A clock (s) that shows `now`, which the test sets."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def shift(log):
    return [log.entries(topic, message) for _, topic, message in made.shift()]


@pytest.fixture
def log():
    return MessageLog(MapFrame(), "map", lambda: 0)


@pytest.fixture
def clock():
    return Clock()


def entry(keeps, number=0):
    return RecordingEntry(number, number, lambda recording: None, keeps)


def test_a_new_file_begins_when_the_last_one_is_large_enough_and_stands_alone(tmp_path, log):
    files = RecordingFiles(tmp_path / "shift.rrd", Rotation(megabytes=0.2))
    for entries in shift(log):
        files.write(entries)
    files.close()
    written = numbered_files(tmp_path / "shift.rrd")
    assert len(written) > 2
    for file in written:
        verify(file)
    last = rows_by_entity(written[-1])
    assert {entity for entity in STANDING if not last.get(entity)} <= {"/terrain/updates/0"}
    assert all(rows_by_entity(written[1])[entity] for entity in STANDING)


def test_a_new_file_begins_when_time_is_over_even_if_nothing_comes(tmp_path, log, clock):
    files = RecordingFiles(tmp_path / "shift.rrd", Rotation(minutes=10.0), clock)
    clock.now += 599.0
    files.check()
    assert len(numbered_files(tmp_path / "shift.rrd")) == 1
    clock.now += 1.0
    files.check()
    files.close()
    assert [path.stem[-4:] for path in numbered_files(tmp_path / "shift.rrd")] == ["0001", "0002"]


def test_only_so_many_files_are_kept_and_no_other_file_is_touched(tmp_path, clock):
    others = [tmp_path / name for name in ("shift_old.rrd", "shift.rrd", "shift_20261121T000000Z_0001.bag")]
    for other in others:
        other.touch()
    files = RecordingFiles(tmp_path / "shift.rrd", Rotation(minutes=1.0, keep=2), clock)
    for _ in range(4):
        clock.now += 60.0
        files.check()
    files.close()
    assert [path.stem[-4:] for path in numbered_files(tmp_path / "shift.rrd")] == ["0004", "0005"]
    assert all(other.exists() for other in others)


def test_with_a_file_that_is_deleted_its_bag_goes_and_no_other(tmp_path, clock):
    bags = IncidentBag(str(tmp_path / "pit"))
    (tmp_path / "pit_by_hand").mkdir()
    rotation = Rotation(minutes=1.0, keep=2)
    files = RecordingFiles(tmp_path / "shift.rrd", rotation, clock, begun=bags.begin_with, forgotten=bags.forget)
    for _ in range(4):
        clock.now += 60.0
        files.check()
    files.close()
    bags.close()
    kept = {f"pit_{path.stem}" for path in numbered_files(tmp_path / "shift.rrd")}
    assert len(kept) == 2 and not bags.fault
    assert {path.name for path in tmp_path.glob("pit_*")} == kept | {"pit_by_hand"}


def test_without_rotation_there_is_one_file_of_the_given_name(tmp_path, log):
    files = RecordingFiles(tmp_path / "shift.rrd", Rotation())
    for entries in shift(log):
        files.write(entries)
    files.close()
    assert [path.name for path in tmp_path.iterdir()] == ["shift.rrd"]


class Broken:
    """Stands in for a recording on a full disk: accepts rows, but raises RuntimeError in `flush` and `close`."""

    def __getattr__(self, kind):
        return lambda *about: None

    def flush(self):
        raise RuntimeError("no room")

    def close(self):
        raise RuntimeError("no room")


def test_after_a_fault_a_new_file_is_begun_with_what_holds_and_the_loss_is_counted(tmp_path, log, clock):
    files = RecordingFiles(tmp_path / "shift.rrd", Rotation(), clock)
    first, *rest = shift(log)
    files.write(first)
    files._recording = Broken()
    with pytest.raises(RuntimeError, match="no room"):
        files.write(rest[0])
    with pytest.raises(OSError, match="every"):
        files.write(rest[1])
    assert files.lost == len(rest[0]) + len(rest[1])
    clock.now += RETRY
    files.write(rest[2])
    files.close()
    assert files.path != tmp_path / "shift.rrd"
    verify(files.path)
    assert rows_by_entity(files.path)["/terrain"] == 1


def test_a_file_that_cannot_be_begun_leaves_nothing_behind(tmp_path, log, clock):
    folder = tmp_path / "disk"
    folder.mkdir()
    files = RecordingFiles(folder / "shift.rrd", Rotation(), clock)
    files._recording = Broken()
    with pytest.raises(RuntimeError):
        files.write(shift(log)[0])
    folder.rename(tmp_path / "gone")
    clock.now += RETRY
    with pytest.raises(OSError, match="there is no folder"):
        files.check()
    (tmp_path / "gone").rename(folder)
    clock.now += RETRY
    files.check()
    files.close()
    assert [path.stem[-4:] for path in numbered_files(folder / "shift.rrd")] == ["0002"]


def test_new_terrain_ends_its_patches_and_what_is_no_state_is_not_kept():
    head = Head()
    head.note([entry("terrain", 1), entry("terrain/updates/0", 2), entry("sources", 3), entry("", 4)])
    assert [kept.event for kept in head.entries()] == [1, 2, 3]
    head.note([entry("sources", 5), entry("terrain", 6)])
    assert [kept.event for kept in head.entries()] == [5, 6]
