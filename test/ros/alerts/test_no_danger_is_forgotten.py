"""Tests that a danger stays a level or a fault until all places of its topic are answered without danger.

The tests use the real checks, regions and queue; only the answers are made by hand.
"""

import random

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.alert_evidence import NOW, S, area, evidence
from live_sites.answered_radar import FAR, RADAR, A, B, C, D, Radar

from rpf3d_core.alerts.levels import Level
from rpf3d_ros.alerts import unreported_places
from rpf3d_ros.alerts.place_checks import CAUSE


@pytest.fixture
def radar():
    """Return a radar that has reported the dangerous place A, which is answered."""
    made = Radar()
    made.answer(*made.send(0, A))
    return made


@pytest.fixture
def harmless():
    """Return a radar that has reported A while A is harmless; this message is answered."""
    made = Radar()
    made.dangerous = set()
    made.answer(*made.send(0, A))
    return made


def test_a_stamp_that_is_used_again_after_a_step_back_of_the_clock_loses_no_place(radar):
    radar.forget()
    radar.answer(*radar.send(0, B))
    assert not radar.is_green
    radar.answer(*radar.send(1, B))
    assert not radar.is_green and A in [tuple(row[:3]) for row in radar.places.to_remember()["places"][RADAR]]


def test_a_message_that_waits_in_vain_between_the_danger_and_the_message_without_it_hides_nothing(radar):
    radar.send(1, A, B)  # a later message takes its place in the queue
    unreported, sources = radar.send(2, B)
    radar.answer(sources)
    assert not radar.is_green, "the answer to A is missing"
    radar.dangerous = set()
    radar.answer(unreported)
    assert radar.is_green, "all places are answered, without danger"


def test_the_danger_of_unreported_places_lasts_until_the_message_that_reports_them_again_is_answered(radar):
    radar.answer(*radar.send(1, A, D))
    _, sources = radar.send(2, B)
    radar.answer(sources)
    (unreported, again) = radar.send(3, A, B)
    radar.answer(unreported)  # D, harmless
    assert not radar.is_green, "A is in no answer"
    radar.answer(again)
    assert radar.alert().evident > Level.NORMAL


def test_the_same_holds_for_parts_of_one_scan(radar):
    radar.answer(*radar.send(1, A, D))
    radar.answer(*radar.send(2, B))
    unreported, again = radar.send(2, A)
    radar.answer(unreported)
    assert not radar.is_green
    radar.answer(again)
    assert radar.alert().evident > Level.NORMAL


def test_a_late_answer_that_shows_danger_is_a_fault_until_the_next_message_is_answered(harmless):
    unreported, sources = harmless.send(1, B)
    harmless.answer(sources)
    (again,) = harmless.send(2, A, B)
    harmless.dangerous = {A}  # the terrain has changed
    harmless.answer(unreported)
    assert not harmless.is_green
    harmless.answer(again)
    assert harmless.alert().evident > Level.NORMAL


@pytest.mark.parametrize("is_new_start", [False, True])
def test_an_empty_first_part_hides_no_danger_of_places_before_it(radar, is_new_start):
    if is_new_start:
        radar = Radar(radar.places.to_remember())
    else:  # dangerous only since it is not reported any more
        radar.dangerous = set()
        radar.answer(*radar.send(1, A), *(triggers := radar.send(2, B)))
        radar.dangerous = {A}
        radar.answer(triggers[0])
    radar.answer(*radar.send(3))
    unreported, sources = radar.send(3, C)
    radar.answer(sources)
    assert not radar.is_green
    radar.answer(unreported)
    assert not radar.is_green


@pytest.mark.parametrize("empty", [1, 2])
def test_a_fault_of_forgotten_places_returns_after_any_number_of_empty_parts(radar, empty, monkeypatch):
    monkeypatch.setattr(unreported_places, "MOST", 1)
    for second, place in enumerate((B, C, D), start=1):
        radar.send(second, place)
    assert radar.standing[CAUSE.format(RADAR)]
    for _ in range(empty):
        radar.send(4)
    assert not radar.standing[CAUSE.format(RADAR)]
    monkeypatch.setattr(unreported_places, "MOST", 1000)  # so that the next message causes no fault by itself
    radar.send(4, B)
    assert radar.standing[CAUSE.format(RADAR)]


@pytest.mark.parametrize("empty", [1, 2])
def test_empty_parts_before_and_after_a_step_back_of_the_clock_hide_no_danger(radar, empty):
    radar.answer(*radar.send(2))
    radar.forget()
    for _ in range(empty - 1):
        radar.answer(*radar.send(2))
    radar.answer(*radar.send(2, C))
    assert not radar.is_green


def test_messages_between_a_step_back_of_the_clock_and_its_decision_count(radar):
    radar.places.restart()
    late = [*radar.send(11, B), *radar.send(12, A, B)]
    radar.regions.forget(radar.now_ns)  # on another thread, later
    radar.answer(*(each for each in late if each.stamp_ns == NOW + 11 * S))
    assert not radar.is_green, "A is reported, and not answered"


