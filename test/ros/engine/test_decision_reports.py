"""Tests of what the diagnostics report about the decision log."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.engine.decision_reports import DecisionReports
from rpf3d_ros.engine.outlets import NoOutput, Outlets
from rpf3d_ros.messages.health import ERROR, OK, WARN


class Health:
    """Keeps the level and the sentence of the last report."""

    last = (OK, "")

    def set(self, part, level, sentence):
        self.last = level, sentence


@pytest.fixture
def reports():
    """Yield a `DecisionReports` and the `Health` that it sets."""
    health, none = Health(), NoOutput()
    yield DecisionReports(Outlets(answers=none, alerts=none, health=health, logger=none, now=lambda: 0), "map"), health


def test_what_cannot_be_kept_is_an_error_until_it_is_kept_and_no_missing_decision(reports):
    reports, health = reports
    for fault in ("", "the received inputs cannot be saved"):
        reports.remembered(fault)
        reports.logged("")
    assert health.last == (ERROR, "the received inputs cannot be saved"), "a decision on disk does not hide it"
    reports.remembered("")
    assert health.last == (OK, "every decision is on disk")


def test_a_missing_decision_is_told_of_after_it_too(reports):
    reports, health = reports
    reports.remembered("no memory")
    reports.logged("the disk is full")
    assert health.last == (ERROR, "the disk is full; no memory")
    reports.remembered("")
    reports.logged("")
    missing = "decisions since the start are missing from the log"
    assert health.last == (WARN, f"decisions are on disk now; earlier: {missing}")
