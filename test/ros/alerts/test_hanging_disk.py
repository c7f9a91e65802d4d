"""Tests of the desk on a disk that hangs: requests that wait do not fill the memory, and alerts still come."""

import threading
import time
from functools import partial

import pytest
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.alert_evidence import NOW, S, area, evidence, site

from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_ros.alerts import alert_desk
from rpf3d_ros.alerts.alert_desk import AlertDesk

RADAR, PATIENCE = "sources", 20.0
wait = partial(wait_for, seconds=PATIENCE, pause=0.002)


class Reports:
    """Keeps the alerts, faults and other reports of a desk."""

    def __init__(self):
        self.alerts, self.faults, self.unkept, self.ignored, self.hold = [], [], [], [], threading.Event()
        self.hold.set()

    def decided(self, alert, evidence):
        self.alerts.append(alert)
        self.hold.wait(PATIENCE)

    def logged(self, fault):
        self.faults.append(fault)

    def remembered(self, fault):
        self.unkept.append(fault)

    def __getattr__(self, name):
        return lambda *given: self.ignored.append(name)


class HangingLog:
    """A decision log whose first write hangs until the test sets `answers`."""

    last_alert = None

    def __init__(self):
        self.is_reached, self.answers = threading.Event(), threading.Event()

    def remember(self, received):
        """Do nothing: no received input has changed."""

    def decided(self, decision, thresholds):
        self.is_reached.set()
        self.answers.wait(PATIENCE)

    def close(self):
        pass


@pytest.fixture
def hanging():
    """Yield a desk whose first decision hangs, its log, and its reports."""
    log, reports = HangingLog(), Reports()
    desk = AlertDesk(site(), log, lambda: NOW, reports)
    desk.decide_on("wall", evidence(area(0)), RADAR)
    assert log.is_reached.wait(PATIENCE)
    yield desk, log, reports
    log.answers.set()
    assert desk.close(PATIENCE)


def test_changes_do_not_pile_up_behind_a_disk_that_hangs(hanging):
    desk, log, reports = hanging
    for number in range(1000):
        desk.watch(lambda number=number: {"ramp": str(number)})
        desk.standing.report("inputs", f"message {number} was refused")
        desk.miss(RADAR, NOW - 1000 + number)
    desk.miss(RADAR, NOW - S)  # from a slow thread: only the newest loss counts
    assert desk._requests.qsize() <= 2
    log.answers.set()
    wait(lambda: len(reports.alerts) >= 2)
    faults = " ".join(reports.alerts[-1].faults)
    assert "message 999 was refused" in faults and f"on {RADAR} were lost 0.000 s ago" in faults


def test_answers_beyond_the_most_that_may_wait_count_as_lost_messages(hanging, monkeypatch):
    monkeypatch.setattr(alert_desk, "MOST_WAITING", 3)
    desk, log, reports = hanging
    for number in range(100):
        desk.decide_on(number, evidence(area(5000)), RADAR)
    assert len(desk._undecided) == 3 and desk._requests.qsize() <= 3
    log.answers.set()
    wait(lambda: reports.alerts and any("were lost" in fault for fault in reports.alerts[-1].faults))
    assert reports.alerts[-1].held == Level.EVACUATE


class StepwiseLog:
    """A decision log whose calls hang until the test releases `go_on`; `last` is the name of the hanging call."""

    last_alert = None

    def __init__(self):
        self.last, self.calls, self.go_on, self.is_free = "", 0, threading.Semaphore(0), False

    def __getattr__(self, name):
        return lambda *given: self.is_free or self._hang(name)

    def _hang(self, name):
        self.last, self.calls = name, self.calls + 1
        self.go_on.acquire(timeout=PATIENCE)
        self.last = ""


@pytest.fixture
def stepwise(monkeypatch):
    """Yield a desk whose writes all hang, its log, and its reports; a write longer than 0.05 s is reported."""
    monkeypatch.setattr(alert_desk, "LONGEST_WRITE", 0.05)
    log, reports = StepwiseLog(), Reports()
    desk = AlertDesk(site(), log, lambda: NOW, reports, unknown="the log is gone")
    yield desk, log, reports
    log.is_free = True
    log.go_on.release(10)
    assert desk.close(PATIENCE)


def hang_in(log, name):
    """Wait until the log hangs in the call `name`; release all calls before it at once."""
    while wait(lambda: log.last) != name:
        calls = log.calls
        log.go_on.release()
        wait(lambda calls=calls: log.calls > calls)


def test_a_disk_that_hangs_before_the_decision_is_told_of_too(stepwise):
    desk, log, reports = stepwise
    desk.standing.report("inputs", "a message was refused")
    hang_in(log, "remember")
    wait(lambda: desk.tick() or "unwritten" in reports.ignored)
    assert not reports.alerts and log.last == "remember"


def test_the_writes_of_one_request_count_together(stepwise):
    """Each write is quick enough, but the alert waits for both."""
    desk, log, reports = stepwise
    desk.standing.report("inputs", "a message was refused")
    hang_in(log, "remember")
    time.sleep(0.06)
    hang_in(log, "decided")
    desk.tick()
    assert "unwritten" in reports.ignored and not reports.alerts


