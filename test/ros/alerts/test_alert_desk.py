"""Tests of the thread that decides on alerts: the order of evidence and acknowledgements, errors of log and disk."""

import threading
from functools import partial
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.alert_evidence import NOW, S, area, evidence, site

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import untouched
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.lines import Decision
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.log_files import NotLogged, files_in
from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.alerts import alert_desk
from rpf3d_ros.alerts.alert_desk import NO_CLOCK, AlertDesk
from rpf3d_ros.alerts.source_topics import BY_HAND, OPTIONAL, REMOVED
from rpf3d_ros.engine.answer_reports import AnswerReports, PresentState
from rpf3d_ros.engine.decision_reports import DecisionReports
from rpf3d_ros.engine.station import Station

PATIENCE = 20.0
"""Time limit (s) of a wait for something that usually takes some hundredths of a second."""
wait = partial(wait_for, seconds=PATIENCE, pause=0.002)

RADAR, OTHER = "sources", "source_cloud"


class DeskReports:
    """Keeps what the desk reports, and raises an error while `broken` is true."""

    def __init__(self):
        self.alerts, self.errors, self.faults, self.hindrances, self.hangs = [], [], [], [], 0
        self.reached = 0
        self.broken, self.hold = False, threading.Event()
        self.hold.set()

    def decided(self, alert, evidence):
        self.reached += 1
        self.hold.wait(PATIENCE)
        if self.broken:
            raise RuntimeError("no publisher")
        self.alerts.append(alert)

    def logged(self, fault):
        self.faults.append(fault)

    def remembered(self, fault):
        """Do nothing: only `test_hanging_disk` tests this report."""

    def held_up(self, why):
        self.hindrances.append(why)

    def unwritten(self):
        self.hangs += 1

    def undecided(self, error):
        self.errors.append(error)


class BrokenLog:
    """A decision log that raises an unforeseen error."""

    last_alert = None

    def remember(self, received):
        raise AttributeError("broken")

    def decided(self, decision, thresholds):
        raise AttributeError("broken")

    def close(self):
        pass


class HangingLog:
    """A decision log on a disk that does not respond and raises no error."""

    last_alert = None

    def __init__(self):
        self.answers = threading.Event()

    def remember(self, received):
        """Do nothing: no received input has changed."""

    def decided(self, decision, thresholds):
        self.answers.wait(PATIENCE)

    def refused(self, given, because):
        """Do nothing: the disk responds again."""

    def close(self):
        pass


class Clock:
    """A clock (ns) that shows `now`, which the test sets."""

    def __init__(self):
        self.now = NOW

    def __call__(self):
        return self.now


def decided(reports, count):
    """Wait until `count` alerts have been reported, and no more; return the last."""
    wait(lambda: len(reports.alerts) >= count)
    assert len(reports.alerts) == count
    return reports.alerts[-1]


def serve_all(desk):
    """Wait until the desk has processed all requests so far."""
    replies = []
    desk.acknowledge("", "", replies.append)  # without a name it causes no decision
    wait(lambda: replies)


@pytest.fixture
def desk():
    """Yield a desk without a log, its `DeskReports`, and its clock."""
    reports, clock = DeskReports(), Clock()
    made = AlertDesk(site(), None, clock, reports)
    yield made, reports, clock
    reports.hold.set()
    assert made.close(PATIENCE)


def nothing_seen(stamp):
    return evidence()._replace(areas=untouched(["ramp"]), sources=0, trigger_stamp_ns=stamp, at_ns=NOW)


def test_nothing_seen_clears_what_was_seen_before_and_nothing_newer(desk):
    desk, reports, _ = desk
    desk.decide_on("wall", evidence(area(5000))._replace(trigger_stamp_ns=NOW - S), RADAR)
    desk.decide_on("nobody", nothing_seen(NOW - 2 * S), RADAR)
    wait(lambda: len(reports.alerts) == 2)
    assert reports.alerts[-1].evident == Level.EVACUATE
    desk.decide_on("nobody", nothing_seen(NOW), RADAR)
    wait(lambda: len(reports.alerts) == 3)
    assert reports.alerts[-1].evident == Level.NORMAL


