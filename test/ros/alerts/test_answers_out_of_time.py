"""Tests of answers at an unusual time: after the clock went back, after a second click, or after a restart."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.alert_evidence import NOW, S, evidence, nothing_seen
from live_sites.answered_radar import DANGER, RADAR, A, B, Radar
from live_sites.watched_pit import start_with
from never_green.first_messages import AREA, NOTHING, PLAN, WHOLE, faults_after

from rpf3d_core.alerts.levels import Level
from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.alerts.checked_places import MOST_MESSAGES, Scans
from rpf3d_ros.alerts.source_topics import BY_HAND
from rpf3d_ros.engine import answer_reports
from rpf3d_ros.engine.answer_schedule import AnswerSchedule
from rpf3d_ros.engine.answered_sources import AnsweredSources
from rpf3d_ros.engine.before_start import BeforeStart
from rpf3d_ros.engine.waiting_sources import WaitingSources

OTHER = "radar2/sources"


@pytest.mark.parametrize("event", ["the clock goes back", "the node is deactivated"])
def test_an_answer_to_forgotten_sources_counts_for_nothing(monkeypatch, event):
    """The sources are forgotten after their rocks have flown, just before the alert desk receives the answer."""
    run = start_with(monkeypatch, PLAN)
    try:
        station, made = run.node.station, answer_reports.evidence_of_answer
        assert faults_after(run, WHOLE, AREA, NOTHING) == ()

        def late(*about):
            station.forget("the clock went back") if event == "the clock goes back" else station.deactivate()
            return made(*about)

        monkeypatch.setattr(answer_reports, "evidence_of_answer", late)
        assert faults_after(run, NOTHING._replace(sent=0.8, at=0.8))
    finally:
        run.node.close()


def click(radar, second):
    """Click place A at a time (s after NOW); return the function that answers the click with danger."""
    radar.now_ns = max(radar.now_ns, int(NOW + second * S))
    trigger = trigger_of(np.array([A]), np.zeros((1, 3)), None, int(NOW + second * S), BY_HAND)
    region = radar.region_of(trigger)
    radar.regions.clicked(region, trigger.stamp_ns)
    found = evidence(DANGER, trigger_stamp_ns=trigger.stamp_ns, sources=1)
    return lambda: radar.regions.note(region, BY_HAND, found._replace(at_ns=radar.now_ns))


def test_a_click_counts_until_a_later_click_at_the_same_place_is_answered():
    radar = Radar()
    radar.answer(*radar.send(0, B))
    click(radar, 0)()
    assert radar.alert().evident == Level.EVACUATE
    answer_again = click(radar, 29.5)
    radar.answer(*radar.send(30.5, B))
    radar.now_ns = NOW + 31 * S
    assert not radar.is_green, "the first click is 31 s old, the second has no answer"
    answer_again()
    assert radar.alert().evident == Level.EVACUATE
    radar.answer(*radar.send(59.0, B))
    radar.now_ns = NOW + 61 * S
    assert radar.is_green, "both clicks are too old"


def test_a_click_without_an_answer_keeps_an_earlier_click_only_until_it_is_too_old_itself():
    radar = Radar()
    radar.answer(*radar.send(0, B))
    click(radar, 0)()
    click(radar, 29.5)
    radar.answer(*radar.send(59.0, B))
    radar.now_ns = NOW + 61 * S
    assert radar.is_green


def test_a_topic_whose_only_message_had_no_answer_before_a_restart_must_publish_again():
    sensors = SimpleNamespace(poses=(RADAR,), clouds=(OTHER,))
    memory = {"heard": [], "dangers": [RADAR, "a topic that the node no longer has"]}
    configuration = SimpleNamespace(
        parameters=SimpleNamespace(sensors=sensors), log=SimpleNamespace(memory=memory), standing=None
    )
    assert BeforeStart(configuration).heard == [RADAR]


def failed_without_sources(stamp_ns, why):
    """Return evidence of an empty message whose answer failed."""
    return evidence(trigger_stamp_ns=stamp_ns, sources=0)._replace(areas=(), faults=(why,))


@pytest.mark.parametrize("sees", [True, False], ids=["the other topic sees a source", "nothing is seen"])
def test_an_empty_message_that_failed_is_a_fault_until_its_own_topic_is_answered(sees):
    radar, why = Radar(), "an answer failed: ValueError"
    radar.dangerous = set()
    radar.answer(*radar.send(0, B))
    radar.regions.note(frozenset({(OTHER,)}), OTHER, failed_without_sources(NOW, why))
    assert why in radar.alert().faults
    radar.answer(*(radar.send(1, B) if sees else radar.send(1)))
    assert why in radar.alert().faults, "only another topic has an answer"
    radar.regions.note(frozenset({(OTHER,)}), OTHER, nothing_seen(now=radar.now_ns)._replace(trigger_stamp_ns=NOW + S))
    assert why not in radar.alert().faults


def test_memory_is_limited_while_no_message_is_answered():
    scans = Scans()
    for stamp in range(3 * MOST_MESSAGES):
        scans.note(stamp, stamp - stamp % 2, "")
    assert len(scans.unreported_at) == MOST_MESSAGES and len(scans.last_parts) <= MOST_MESSAGES
    assert 3 * MOST_MESSAGES - 1 in scans.unreported_at
    schedule = AnswerSchedule(WaitingSources(50.0, 10), AnsweredSources(30.0, 40))
    for stamp in range(200):
        places = np.array([[100.0 * stamp, 0.0, 0.0]])
        schedule.submit(trigger_of(places, np.zeros((1, 3)), None, stamp, RADAR))
    assert len(schedule._interrupted) <= 40
