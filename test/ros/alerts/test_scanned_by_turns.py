"""Tests of a radar that scans wall after wall on one topic, each in its own message, on a node without a network."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import numpy as np
from live_sites.watched_pit import shown_at
from never_green import pit
from never_green.combination import Run
from never_green.plan import Plan, Send, Speaker, Truth
from never_green.stories import CLICK, RADAR_A, patch_send, survey

BANK_REMOVED = 7.0
TRUTH = Truth(sources=(), bank_until=BANK_REMOVED, areas=(pit.outline(pit.ROAD),) * 2, area_since=0.0)
TOPICS = (RADAR_A, CLICK, "terrain/points", "terrain/update", "areas/polygon")
PLAN = Plan(
    truth=TRUTH, sends=(), speakers=tuple(Speaker(topic=topic, number=0) for topic in TOPICS), sensors=(RADAR_A,),
    limits="evacuate", expects=True,
)  # fmt: skip
DANGEROUS, HARMLESS = pit.placed(10.0, 20.0, 31.0), pit.placed(62.0, 20.0, 0.5)
SHELTERED = pit.placed(10.0, 60.0, 31.0)


@pytest.fixture
def started():
    """Yield a function that starts a node with the terrain and the area; close the last node afterwards."""
    runs = []

    def start(scan_period=None, **of_plan):
        run = Run(PLAN._replace(scan_period=scan_period, **of_plan))
        runs.append(run)
        run.deliver(Send(sent=0.1, at=0.1, topic="terrain/points", kind="grid", places=survey(TRUTH, 0.1)))
        outline(run, 0.2, pit.ROAD)
        return run

    yield start
    runs[-1].close()


def outline(run, at, corners):
    run.deliver(Send(sent=at, at=at, topic="areas/polygon", kind="polygon", places=pit.outline(corners)))


def report(run, at, *places):
    run.deliver(Send(sent=at, at=at, topic=RADAR_A, kind="poses", places=np.array(places).reshape(-1, 3)))
    run.node.tick()


def survey_with_a_hole(run):
    """Publish a survey with a hole at the place SHELTERED."""
    hole = survey(TRUTH, 4.0).copy()
    hole[28:33, 3:8] = np.nan
    run.deliver(Send(sent=4.0, at=4.0, topic="terrain/points", kind="grid", places=hole))


def faults_from_before_the_start(run):
    """Report the area and a harmless source after a restart at 3 s; return the faults of places from before it."""
    outline(run, 3.2, pit.ROAD)
    report(run, 3.5, HARMLESS)
    return [each for each in faults(run) if "before the start of the node" in each]


def faults(run):
    return run.node.station.desk.alert.faults


def evident(run):
    return "fault" if faults(run) else run.node.station.desk.alert.evident.word


def test_without_a_scan_period_a_dangerous_place_that_is_missing_in_a_message_is_a_fault(started):
    run = started()
    report(run, 0.5, DANGEROUS)
    assert evident(run) == "evacuate"
    report(run, 2.5, HARMLESS)
    (fault,) = faults(run)
    assert fault.startswith(f"topic {RADAR_A} no longer reports the place at (") and "scan_period_s" in fault
    report(run, 4.5, DANGEROUS)
    assert evident(run) == "evacuate", "it is reported again"
    report(run, 6.5, HARMLESS)
    assert evident(run) == "fault"
    report(run, 8.5)
    assert evident(run) == "normal", "an empty message: there is no source"


def test_an_acknowledgement_ends_the_fault_but_lowers_no_level(started):
    run = started()
    report(run, 0.5, DANGEROUS)
    report(run, 2.5, HARMLESS)
    done, sentence = run.node.station.acknowledged("A. Shift: looked at the wall")
    assert not done and sentence.endswith(f"the faults of places that {RADAR_A} no longer reports have ended")
    run.node.settle()
    assert faults(run) == () and run.node.station.desk.alert.held.word == "evacuate"
    report(run, 4.5, HARMLESS)
    assert faults(run) == ()


def test_a_harmless_place_that_is_missing_is_no_fault_and_is_not_published_as_an_answer(started):
    run = started()
    report(run, 0.5, HARMLESS, SHELTERED)
    assert evident(run) == "normal"
    report(run, 2.5, HARMLESS)
    assert evident(run) == "normal"


def test_a_missing_place_is_a_fault_when_the_terrain_or_an_area_makes_it_dangerous(started):
    run = started()
    report(run, 0.5, HARMLESS, SHELTERED)
    for at in (2.5, 4.5, 6.5):  # then the first message is too old
        report(run, at, HARMLESS)
    assert evident(run) == "normal"
    run.deliver(patch_send(TRUTH, BANK_REMOVED, ((32.0, 48.0), (40.0, 80.0))))
    assert shown_at(run, BANK_REMOVED + 0.5) == "fault" and "no longer reports" in faults(run)[0]
    outline(run, 8.0, ((60.0, 2.0), (70.0, 2.0), (70.0, 4.0), (60.0, 4.0)))
    report(run, 8.5, HARMLESS)
    assert evident(run) == "normal"
    outline(run, 9.0, pit.ROAD)
    assert evident(run) == "fault"


def test_with_a_scan_period_places_of_earlier_messages_are_simulated_until_it_ends(started):
    run = started(scan_period=3.0)
    report(run, 0.5, DANGEROUS)
    report(run, 2.5, HARMLESS)
    assert "the first scan of" in faults(run)[0]
    report(run, 3.5)
    assert evident(run) == "evacuate", "an empty message ends no place of another wall"
    report(run, 4.5, HARMLESS)
    assert evident(run) == "normal", "the place was not reported for 3 s"


def test_with_a_scan_period_of_0_each_message_is_the_whole_scan(started):
    run = started(scan_period=0.0)
    report(run, 0.5, DANGEROUS)
    report(run, 2.5, HARMLESS)
    assert evident(run) == "normal"


def test_a_click_is_no_place_of_a_scan(started):
    run = started()
    run.deliver(Send(sent=0.4, at=0.4, topic=CLICK, kind="point", places=DANGEROUS[None]))
    report(run, 0.5, HARMLESS)
    assert evident(run) == "evacuate"
    assert shown_at(run, 1.0) == "evacuate" and faults(run) == ()


@pytest.mark.parametrize("is_missing_before", [True, False])
def test_after_a_restart_a_missing_place_is_a_fault_too(started, is_missing_before):
    run = started(restart_at=3.0)
    report(run, 0.5, DANGEROUS)
    if is_missing_before:
        report(run, 2.5, HARMLESS)
    run.at = 3.0
    run.restart()
    assert faults_from_before_the_start(run)
    report(run, 4.5, HARMLESS, DANGEROUS)
    assert evident(run) == "evacuate"


def test_after_the_clock_went_back_a_missing_place_is_still_a_fault(started):
    run = started()
    report(run, 0.5, DANGEROUS)
    report(run, 2.5, HARMLESS)
    run.node.station.forget("the clock went back")
    run.node.settle()
    report(run, 4.5, HARMLESS)
    assert evident(run) == "fault" and "no longer reports" in faults(run)[0]


def test_a_hole_in_the_ground_at_a_missing_place_is_a_fault_that_an_acknowledgement_ends(started):
    run = started()
    report(run, 0.5, HARMLESS, SHELTERED)
    report(run, 2.5, HARMLESS)
    assert evident(run) == "normal"
    survey_with_a_hole(run)
    report(run, 4.5, HARMLESS)
    (fault,) = [each for each in faults(run) if "no longer reports" in each]
    assert "could not be simulated (" in fault
    run.node.station.acknowledged("A. Shift: the bench was mined")
    run.node.settle()
    report(run, 6.5, HARMLESS)
    assert not [each for each in faults(run) if "no longer reports" in each]


def test_ground_above_a_missing_place_is_a_fault(started):
    run = started()
    report(run, 0.5, HARMLESS, SHELTERED)
    report(run, 2.5, HARMLESS)
    raised = survey(TRUTH, 4.0).copy()
    raised[26:35, 2:9, 2] += 6.0
    run.deliver(Send(sent=4.0, at=4.0, topic="terrain/points", kind="grid", places=raised))
    report(run, 4.5, HARMLESS)
    assert [each for each in faults(run) if "could not be simulated (" in each]


def test_a_place_that_cannot_be_simulated_is_a_fault_at_all_times_while_messages_arrive(started):
    run = started()
    report(run, 0.5, HARMLESS, SHELTERED)
    report(run, 2.5, HARMLESS)
    survey_with_a_hole(run)
    levels = []
    run.node.station.desk._listener.decided = lambda alert, evidence: levels.append(alert.faults)
    for at in np.arange(4.5, 8.0, 0.25).tolist():
        report(run, at, HARMLESS)
    told = [any("no longer reports" in fault for fault in each) for each in levels]
    assert told and all(told), "no decision in between is without this fault"


@pytest.mark.parametrize("is_missing_before", [True, False])
def test_after_a_pause_of_the_node_and_a_restart_a_missing_place_is_still_a_fault(started, is_missing_before):
    run = started(restart_at=3.0)
    report(run, 0.5, DANGEROUS)
    if is_missing_before:
        report(run, 2.5, HARMLESS)
    station = run.node.station
    station.deactivate()
    station.activate()
    run.node.settle()
    run.at = 3.0
    run.restart()
    assert faults_from_before_the_start(run)


def test_after_two_restarts_without_a_message_between_a_missing_place_is_still_a_fault(started):
    run = started(restart_at=3.0)
    report(run, 0.5, DANGEROUS)
    report(run, 2.5, HARMLESS)
    for run.at in (3.0, 3.1):
        run.restart()
    assert faults_from_before_the_start(run)


def test_with_a_scan_period_longer_than_the_age_of_sources_a_refused_message_is_a_fault_for_the_period(started):
    run = started(scan_period=10.0)

    def shown_after_reports_until(end):
        shown = set()
        while run.at < end:
            at = run.at + 2.0
            run.deliver(Send(sent=at, at=at, topic="terrain/points", kind="grid", places=survey(TRUTH, at)))
            report(run, at, HARMLESS)
            shown.add(evident(run))
        return shown

    shown_after_reports_until(14.0)
    assert evident(run) == "normal"
    run.deliver(Send(sent=15.0, at=15.0, topic=RADAR_A, kind="poses", places=DANGEROUS[None], frame="nowhere"))
    assert shown_after_reports_until(25.0) == {"fault"}, "the refused message was about a wall with its turn later"
    assert shown_after_reports_until(27.0) == {"normal"}


def test_after_a_sensor_was_silent_its_first_scan_is_awaited_again(started):
    run = started(scan_period=3.0)
    for at in np.arange(0.5, 5.0, 1.0).tolist():
        report(run, at, DANGEROUS if at < 3.0 else HARMLESS)
    report(run, 13.0, HARMLESS)
    (fault,) = [each for each in faults(run) if "first scan" in each]
    assert f"the first scan of {RADAR_A} after a pause of 8.500 s is not complete" in fault