def test_a_disk_that_hangs_while_the_end_of_an_unknown_level_is_written_is_told_of(stepwise):
    desk, log, reports = stepwise
    desk.decide_on("wall", evidence(area(0)), RADAR)
    hang_in(log, "decided")
    log.go_on.release()
    wait(lambda: reports.alerts)
    wait(lambda: desk._waiting_since() is None)
    desk.acknowledge("J. Meyer", "looked at every area", print)
    hang_in(log, "settle")
    wait(lambda: desk.tick() or "unwritten" in reports.ignored)
    assert log.last == "settle"


def test_an_error_in_what_must_be_remembered_stops_no_alert_and_makes_the_next_start_unknown(tmp_path):
    folder, reports = tmp_path / "decisions", Reports()
    desk = AlertDesk(site(), DecisionLog(folder, "0.1.0"), lambda: NOW, reports, remembered=lambda: 1 / 0)
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    assert wait(lambda: reports.alerts)[0].level == Level.EVACUATE
    assert desk.close(PATIENCE) and "ZeroDivisionError" in reports.unkept[0]
    assert reports.faults == [""], "the decision itself is on disk"
    with DecisionLog(folder, "0.1.0") as log:
        assert "not in the log" in log.unknown


def test_what_waits_while_the_desk_closes_is_remembered(tmp_path):
    reports, received = Reports(), {"refused": {}}
    desk = AlertDesk(site(), DecisionLog(tmp_path, "0.1.0"), lambda: NOW, reports, remembered=lambda: dict(received))
    reports.hold.clear()
    desk.decide_on("wall", evidence(area(0)), RADAR)
    wait(lambda: reports.alerts)
    desk.miss(RADAR, NOW)
    received["refused"] = {RADAR: "not a number"}
    assert not desk.close(0.0)
    reports.hold.set()
    assert desk.close(PATIENCE)
    with DecisionLog(tmp_path, "0.1.0") as log:
        assert (log.memory["missed"], log.memory["refused"]) == ({RADAR: NOW}, received["refused"])


def test_a_change_is_written_once_also_before_the_clock_runs_and_nothing_is_decided(tmp_path, monkeypatch):
    log, reports, received = DecisionLog(tmp_path, "0.1.0"), Reports(), {"patches": 1}
    written, write = [], log._state.write
    monkeypatch.setattr(log._state, "write", lambda facts: written.append(facts["memory"]) or write(facts))
    desk = AlertDesk(site(), log, lambda: 0, reports, remembered=lambda: dict(received))
    for number in range(1, 4):
        desk.watch(dict, lambda number=number: str(number))
        desk.standing.report("inputs", f"message {number} was refused")
        wait(lambda number=number: reports.ignored.count("held_up") >= number)
    received["patches"] = 2
    desk.watch(dict, lambda: "b")
    wait(lambda: written and written[-1]["patches"] == 2)
    assert desk.close(PATIENCE) and not reports.alerts
    assert [each["patches"] for each in written] == [1, 2]
    again = DecisionLog(tmp_path, "0.1.0")
    assert again.memory["patches"] == 2
    again.close()


def test_a_fault_of_the_evidence_that_ended_since_makes_an_acknowledgement_void():
    """The person sees that sources are stale; new sources wait to be processed when the acknowledgement arrives."""
    reports, replies, now = Reports(), [], [NOW]
    desk = AlertDesk(site(), None, lambda: now[0], reports)
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    desk.decide_on("wall", evidence(area(0)), RADAR)
    wait(lambda: len(reports.alerts) == 2)
    now[0] += 40 * S
    reports.hold.clear()
    desk.tick()
    assert wait(lambda: reports.alerts[2:])[0].faults
    desk.decide_on("wall", evidence(area(0), now=now[0]), RADAR)
    desk.acknowledge("J. Meyer", "looks quiet", replies.append)
    reports.hold.set()
    assert wait(lambda: replies)[0][0] is False
    wait(lambda: reports.alerts[-1].faults == ())
    assert reports.alerts[-1].held == Level.EVACUATE
    desk.acknowledge("J. Meyer", "looks quiet", replies.append)
    assert wait(lambda: replies[1:])[0][0] and wait(lambda: reports.alerts[-1].held == Level.NORMAL)
    assert desk.close(PATIENCE)


def test_a_fault_that_ended_since_makes_an_acknowledgement_void():
    reports, replies = Reports(), []
    desk = AlertDesk(site(), None, lambda: NOW, reports)
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    desk.decide_on("wall", evidence(area(0)), RADAR)
    desk.standing.report("refused", "a message was refused")
    desk.acknowledge("J. Meyer", "looks quiet", replies.append)
    desk.standing.settle("refused")
    lowered, why = wait(lambda: replies)[0]
    assert not lowered and "fault" in why
    wait(lambda: reports.alerts[-1].faults == ())
    assert reports.alerts[-1].held == Level.EVACUATE
    desk.acknowledge("J. Meyer", "looks quiet", replies.append)
    assert wait(lambda: replies[1:])[0][0] and wait(lambda: reports.alerts[-1].held == Level.NORMAL)
    assert desk.close(PATIENCE)