def test_a_fault_ends_after_a_step_back_of_the_clock_once_all_is_answered(radar):
    radar.dangerous = set()
    radar.answer(*radar.send(3600, A, B))
    radar.now_ns = NOW
    radar.forget()
    radar.answer(*radar.send(1, A, B))
    assert radar.is_green


def test_with_whole_scans_a_part_that_is_received_but_not_answered_is_a_fault():
    radar = Radar(period=0.0)
    radar.answer(*radar.send(0, A))
    first = radar.send(1, B)
    further = radar.send(1, A)
    radar.answer(*first)
    assert not radar.is_green
    radar.answer(*further)
    assert radar.alert().evident > Level.NORMAL


def test_places_that_are_sent_twice_are_expected_once(harmless):
    unreported, _ = harmless.send(1, B)
    harmless.checks.expect(unreported, NOW)
    harmless.answer(unreported)
    harmless.now_ns += 100 * S
    assert harmless.checks.faults() == {}


def test_the_fault_names_unreported_places_only_while_they_are_not_answered(radar):
    radar.answer(*radar.send(1, A, D))
    _, sources = radar.send(2, B)
    radar.answer(sources)
    unreported, _ = radar.send(3, A, B)
    assert "no longer reports the place at (30.0, 0.0, 10.0)" in radar.checks.faults()[RADAR]
    radar.answer(unreported)
    assert radar.checks.faults()[RADAR].startswith(f"topic {RADAR}: danger was possible, and its newest sources are")


def test_an_answer_from_before_the_first_area_is_a_fault_although_other_regions_are_answered_with_it():
    radar, before = Radar(), evidence(trigger_stamp_ns=NOW)._replace(areas=())
    radar.regions.note(radar.region_of(*radar.send(0, A)), RADAR, before)
    radar.regions.watch({"ramp": "ab" * 32}, None, NOW + S)
    later = evidence(area(outline="ab" * 32), trigger_stamp_ns=NOW + S, at_ns=NOW + 2 * S)
    radar.regions.note(radar.region_of(*radar.send(1, FAR)[-1:]), "other", later)
    radar.now_ns = NOW + 10 * S
    assert "ramp" in " ".join(radar.alert().faults)


def test_many_harmless_places_behind_an_empty_first_part_are_no_fault(monkeypatch):
    monkeypatch.setattr(unreported_places, "MOST", 1)
    radar = Radar()
    radar.dangerous = set()
    for second in range(4):
        radar.answer(*radar.send(second))
        for part in ((A, B), (C, D)):
            radar.answer(*radar.send(second, *part))
            assert radar.is_green


def test_an_acknowledgement_of_a_place_that_is_reported_again_waits_for_its_answer(radar):
    radar.answer(*radar.send(1, B))
    faults = radar.alert().faults
    (again,) = radar.send(2, A, B)
    radar.places.acknowledged("A. Shift", faults)
    assert not radar.is_green
    radar.answer(again)
    assert radar.alert().evident > Level.NORMAL


def test_after_an_acknowledgement_the_next_messages_cause_no_fault(radar):
    radar.answer(*radar.send(1, B))
    radar.places.acknowledged("A. Shift", radar.alert().faults)
    assert radar.is_green
    sources = radar.send(2, B)
    assert radar.is_green
    radar.answer(*sources)
    assert radar.is_green


def history(seed, parts, goes_back):
    """Yield after each of 60 random steps whether A was answered as dangerous, and the radar.

    parts : probability that a message is a further part of a scan; goes_back : True if the clock may go back
    """
    chance, radar = random.Random(seed), Radar()
    second, flying, is_known = 0, None, False
    for _ in range(60):
        kind = chance.random()
        if kind < 0.5:
            second += chance.random() >= parts
            places = [place for place in (A, B, C, D, FAR) if chance.random() < 0.4] or [B]  # none would end danger
            for trigger in radar.send(second, *places):
                radar.schedule.submit(trigger)
        elif kind < 0.97 or not goes_back:
            if flying is None and radar.schedule.has_next and (flying := radar.schedule.next_trigger()) is not None:
                radar.schedule.begin(flying, True)
            if flying is not None and chance.random() < 0.7:
                radar.schedule.progress(flying, True)
                radar.answer(flying)
                is_known = is_known or A in map(tuple, flying.positions.tolist())
                flying = None
        else:
            second -= chance.choice((0, 1, 1))
            radar.now_ns, flying = NOW + second * S, None
            radar.schedule.forget()
            radar.forget()
        yield is_known, radar


@pytest.mark.parametrize("goes_back", [False, True])
@pytest.mark.parametrize("parts", [0.0, 0.5])
@pytest.mark.parametrize("seed", range(25))
def test_no_random_messages_and_answers_hide_a_danger_that_was_shown(seed, parts, goes_back):
    for is_known, radar in history(seed, parts, goes_back):
        assert not is_known or not radar.is_green