def test_unreported_places_that_are_not_simulated_in_time_are_a_fault_at_once(desk):
    """Also if the last decision was made before they were unreported, and is still valid."""
    desk, reports, clock = desk
    desk.decide_on("wall", evidence(sources=1), RADAR)
    assert decided(reports, 1).level == Level.NORMAL
    clock.now = NOW + S // 2
    desk.unreported.expect(trigger_of(np.array([[1.0, 2.0, 3.0]]), np.zeros((1, 3)), None, NOW, RADAR), 0)
    longest = int(desk.unreported.ends_ns()[0]) - clock.now
    clock.now += longest - 1
    desk.tick()
    serve_all(desk)
    assert len(reports.alerts) == 1
    clock.now += 1
    desk.tick()
    assert "have not been simulated within 5 s" in decided(reports, 2).faults[0]
    desk.tick()
    serve_all(desk)
    assert len(reports.alerts) == 2, "decided once"


def test_evidence_for_the_former_place_of_an_area_is_a_fault_until_it_is_answered_again(desk):
    desk, reports, clock = desk
    here, there = ({"ramp": 64 * name} for name in "ab")
    desk.watch(lambda: here)
    desk.decide_on("wall", evidence(area(0, outline=here["ramp"])), RADAR)
    assert decided(reports, 1).level == Level.NORMAL
    desk.watch(lambda: here)
    desk.watch(lambda: there)
    alert = decided(reports, 2)
    assert (alert.level, alert.valid_until_ns) == (Level.NORMAL, NOW + S), "the same place is nothing new"
    clock.now = NOW + S
    desk.tick()
    assert "ramp: the area moved 1.000 s ago" in decided(reports, 3).faults[0]
    desk.decide_on("wall", evidence(area(5000, outline=there["ramp"]), now=clock.now), RADAR)
    alert = decided(reports, 4)
    assert (alert.level, alert.faults) == (Level.EVACUATE, ())


def test_a_clock_that_goes_back_makes_no_area_move_in_the_future(desk):
    desk, reports, clock = desk
    here = {"ramp": 64 * "a"}
    desk.watch(lambda: here)
    clock.now = NOW - 50 * S
    desk.forget("the clock went back")
    desk.decide_on("wall", evidence(area(0), now=clock.now), RADAR)
    assert decided(reports, 2).level == Level.NORMAL
    clock.now += S
    desk.decide_on("wall", evidence(area(0), now=clock.now), RADAR)
    assert "some sources are not yet simulated for its new place" in decided(reports, 3).faults[0]


def test_nothing_seen_by_one_radar_clears_nothing_that_another_sees(desk):
    desk, reports, _ = desk
    desk.decide_on("wall", evidence(area(5000))._replace(trigger_stamp_ns=NOW - S), RADAR)
    desk.decide_on("nobody", nothing_seen(NOW), OTHER)
    wait(lambda: len(reports.alerts) == 2)
    assert reports.alerts[-1].evident == Level.EVACUATE
    replies = []
    desk.acknowledge("J. Meyer", "the other radar sees nothing", replies.append)
    lowered, why = wait(lambda: replies)[0]
    assert not lowered and "evidence" in why, why
    desk.decide_on("nobody", nothing_seen(NOW), RADAR)
    wait(lambda: reports.alerts[-1].evident == Level.NORMAL)


def test_an_older_answer_does_not_take_the_place_of_a_newer_fault_of_its_wall(desk):
    desk, reports, _ = desk
    lacking = evidence()._replace(areas=(), faults=("no room",), trigger_stamp_ns=NOW - S)
    desk.decide_on("wall", lacking, RADAR)
    desk.decide_on("wall", evidence(area(0))._replace(trigger_stamp_ns=NOW - 2 * S), RADAR)
    wait(lambda: len(reports.alerts) == 2)
    assert "no room" in reports.alerts[-1].faults


def test_where_one_radar_goes_clear_what_another_told_before_it_is_no_step_back(desk):
    desk, reports, clock = desk
    desk.decide_on("other wall", evidence(area(0)), OTHER)
    desk.decide_on("wall", evidence(area(0), now=NOW + S), RADAR)
    clock.now = NOW + 2 * S
    desk.decide_on("nobody", nothing_seen(clock.now)._replace(at_ns=clock.now), RADAR)
    wait(lambda: len(reports.alerts) == 3)
    assert reports.alerts[-1].faults == ()


