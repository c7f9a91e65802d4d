"""Tests that a moved area is a fault until every wall is answered for its new place, on a node without a network."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import numpy as np
from live_sites.watched_pit import shown_at, start_over_the_pit
from never_green import pit
from never_green.plan import Send, Truth
from never_green.stories import RADAR_A

from rpf3d_core.live.outlines import WatchedOutlines

TRUTH = Truth(sources=(), bank_until=np.inf, areas=(pit.outline(pit.SHELTERED_ROAD),) * 2, area_since=0.0)
TOPICS = (RADAR_A, "terrain/points", "areas/polygon")
BELOW_THE_FIRST = ((44.0, 2.0), (52.0, 2.0), (52.0, 8.0), (44.0, 8.0))
"""Corners (m) of the part of the road below the first wall only."""

WALLS = 6
"""Number of walls that the radar reports one after the other: more than the node answers again after a change."""

MOVED = 1.5
"""Time (s) at which the area is moved."""


@pytest.fixture
def run(monkeypatch):
    """Yield a node that keeps the sources of four walls, has the terrain of the pit, and watches the sheltered road."""
    started = start_over_the_pit(monkeypatch, TRUTH, TOPICS)
    move_area(started, 0.2, pit.SHELTERED_ROAD)
    yield started
    started.node.close()


def move_area(run, at, corners):
    run.deliver(Send(sent=at, at=at, topic="areas/polygon", kind="polygon", places=pit.outline(corners)))


def report_walls(run, at):
    """Let the radar report a source on each wall from the time `at` (s) on; the first wall is above BELOW_THE_FIRST."""
    for number in range(WALLS):
        place = pit.placed(10.0, 5.0 + 5.0 * number, 31.0)[None]
        sent = at + 0.05 * number
        run.deliver(Send(sent=sent, at=sent, topic=RADAR_A, kind="poses", places=place))


def test_a_moved_area_is_a_fault_until_all_walls_are_answered_for_its_new_place(run):
    report_walls(run, 0.5)
    assert shown_at(run, MOVED) == "normal"
    move_area(run, MOVED, BELOW_THE_FIRST)
    assert shown_at(run, MOVED + 0.5) == "normal", "the time for the answers"
    assert shown_at(run, MOVED + 1.25) == "fault"
    (fault,) = run.node.station.desk.alert.faults
    assert fault.startswith("live_area: the area moved")
    report_walls(run, run.at + 0.1)
    assert shown_at(run, run.at + 0.5) == "restrict"
    assert run.node.station.desk.alert.faults == ()


def test_without_the_guard_the_first_wall_would_be_answered_for_the_former_place(run, monkeypatch):
    monkeypatch.setattr(WatchedOutlines, "outdated", lambda self, parts: ())
    report_walls(run, 0.5)
    move_area(run, MOVED, BELOW_THE_FIRST)
    assert shown_at(run, MOVED + 1.5) == "normal"


def test_where_every_wall_is_answered_again_a_moved_area_is_no_fault(run):
    place = pit.placed(10.0, 5.0, 31.0)[None]
    run.deliver(Send(sent=0.5, at=0.5, topic=RADAR_A, kind="poses", places=place))
    assert shown_at(run, MOVED) == "normal"
    move_area(run, MOVED, BELOW_THE_FIRST)
    assert run.watcher.shown(run.at) == "restrict"
    assert shown_at(run, MOVED + 2.0) == "restrict" and run.node.station.desk.alert.faults == ()


def test_a_new_area_is_a_fault_until_all_walls_are_answered_for_it(run):
    report_walls(run, 0.5)
    run.deliver(Send(sent=MOVED, at=MOVED, topic="areas/polygon", kind="polygon", places=np.empty((0, 2))))
    move_area(run, MOVED + 0.1, BELOW_THE_FIRST)
    assert shown_at(run, MOVED + 1.5) == "fault"
