"""Tests that a click is not a sensor's report: if no configured sensor has reported, the level is `fault`."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import numpy as np
from live_sites.watched_pit import start_with
from never_green import pit
from never_green.first_messages import AREA, NOTHING, PLAN, WHOLE, faults_after
from never_green.plan import Send
from never_green.stories import CLICK

from rpf3d_ros.alerts.source_topics import ONLY_CLICKS

CLICKED = Send(
    sent=0.3, at=0.3, topic=CLICK, kind="point", places=pit.on_the_floor(np.random.default_rng(1))[None]
)  # fmt: skip


@pytest.fixture
def started(monkeypatch):
    """Yield a function that starts a node with given parameters for sensor topics; close the last node afterwards."""
    runs = []

    def start(**topics):
        runs.append(start_with(monkeypatch, PLAN, **topics))
        return runs[-1]

    yield start
    runs[-1].node.close()


def test_a_click_alone_is_a_fault_until_a_sensor_reports(started):
    run = started()
    assert faults_after(run, WHOLE, AREA, CLICKED) == (ONLY_CLICKS,)
    assert faults_after(run, NOTHING) == ()


def test_a_click_alone_is_enough_where_the_node_has_no_topics_of_sensors(started):
    run = started(source_topics=("",), source_cloud_topics=("",), optional_topics=("",))
    assert faults_after(run, WHOLE, AREA, CLICKED) == ()


@pytest.mark.parametrize(("behind_s", "is_fault"), [(2.4, False), (2.6, True), (6.0, True), (1e5, True)])
def test_a_click_that_is_too_old_when_it_is_received_is_a_fault(started, behind_s, is_fault):
    """A click counts until it is older than `sources_max_age_s` (5 s): a late click would end before its answer."""
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING) == ()
    faults = faults_after(run, CLICKED._replace(sent=3.0, at=3.0, offset=-behind_s))
    assert bool(faults) == is_fault
    assert all("behind this clock; at most 2.5 s are allowed on clicked_point" in fault for fault in faults)


@pytest.mark.parametrize("pause", [False, True], ids=["step of the clock", "deactivated"])
def test_a_click_that_is_forgotten_is_a_fault_because_no_sensor_repeats_it(started, pause):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING, CLICKED._replace(sent=0.5, at=0.5)) == ()
    if pause:
        run.node.station.deactivate()
        run.node.station.activate()
        run.node.settle()
    else:
        run.node.station.forget("the clock went back")
    faults = faults_after(run, WHOLE._replace(sent=0.6, at=0.6), AREA._replace(sent=0.7, at=0.7),
                          NOTHING._replace(sent=0.8, at=0.8))  # fmt: skip
    assert any("a clicked source was forgotten" in fault and "click it again" in fault for fault in faults)


def test_without_a_click_nothing_is_forgotten(started):
    run = started()
    faults_after(run, WHOLE, AREA, NOTHING)
    run.node.station.forget("the clock went back")
    assert not any("clicked" in fault for fault in faults_after(run, NOTHING._replace(sent=0.8, at=0.8)))