def test_a_fault_of_what_is_not_kept_is(desk):
    desk, reports, _ = desk
    desk.decide_on("wall", evidence(area(0))._replace(trigger_stamp_ns=NOW - S), RADAR)
    desk.decide_on("nobody", nothing_seen(NOW)._replace(faults=("2 patches are not in the terrain",)), OTHER)
    wait(lambda: len(reports.alerts) == 2)
    assert reports.alerts[-1].faults == ("2 patches are not in the terrain",)


def test_what_was_clicked_is_cleared_by_no_radar_and_counts_until_it_is_too_old(desk):
    desk, reports, clock = desk
    desk.decide_on("wall", evidence(area(5000))._replace(trigger_stamp_ns=NOW - S), BY_HAND)
    desk.decide_on("nobody", nothing_seen(NOW), RADAR)
    wait(lambda: len(reports.alerts) == 2)
    assert reports.alerts[-1].evident == Level.EVACUATE
    clock.now = NOW + 30 * S
    desk.decide_on("nobody", nothing_seen(clock.now)._replace(at_ns=clock.now), RADAR)
    wait(lambda: len(reports.alerts) == 3)
    assert (reports.alerts[-1].evident, reports.alerts[-1].faults) == (Level.NORMAL, ())


def test_of_two_messages_of_one_stamp_the_one_with_sources_counts(desk):
    desk, reports, _ = desk
    desk.decide_on("wall", evidence(area(5000))._replace(trigger_stamp_ns=NOW), RADAR)
    desk.decide_on("nobody", nothing_seen(NOW), RADAR)
    wait(lambda: len(reports.alerts) == 2)
    assert reports.alerts[-1].evident == Level.EVACUATE


def test_a_disk_that_hangs_is_told_of_while_it_does(monkeypatch):
    monkeypatch.setattr(alert_desk, "LONGEST_WRITE", 0.05)
    reports, log = DeskReports(), HangingLog()
    desk = AlertDesk(site(), log, Clock(), reports)
    try:
        desk.decide_on("wall", evidence(area(5000)), RADAR)
        wait(lambda: desk.tick() or reports.hangs)
        desk.tick()
        assert not reports.alerts and reports.hangs == 1, "once is enough"
        log.answers.set()
        wait(lambda: reports.alerts)
        serve_all(desk)
        desk.tick()
        assert reports.hangs == 1
    finally:
        log.answers.set()
        assert desk.close(PATIENCE)


def test_an_acknowledgement_does_not_count_for_evidence_that_got_worse_after_it_was_given(desk):
    desk, reports, clock = desk
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    desk.decide_on("wall", evidence(area(0)), RADAR)
    wait(lambda: len(reports.alerts) == 2)
    reports.hold.clear()
    desk.decide_on("wall", evidence(area(200)), RADAR)
    replies = []
    wait(lambda: reports.reached == 3)  # the decision for the time `clock.now` has been made
    clock.now = NOW - 1  # a slow thread gave this acknowledgement before that decision
    desk.acknowledge("J. Meyer", "looks quiet", replies.append)
    clock.now = NOW + S
    reports.hold.set()
    assert wait(lambda: replies)[0][0] is False
    assert reports.alerts[-1].held == Level.EVACUATE and "become worse" in reports.alerts[-1].void


def test_a_decision_that_could_not_be_published_is_made_again_as_a_fault_and_not_without_end(desk):
    desk, reports, _ = desk
    reports.broken = True
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    wait(lambda: reports.errors)
    serve_all(desk)
    assert len(reports.errors) == 1
    reports.broken = False
    desk.tick()
    assert wait(lambda: reports.alerts)[0].held == Level.EVACUATE and reports.alerts[0].faults


def test_a_decision_that_failed_is_not_forgotten_because_an_area_moved(desk):
    """After the failure there is no evidence, so the move decides nothing; the next tick must."""
    desk, reports, _ = desk
    reports.broken = True
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    wait(lambda: reports.errors)
    reports.broken = False
    desk.watch(lambda: {"ramp": "moved"})
    serve_all(desk)
    desk.tick()
    assert wait(lambda: reports.alerts)[0].held == Level.EVACUATE and reports.alerts[0].faults


def test_an_alert_goes_out_whatever_is_wrong_with_the_log():
    reports = DeskReports()
    desk = AlertDesk(site(), BrokenLog(), Clock(), reports)
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    assert wait(lambda: reports.alerts)[0].level == Level.EVACUATE
    assert desk.close(PATIENCE) and "broken" in reports.faults[0]


