"""Tests of a station's regular checks, and of what it still reports after it is closed."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.alerts.standing_faults import StandingFaults
from rpf3d_ros.engine import station as module
from rpf3d_ros.engine import waiting_terrain
from rpf3d_ros.engine.answer_reports import AnswerReports, PresentState
from rpf3d_ros.engine.decision_reports import DecisionReports
from rpf3d_ros.engine.outlets import Outlets
from rpf3d_ros.engine.station import Station
from rpf3d_ros.engine.waiting_sources import WaitingSources
from rpf3d_ros.engine.waiting_terrain import Moment, WaitingTerrain


class Threads:
    """Stands in for a thread that ends when it is closed if `ends` is true, or else keeps running."""

    def __init__(self, ends):
        self.ends, self.standing = ends, StandingFaults(lambda: None)

    def close(self, timeout):
        return self.ends

    def lose(self, why):
        """Do nothing: stands in for the method of the desk."""


class CalledNames:
    """Keeps the names of the methods that are called on it."""

    def __init__(self):
        self.names = []

    def __getattr__(self, name):
        return lambda *given, **named: self.names.append(name)


def made(ends):
    """Return a station made of stand-ins, and the `CalledNames` that receives its messages.

    ends : whether the thread that simulates rocks ends when it is closed
    """
    calls, station = CalledNames(), object.__new__(Station)
    station.terrain, station.flyer, station.builder = WaitingTerrain(1), Threads(ends), Threads(True)
    station.desk, station._configuration = Threads(True), SimpleNamespace(store=None)
    station._outlets = Outlets(calls, calls, calls, calls, lambda: 7)
    station.decisions = DecisionReports(station._outlets, "map")
    state = PresentState(
        desk=lambda: station.desk, region_of=str, standing=lambda: None, watch_present=lambda: None,
        while_known=lambda trigger, do: True,
    )  # fmt: skip
    station.reports = AnswerReports(SimpleNamespace(), station._outlets, state)
    return station, calls


@pytest.mark.parametrize("ends", [True, False])
def test_a_station_says_whether_all_its_threads_have_ended(ends):
    station, _ = made(ends)
    assert station.close() is ends
    assert station.terrain.take() is None


def test_threads_that_are_left_behind_disturb_no_station_that_comes_after():
    station, calls = made(False)
    station.decisions.logged("the disk is full")
    assert calls.names == ["set"]
    station.close()
    station.decisions.logged("")
    station.terrain_refused("the node is being shut down")
    station.failed(ValueError("late"))
    station.decisions.unwritten()
    station.decisions.held_up("no clock")
    assert calls.names == ["set"]
    assert station._outlets.now() == 7


def test_what_takes_its_time_leaves_none_of_it_to_the_next():
    given = []
    slow = SimpleNamespace(close=lambda timeout: given.append(timeout) or module.time.sleep(0.05) or True)
    assert module._all_end((slow, slow), 0.06)
    assert given[0] <= 0.06 and given[1] <= 0.011
    assert module._all_end((slow,), 0.0) and given[2] == 0.0


def test_a_patch_that_no_late_survey_can_ask_for_is_kept_until_the_next_beat(monkeypatch):
    station, calls = made(True)
    station.desk, station.sources = None, WaitingSources(50.0, 10)
    station.terrain.put_patch("patch", Moment(1))
    station.beat()
    assert station.terrain._received[0].patch == "patch"
    monkeypatch.setattr(waiting_terrain, "LATE", 0.0)
    station.beat()
    assert station.terrain._received[0].patch is None
    assert calls.names == ["set", "set"]
