"""Tests of the report of a node's health, whose parts several threads set."""

import sys
import threading
from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.interface import health_report
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.messages.health import OK, WARN, healths_of

THREADS, PARTS = 4, 200


class StubNode:
    """Stands in for a node: has what `HealthReport` needs, and keeps what is published and logged."""

    def __init__(self):
        self.arrays, self.logged = [], []
        self.context = self

    def __getattr__(self, name):
        return lambda *args, **more: self

    def publish(self, array):
        self.arrays.append(array)

    def get_fully_qualified_name(self):
        return "/node"

    def get_namespace(self):
        return "/"

    def to_msg(self):
        from builtin_interfaces.msg import Time

        return Time()

    def warning(self, message, **more):
        self.logged.append(message)


@pytest.fixture
def tiny_switch_interval():
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def test_no_part_is_lost_where_threads_set_parts_at_once(tiny_switch_interval):
    node = StubNode()
    report = HealthReport(node)

    def tell(thread):
        for part in range(PARTS):
            report.set(f"{thread} {part}", OK, "well")

    threads = [threading.Thread(target=tell, args=(i,)) for i in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    report.publish()
    assert len(healths_of(node.arrays[-1])) == THREADS * PARTS
    sizes = [len(array.status) for array in node.arrays]
    assert sizes == sorted(sizes), "an older state was published after a newer one"


def test_a_part_logs_each_reason_and_repeats_none(monkeypatch):
    node = StubNode()
    report = HealthReport(node)
    for message in ("too far", "too near", "too far", "too near"):
        report.set("sources", WARN, message)
    assert node.logged == ["too far", "too near"]
    monkeypatch.setattr(health_report, "QUIET", 0.0)
    report.set("sources", WARN, "too far")
    assert node.logged[-1] == "too far"


def test_a_reason_that_stays_true_is_logged_once(monkeypatch):
    """Each decision repeats the reason, here for a minute; after 10 s without it, the reason counts as new."""
    node = StubNode()
    report, clock = HealthReport(node), iter([*range(60), 70.0])
    monkeypatch.setattr(health_report, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    for _ in range(60):
        report._log("sources", WARN, "too far")
    assert node.logged == ["too far"]
    report._log("sources", WARN, "too far")
    assert node.logged == ["too far", "too far"]


def test_a_state_that_has_not_changed_waits_for_the_timer():
    node = StubNode()
    report = HealthReport(node)
    for _ in range(3):
        report.set("sources", OK, "received")
    assert len(node.arrays) == 1
    report.publish()
    assert len(node.arrays) == 2