def test_a_desk_that_is_left_behind_at_work_lets_go_of_its_log_when_that_is_done(tmp_path):
    """A node that is configured again opens the log again in the same process."""
    reports = DeskReports()
    reports.hold.clear()
    desk = AlertDesk(site(), DecisionLog(tmp_path, "0.0.0"), Clock(), reports)
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    wait(lambda: reports.faults == [""])  # the desk is reporting it
    assert not desk.close(0.05)
    with pytest.raises(NotLogged):
        DecisionLog(tmp_path, "0.0.0")
    reports.hold.set()

    def free():
        try:
            return DecisionLog(tmp_path, "0.0.0")
        except NotLogged:
            return None

    wait(free).close()


def test_ticks_do_not_pile_up_behind_a_slow_disk(desk):
    desk, reports, clock = desk
    reports.hold.clear()
    desk.decide_on("wall", evidence(area(0)), RADAR)
    wait(lambda: reports.reached == 1)
    clock.now = NOW + 100 * S
    for _ in range(1000):
        desk.tick()
    assert desk._requests.qsize() <= 1


def test_of_sources_that_are_all_stale_the_newest_are_told_of(desk):
    desk, reports, _ = desk
    desk.decide_on("one", evidence(area(0))._replace(trigger_stamp_ns=NOW - 40 * S), RADAR)
    desk.decide_on("other", evidence(area(0))._replace(trigger_stamp_ns=NOW - 90 * S), RADAR)
    wait(lambda: len(reports.alerts) == 2)
    assert "stamped 40.000 s ago" in " ".join(reports.alerts[-1].faults)


def test_who_makes_it_forget_hears_when_the_fault_has_been_told(desk):
    desk, reports, _ = desk
    desk.decide_on("wall", evidence(area(0)), RADAR)
    told = []
    desk.forget("not active", lambda said: told.append((said, reports.alerts[-1].level, reports.alerts[-1].alarm)))
    assert wait(lambda: told) == [((True, "not active"), Level.FAULT, True)]


def test_before_the_clock_runs_nothing_is_decided_nor_logged_and_at_its_first_time_what_was_heard_is(tmp_path):
    with DecisionLog(tmp_path, "0.1.0") as log:  # an earlier decision with a held level, which is valid for a long time
        before = decide(None, evidence(area(5000)), site(), NOW - S)
        log.decided(Decision(None, evidence(area(5000)), None, NOW - S, before), site())
    log, reports, clock = DecisionLog(tmp_path, "0.1.0"), DeskReports(), Clock()
    lines, clock.now = logged(tmp_path), 0
    desk = AlertDesk(site(), log, clock, reports)
    replies = []
    desk.forget("just activated", replies.append)
    desk.acknowledge("J. Meyer", "looks quiet", replies.append)
    desk.decide_on("wall", evidence(area(0)), RADAR)
    desk.tick()
    assert wait(lambda: len(replies) == 2 and replies) == [(True, NO_CLOCK), (False, NO_CLOCK)]
    wait(lambda: len(reports.hindrances) >= 3)
    assert set(reports.hindrances) == {NO_CLOCK} and not reports.alerts
    assert logged(tmp_path) == lines
    clock.now = NOW
    desk.tick()
    (alert,) = wait(lambda: reports.alerts)
    assert (alert.at_ns, alert.held, alert.faults) == (NOW, Level.EVACUATE, ())
    assert reports.hindrances[-1] == "" and logged(tmp_path) == lines + 1
    desk.tick()  # the decision was owed, but is not made again
    desk.acknowledge("", "", replies.append)
    wait(lambda: len(replies) == 3)
    assert len(reports.alerts) == 1
    assert desk.close(PATIENCE)


def logged(folder):
    """Return the number of lines of the decision log in a folder."""
    return sum(len(path.read_bytes().splitlines()) for _, path in files_in(folder))


def test_a_clock_that_goes_back_to_0_is_decided_on(desk):
    desk, reports, clock = desk
    desk.decide_on("wall", evidence(area(0)), RADAR)
    wait(lambda: reports.alerts)
    clock.now = 0
    desk.forget("the clock went back")
    wait(lambda: len(reports.alerts) == 2)
    assert reports.alerts[-1].level == Level.FAULT and not reports.hindrances


def test_a_topic_that_falls_silent_after_it_told_of_sources_is_a_fault_that_names_it_whoever_else_speaks(desk):
    desk, reports, clock = desk
    desk.decide_on("other wall", evidence(), OTHER)
    desk.decide_on("wall", evidence(), RADAR)
    assert decided(reports, 2).level == Level.NORMAL
    clock.now = NOW + 20 * S
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    assert decided(reports, 3).level == Level.NORMAL
    clock.now = NOW + 30 * S
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    alert = decided(reports, 4)
    assert (alert.level, alert.faults) == (
        Level.FAULT,
        (f"nothing has been received on {OTHER} for 32.000 s; {REMOVED}",),
    )
    desk.decide_on("nobody", nothing_seen(clock.now)._replace(at_ns=clock.now), RADAR)
    assert decided(reports, 5).faults == alert.faults, "that is what another radar sees"
    desk.decide_on("nobody", nothing_seen(clock.now)._replace(at_ns=clock.now), OTHER)
    assert decided(reports, 6).level == Level.NORMAL


def test_a_topic_that_told_of_other_sources_or_of_none_since_or_of_a_click_is_not_silent(desk):
    desk, reports, clock = desk
    desk.decide_on("wall", evidence(), OTHER)
    desk.decide_on("clicked", evidence(), "clicked_point")
    clock.now = NOW + 40 * S
    desk.decide_on("nobody", nothing_seen(NOW + 30 * S), OTHER)
    desk.decide_on("elsewhere", evidence(now=clock.now), RADAR)
    desk.decide_on("wall", evidence()._replace(at_ns=clock.now), OTHER)  # answered again, over new ground
    wait(lambda: len(reports.alerts) == 5)
    assert not any("nothing has been received" in fault for fault in reports.alerts[-1].faults)


def test_a_topic_that_saw_nothing_and_falls_silent_is_a_fault_too(desk):
    """No other topic reports the rocks that fall in the view of this sensor."""
    desk, reports, clock = desk
    desk.decide_on("nobody", nothing_seen(NOW), OTHER)
    desk.decide_on("nobody", nothing_seen(NOW), RADAR)
    assert decided(reports, 2).level == Level.NORMAL
    clock.now = NOW + 40 * S
    desk.decide_on("nobody", nothing_seen(clock.now)._replace(at_ns=clock.now), RADAR)
    alert = decided(reports, 3)
    assert alert.level == Level.FAULT
    assert alert.faults == (f"nothing has been received on {OTHER} for 40.000 s; {REMOVED}",)


def test_a_topic_that_is_expected_is_a_fault_until_it_is_heard():
    reports, clock = DeskReports(), Clock()
    desk = AlertDesk(site(), None, clock, reports, expected=(OTHER,))
    try:
        desk.decide_on("nobody", nothing_seen(NOW), RADAR)
        (fault,) = decided(reports, 1).faults
        assert fault == f"nothing has been received on {OTHER}, which must publish ({OPTIONAL})"
        desk.decide_on("nobody", nothing_seen(NOW), OTHER)
        assert decided(reports, 2).level == Level.NORMAL
        desk.forget("the node has just been activated")
        desk.decide_on("nobody", nothing_seen(NOW), RADAR)
        assert decided(reports, 4).level == Level.FAULT
    finally:
        assert desk.close(PATIENCE)


def test_neither_lost_evidence_nor_a_new_beginning_hides_a_topic_that_fell_silent(desk):
    desk, reports, clock = desk
    desk.decide_on("other wall", evidence(), OTHER)
    desk.lose("an answer failed")
    clock.now = NOW + 40 * S
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    assert OTHER in decided(reports, 3).faults[0]
    desk.forget("the node has just been activated")
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    assert OTHER in decided(reports, 5).faults[0]
    desk.decide_on("other wall", evidence(now=clock.now), OTHER)
    assert decided(reports, 6).faults == ()


def test_a_sensor_that_was_removed_is_a_fault_over_a_new_beginning_and_none_for_a_desk_that_is_made_anew(desk):
    desk, reports, _ = desk
    desk.decide_on("other wall", evidence(area(0)), OTHER)
    desk.forget("the node has just been activated")
    desk.decide_on("wall", evidence(area(0)), RADAR)
    (fault,) = decided(reports, 3).faults
    assert OTHER in fault and fault.endswith(REMOVED)
    again = DeskReports()
    configured = AlertDesk(site(), None, Clock(), again)
    try:
        configured.decide_on("wall", evidence(area(0)), RADAR)
        assert decided(again, 1).faults == ()
    finally:
        assert configured.close(PATIENCE)


def do_at_once(trigger, do):
    """Take the place of `Flyer.while_known` for a trigger that is not forgotten."""
    do()
    return True


def answer_reports(desk):
    """Return answer reports of one wall at NOW, which request decisions from a desk."""
    state = PresentState(
        desk=lambda: desk, region_of=lambda trigger: "wall", standing=lambda: None, watch_present=lambda: None,
        while_known=do_at_once,
    )  # fmt: skip
    outlets = MagicMock(now=lambda: NOW)
    return AnswerReports(SimpleNamespace(scene=SimpleNamespace(seed=1)), outlets, state)


def test_an_answer_that_fails_loses_evidence_and_forgets_no_topic():
    lost = []
    reports = answer_reports(SimpleNamespace(lose=lost.append))
    reports.failed(RuntimeError("broken"))
    assert lost == ["an answer failed: RuntimeError"]


def test_a_wall_whose_answer_failed_is_a_fault_whatever_is_answered_of_other_walls(desk):
    desk, reports, _ = desk
    trigger = trigger_of([(1.0, 1.0, 1.0)], [(0.0, 0.0, 0.0)], None, NOW - 3 * S, RADAR)
    answer_reports(desk).failed(RuntimeError("broken"), trigger)
    desk.decide_on("other wall", evidence(area(0)), OTHER)
    assert "an answer failed: RuntimeError" in decided(reports, 2).faults
    desk.decide_on("wall", evidence(area(0)), RADAR)
    assert decided(reports, 3).faults == ()


def test_an_answer_that_fails_for_one_wall_loses_no_danger_that_another_radar_sees(desk):
    desk, reports, _ = desk
    desk.decide_on("wall of the other", evidence(area(5000)), OTHER)
    trigger = trigger_of([(1.0, 1.0, 1.0)], [(0.0, 0.0, 0.0)], None, NOW - 3 * S, RADAR)
    answer_reports(desk).failed(RuntimeError("broken"), trigger)
    assert "an answer failed: RuntimeError" in decided(reports, 2).faults
    desk.decide_on("wall", evidence(area(0)), RADAR)
    alert = decided(reports, 3)
    assert (alert.evident, alert.faults) == (Level.EVACUATE, ())


@pytest.mark.parametrize("error", ["in an unknown answer", "in a decision"])
def test_after_an_error_every_topic_must_publish_again(desk, error):
    """An answer to an older message, such as a refinement, shows one wall; the evidence of the other walls is lost."""
    desk, reports, clock = desk
    desk.decide_on("dangerous wall", evidence(area(5000)), OTHER)
    desk.decide_on("wall", evidence(area(0)), RADAR)
    assert decided(reports, 2).evident == Level.EVACUATE
    lose_all(desk, reports, error)
    clock.now = NOW + S
    desk.decide_on("wall", evidence(area(0), now=clock.now), RADAR)
    assert OTHER in decided(reports, 4).faults[0], "its danger was forgotten"
    desk.decide_on("harmless wall", evidence(area(0))._replace(at_ns=clock.now), OTHER)  # answered again
    assert OTHER in decided(reports, 5).faults[0]
    desk.decide_on("dangerous wall", evidence(area(5000), now=clock.now), OTHER)
    alert = decided(reports, 6)
    assert (alert.evident, alert.faults) == (Level.EVACUATE, ())


@pytest.mark.parametrize("error", ["in an unknown answer", "in a decision"])
def test_a_click_that_an_error_lost_is_a_fault_until_it_would_be_too_old(desk, error):
    desk, reports, clock = desk
    desk.decide_on("clicked", evidence(area(5000)), BY_HAND)
    decided(reports, 1)
    lose_all(desk, reports, error)
    desk.decide_on("wall", evidence(area(0), now=NOW + S), RADAR)
    assert "a source clicked" in decided(reports, 3).faults[0]
    clock.now = NOW + 40 * S
    desk.decide_on("wall", evidence(area(0), now=clock.now), RADAR)
    assert decided(reports, 4).faults == ()


def test_where_the_clock_goes_back_after_an_error_earlier_stamps_count_again(desk):
    desk, reports, clock = desk
    desk.decide_on("clicked", evidence(area(0)), BY_HAND)
    desk.decide_on("wall", evidence(area(0)), RADAR)
    desk.lose("an answer failed")
    clock.now = NOW - 40 * S
    desk.forget("the clock went back")
    desk.decide_on("wall", evidence(area(0), now=clock.now), RADAR)
    assert decided(reports, 5).faults == ()


def lose_all(desk, reports, error):
    """Let the desk lose all evidence by an error, and check that the next decision is a fault.

    error : "in a decision" or "in an unknown answer"
    """
    count = len(reports.alerts)
    if error == "in a decision":
        reports.broken = True
        desk.standing.report("any", "so that it decides")
        wait(lambda: reports.errors)
        reports.broken = False
        desk.standing._sentences = {}
        desk.tick()
    else:
        desk.lose("an answer failed")
    assert "there is no evidence" in decided(reports, count + 1).faults[0]


def test_a_wall_that_found_no_room_is_a_fault_of_that_wall():
    told, pushed_out = [], SimpleNamespace()
    station = SimpleNamespace(
        flyer=SimpleNamespace(submit=lambda trigger: pushed_out), report_waiting=lambda: None,
        reports=SimpleNamespace(drop=lambda *about: told.append(about)), _places=None,
        _configuration=SimpleNamespace(parameters=SimpleNamespace(waiting_sources=3)),
    )  # fmt: skip
    station._queue = partial(Station._queue, station)
    Station.submit(station, SimpleNamespace(topic=RADAR))
    assert told == [(pushed_out, "more than 3 regions report sources at once: raise waiting_sources or region_size")]


def test_where_the_log_keeps_the_last_fault_waiting_the_alarm_is_the_last_word(monkeypatch):
    monkeypatch.setattr("rpf3d_ros.engine.station.LAST_FAULT", 0.01)
    outlets = MagicMock()
    decisions = DecisionReports(outlets, "map")
    station = MagicMock(decisions=decisions)
    Station.deactivate(station)
    outlets.alerts.sound_alarm.assert_called_once_with()
    decisions.decided(decide(None, evidence(), site(), NOW), evidence())
    outlets.alerts.publish.assert_not_called()


def test_a_decision_is_valid_until_the_first_topic_would_be_silent_whichever_has_sources():
    """A topic that sees nothing counts, too: if only the stamps of sources counted, its silence would show too late."""
    reports, clock = DeskReports(), Clock()
    desk = AlertDesk(site().model_copy(update={"valid_s": 120.0}), None, clock, reports)
    try:
        desk.decide_on("nobody", nothing_seen(NOW), OTHER)
        clock.now = NOW + 27 * S
        desk.decide_on("wall", evidence(now=clock.now), RADAR)
        alert = decided(reports, 2)
        assert (alert.level, alert.valid_until_ns) == (Level.NORMAL, NOW + 30 * S)
        clock.now = NOW + 30 * S + 1
        desk.tick()
        assert f"nothing has been received on {OTHER}" in decided(reports, 3).faults[0]
    finally:
        assert desk.close(PATIENCE)


def test_lost_messages_are_a_fault_until_what_they_reported_would_be_too_old_whatever_is_understood(desk):
    desk, reports, clock = desk
    desk.decide_on("wall", evidence(), RADAR)
    assert decided(reports, 1).level == Level.NORMAL
    desk.miss(RADAR, NOW)
    assert decided(reports, 2).faults == (f"messages on {RADAR} were lost 0.000 s ago, before they could be read",)
    clock.now = NOW + 30 * S
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    assert f"on {RADAR} were lost 30.000 s ago" in decided(reports, 3).faults[0]
    clock.now += 1
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    assert decided(reports, 4).faults == ()


@pytest.mark.parametrize(("now", "since"), [(NOW - 50 * S, 0), (NOW + 10 * S, 10)], ids=["clock", "activation"])
def test_lost_messages_stay_a_fault_when_the_clock_goes_back_or_the_node_is_activated_again(desk, now, since):
    """The lost messages raised no level, and the next message of the sensor may be about another wall."""
    desk, reports, clock = desk
    desk.decide_on("wall", evidence(), RADAR)
    desk.miss(RADAR, NOW)
    assert "were lost" in decided(reports, 2).faults[0]
    clock.now = now
    desk.forget("all sources received before are discarded")
    desk.decide_on("wall", evidence(now=now), RADAR)
    assert f"on {RADAR} were lost {since}.000 s ago" in decided(reports, 4).faults[0]
    clock.now = now + (30 - since) * S + 1
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    assert decided(reports, 5).faults == ()


def test_a_clock_that_is_wrong_for_one_decision_ends_no_loss_early(desk):
    desk, reports, clock = desk
    desk.decide_on("wall", evidence(), RADAR)
    desk.miss(RADAR, NOW)
    decided(reports, 2)
    clock.now = NOW - 3600 * S
    desk.tick()
    assert any(f"on {RADAR} were lost 0.000 s ago" in fault for fault in decided(reports, 3).faults)
    clock.now = NOW + 2 * S
    desk.forget("the clock went back")  # noticed only now
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    assert f"on {RADAR} were lost 2.000 s ago" in decided(reports, 5).faults[0]


def test_a_loss_that_is_over_is_no_fault_again_after_the_clock_went_back(desk):
    desk, reports, clock = desk
    desk.miss(RADAR, NOW)
    decided(reports, 1)
    clock.now = NOW + 31 * S
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    assert decided(reports, 2).faults == ()
    clock.now = NOW - 50 * S
    desk.forget("the clock went back")
    desk.decide_on("wall", evidence(now=clock.now), RADAR)
    assert decided(reports, 4).faults == ()


def test_new_evidence_waits_for_no_more_than_one_decision_however_often_areas_moved_before(desk):
    """Otherwise the desk would decide for each outline of a moving machine before it decides on the danger."""
    desk, reports, _ = desk
    desk.watch(lambda: {"ramp": "0"})
    desk.decide_on("wall", evidence(area(0, outline="0")), RADAR)
    decided(reports, 1)
    reports.hold.clear()
    desk.watch(lambda: {"ramp": "1"})
    wait(lambda: reports.reached == 2)
    for outline in range(2, 100):
        desk.watch(lambda outline=outline: {"ramp": str(outline)})
        desk.standing.report("inputs", f"message {outline} was refused")
    desk.decide_on("wall", evidence(area(5000, outline="99")), RADAR)
    for outline in range(100, 200):
        desk.watch(lambda outline=outline: {"ramp": str(outline)})
    reports.hold.set()
    wait(lambda: len(reports.alerts) >= 3)
    assert reports.alerts[2].evident == Level.EVACUATE
    serve_all(desk)
    assert len(reports.alerts) == 3, "it was made on the last outline"


def test_each_answer_has_a_decision_of_its_own_because_a_later_one_may_hide_its_danger(desk):
    desk, reports, _ = desk
    reports.hold.clear()
    desk.decide_on("wall", evidence(area(0)), RADAR)
    wait(lambda: reports.reached == 1)
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    desk.decide_on("wall", evidence(area(0)), RADAR)
    reports.hold.set()
    wait(lambda: len(reports.alerts) == 3)
    assert [alert.held for alert in reports.alerts] == [Level.NORMAL, Level.EVACUATE, Level.EVACUATE]


def test_sources_without_an_answer_are_one_decision_however_many_they_are(desk):
    desk, reports, _ = desk
    reports.hold.clear()
    desk.decide_on("wall", evidence(area(0)), RADAR)
    wait(lambda: reports.reached == 1)
    for number in range(100):
        desk.decide_on(number, evidence()._replace(areas=(), faults=(f"no answer to {number}",)), RADAR)
    reports.hold.set()
    serve_all(desk)
    assert len(reports.alerts) == 2
    assert {f"no answer to {number}" for number in range(100)} <= set(reports.alerts[1].faults)


def test_who_flies_rocks_can_wait_until_the_decisions_have_followed(desk):
    desk, reports, _ = desk
    reports.hold.clear()
    desk.decide_on("wall", evidence(area(0)), RADAR)
    assert desk.wait_for_room(PATIENCE)
    desk.decide_on("wall", evidence(area(0)), RADAR)
    assert not desk.wait_for_room(0.05)
    reports.hold.set()
    assert desk.wait_for_room(PATIENCE)


def test_evidence_that_waits_for_its_decision_for_long_is_told_of_too(desk, monkeypatch):
    """Each decision is written quickly enough, but several are written before this one."""
    monkeypatch.setattr(alert_desk, "LONGEST_WRITE", 0.05)
    desk, reports, _ = desk
    reports.hold.clear()
    desk.decide_on("wall", evidence(area(5000)), RADAR)
    wait(lambda: desk.tick() or reports.hangs)
    assert not reports.alerts
