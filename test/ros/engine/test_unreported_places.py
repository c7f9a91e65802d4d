"""Tests of the places that a topic no longer reports: how long they count, when they are checked, when they end."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import numpy as np
from alert_evidence import FLOWN, NOW, S, area, evidence, site

from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.engine import unreported_places
from rpf3d_ros.engine.first_scans import FirstScans
from rpf3d_ros.engine.place_checks import PlaceChecks
from rpf3d_ros.engine.source_topics import BY_HAND
from rpf3d_ros.engine.unreported_evidence import UnreportedEvidence
from rpf3d_ros.engine.unreported_places import ReportedPlaces

RADAR = "radar/sources"
A, B, C = (0.0, 0.0, 10.0), (50.0, 0.0, 10.0), (90.0, 0.0, 10.0)
DANGER, HARMLESS = area(FLOWN // 2), area()


def message(second, *places, topic=RADAR):
    """Return the sources of a message with the stamp NOW + `second` seconds."""
    positions = np.array(places, dtype=float).reshape(-1, 3)
    return trigger_of(positions, np.zeros_like(positions), None, NOW + second * S, topic)


class Steady:
    """Passes messages to `ReportedPlaces` at the times of their stamps by the steady clock, unless `at` is given."""

    def __init__(self, period_s, distance):
        self.places = ReportedPlaces(period_s, distance)

    def received(self, trigger, is_suspect=False, at=None):
        now = (trigger.stamp_ns - NOW) / S if at is None else at
        return self.places.received(trigger, now, is_suspect)

    def __getattr__(self, name):
        return getattr(self.places, name)


def rows(trigger):
    return [] if trigger is None else [tuple(row) for row in trigger.positions.tolist()]


# --- with a scan period


def test_places_of_earlier_messages_count_until_the_scan_period_is_over():
    places = Steady(60.0, 2.0)
    assert rows(places.received(message(0, A)).trigger) == [A]
    assert rows(places.received(message(30, B)).trigger) == [A, B]
    assert rows(places.received(message(60)).trigger) == [A, B], "an empty message ends nothing by itself"
    assert rows(places.received(message(61)).trigger) == [B]
    assert rows(places.received(message(91)).trigger) == []


def test_a_place_that_is_reported_again_within_the_accuracy_of_the_sensor_counts_once_and_longer():
    places, moved = Steady(60.0, 2.0), (1.5, 0.0, 10.0)
    places.received(message(0, A))
    assert rows(places.received(message(30, moved)).trigger) == [moved]
    assert rows(places.received(message(90)).trigger) == [moved]
    above = (1.5, 0.0, 13.0)
    assert rows(places.received(message(90, above)).trigger) == [moved, above], "a place on a bench above is another"


def test_with_a_period_of_0_each_message_has_all_places_but_a_message_of_the_same_stamp_adds_to_it():
    places = Steady(0.0, 2.0)
    places.received(message(0, A))
    assert rows(places.received(message(0)).trigger) == [A]
    assert rows(places.received(message(1, B)).trigger) == [B]
    update = places.received(message(2))
    assert rows(update.trigger) == [] and update.unreported is None


def test_a_clock_that_jumps_ahead_ends_no_place():
    places = Steady(60.0, 2.0)
    places.received(message(0, A))
    assert rows(places.received(message(1000, B), at=60.0).trigger) == [A, B]
    assert rows(places.received(message(1001, B), at=61.0).trigger) == [B]


def test_size_and_velocity_of_an_earlier_place_are_kept():
    places = Steady(60.0, 2.0)
    places.received(trigger_of(np.array([A]), np.array([[1.0, 0.0, 0.0]]), np.array([0.7]), NOW, RADAR))
    whole = places.received(message(1, B)).trigger
    assert whole.velocities.tolist() == [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert whole.diameters[0] == 0.7 and np.isnan(whole.diameters[1])


def test_too_many_places_within_the_period_are_told(monkeypatch):
    monkeypatch.setattr(unreported_places, "MOST_IN_A_SCAN", 1)
    places = Steady(60.0, 2.0)
    places.received(message(0, A, B))
    assert "more than 1 places within evidence.scan_period_s" in places.received(message(1, C)).too_many


def test_the_first_scan_is_a_fault_until_it_is_complete_also_after_a_restart():
    scans = FirstScans(60.0)
    scans.note(RADAR, NOW, 0.0)
    scans.note(RADAR, NOW + 59 * S, 99.0)
    (fault,) = scans.faults()
    assert fault.startswith(f"the first scan of {RADAR} is not complete: the topic has been received for 59.000 s of")
    scans.note(RADAR, NOW + 99 * S, 59.0)
    assert scans.faults(), "the clock jumped ahead"
    scans.note(RADAR, NOW + 99 * S, 60.0)
    assert scans.faults() == ()
    scans.restart()
    scans.note(RADAR, NOW, 0.0)
    assert scans.faults()


def test_where_each_message_has_all_places_no_scan_is_awaited():
    for period in (None, 0.0):
        scans = FirstScans(period)
        scans.note(RADAR, NOW, 0.0)
        assert scans.faults() == ()


# --- without a scan period


def test_a_place_that_is_not_reported_any_more_is_checked_until_it_is_reported_again():
    places = Steady(None, 2.0)
    assert places.received(message(0, A)).unreported is None
    update = places.received(message(30, B))
    assert rows(update.trigger) == [B] and rows(update.unreported) == [A] and update.unreported.is_unreported
    assert update.last_ns == NOW
    assert places.received(message(60, B)).unreported is None, "the same places are not checked again"
    update = places.received(message(90, A, B))
    assert update.is_ended and update.unreported is None


def test_in_turns_the_place_of_the_other_turn_is_checked():
    places = Steady(None, 2.0)
    places.received(message(0, A))
    places.received(message(30, B))
    update = places.received(message(60, A))
    assert rows(update.unreported) == [B] and not update.is_ended


def test_an_empty_message_ends_unreported_places_unless_it_has_the_stamp_of_sources():
    places = Steady(None, 2.0)
    places.received(message(0, A))
    places.received(message(1, B))
    assert not places.received(message(1)).is_ended
    assert places.received(message(2)).is_ended
    update = places.received(message(3, C))
    assert update.unreported is None and not update.is_ended


def test_clicks_and_other_topics_end_and_check_nothing():
    places = Steady(None, 2.0)
    places.received(message(0, A))
    for topic in (BY_HAND, "other"):
        update = places.received(message(1, B, topic=topic))
        assert rows(update.trigger) == [B] and update.unreported is None
    assert places.received(message(2, C, topic=BY_HAND)).unreported is None


def test_harmless_places_are_forgotten_after_an_hour_and_suspect_ones_are_not():
    for is_suspect, kept in ((False, [B]), (True, [A, B])):
        places = Steady(None, 2.0)
        places.received(message(0, A))
        places.received(message(1, B))
        update = places.received(message(3602, C), is_suspect)
        assert rows(update.unreported) == kept


def test_of_too_many_places_the_oldest_are_forgotten_and_told_of_if_they_are_suspect(monkeypatch):
    monkeypatch.setattr(unreported_places, "MOST", 1)
    for is_suspect in (False, True):
        places = Steady(None, 2.0)
        places.received(message(0, A))
        places.received(message(1, B))
        update = places.received(message(2, C), is_suspect)
        assert rows(update.unreported) == [B] and bool(update.too_many) is is_suspect


def test_after_all_answers_were_forgotten_unreported_places_are_checked_again():
    places = Steady(None, 2.0)
    places.received(message(0, A))
    places.received(message(30, B))
    places.restart()
    assert rows(places.received(message(10, B)).unreported) == [A], "the clock may have gone back"


def test_places_are_remembered_for_a_restart_where_they_are_suspect():
    places = Steady(None, 2.0)
    places.received(message(0, A))
    places.received(message(1, B))
    assert places.to_remember(()) == {}
    saved = places.to_remember((RADAR,))
    assert saved == {RADAR: [[*A, 0.0, 0.0, 0.0, None], [*B, 0.0, 0.0, 0.0, None]]}
    again = Steady(None, 2.0)
    assert again.restore(saved, (RADAR,)) == ([RADAR], [])
    update = again.received(message(9, B), is_suspect=True)
    assert rows(update.unreported) == [A] and update.last_ns == 0
    assert Steady(None, 2.0).restore(saved, ("other",)) == ([], []), "a removed sensor"


def test_topics_with_too_many_places_to_remember_are_named(monkeypatch):
    monkeypatch.setattr(unreported_places, "REMEMBERED", 1)
    places = Steady(None, 2.0)
    places.received(message(0, A, B))
    saved = places.to_remember((RADAR,))
    assert saved == {"": [RADAR]}
    assert Steady(None, 2.0).restore(saved, (RADAR,)) == ([], [RADAR])


# --- the faults


def answered(second, *areas, **facts):
    """Return the evidence of an answer to a message with the stamp NOW + `second` seconds."""
    return evidence(*areas, trigger_stamp_ns=NOW + second * S, **facts)


@pytest.fixture
def checks():
    """Return checks in which a dangerous message at 0 s was answered, and a message at 30 s lacks its place."""
    made = UnreportedEvidence(site())
    made.note_reported(RADAR, answered(0, DANGER))
    made.expect(RADAR, NOW + 30 * S, 1, NOW)
    return made


def test_a_dangerous_place_is_a_fault_that_says_what_to_do(checks):
    checks.note(RADAR, answered(30, DANGER))
    (fault,) = checks.faults().values()
    assert fault.startswith(
        f"a place was reported by topic {RADAR} until 2027-01-15 08:00:00.000 UTC and is not reported any more; rocks "
        "from there may reach a limit of the site: look at the slope and acknowledge; or "
    )
    assert checks.suspects == (RADAR,)


def test_until_the_place_is_answered_the_message_without_it_is_a_fault_because_the_former_was_dangerous(checks):
    assert checks.faults() == {}, "the answer to the dangerous message still counts"
    checks.note_reported(RADAR, answered(30, HARMLESS))
    assert checks.faults()
    checks.note(RADAR, answered(30, HARMLESS))
    assert checks.faults() == {}


def test_a_harmless_place_is_no_fault_until_later_terrain_makes_it_dangerous(checks):
    checks.note(RADAR, answered(30, HARMLESS))
    checks.note_reported(RADAR, answered(30, HARMLESS))
    assert checks.faults() == {} and len(checks.parts()) == 1
    checks.note(RADAR, answered(30, DANGER))
    assert checks.faults()


def test_rocks_that_left_or_were_cut_off_may_reach_a_limit(checks):
    checks.note(RADAR, answered(30, area(left=FLOWN // 2)))
    assert checks.faults()
    checks.note_reported(RADAR, answered(30, HARMLESS))
    checks.note(RADAR, answered(30, HARMLESS))
    assert checks.faults() == {}
    checks.note(RADAR, answered(30, HARMLESS, unfinished=FLOWN // 10))
    assert checks.faults()


def test_a_small_answer_ends_no_fault_and_may_begin_one(checks):
    checks.note(RADAR, answered(30, DANGER))
    checks.note_reported(RADAR, answered(30, HARMLESS))
    checks.note(RADAR, answered(30, area(flown=50)))
    assert checks.faults()
    checks.expect(RADAR, NOW + 60 * S, 1, NOW)
    checks.note(RADAR, answered(60, area(25, flown=50)))
    assert checks.faults()


def test_a_place_that_is_reported_again_ends_the_fault_only_when_its_message_is_answered(checks):
    checks.note(RADAR, answered(30, DANGER))
    checks.note_reported(RADAR, answered(30, HARMLESS))
    checks.end(RADAR, NOW + 60 * S)
    assert checks.faults()
    checks.note_reported(RADAR, answered(60, DANGER))
    assert checks.faults() == {}
    checks.note(RADAR, answered(30, DANGER))
    assert checks.faults() == {}, "a late answer to the places as they were before"


def test_the_fault_of_one_part_stands_until_the_next_part_is_judged(checks):
    checks.note(RADAR, answered(30, DANGER))
    checks.note_reported(RADAR, answered(30, HARMLESS))
    checks.expect(RADAR, NOW + 60 * S, 1, NOW + 30 * S)  # the first place is reported again, the other is not
    checks.note(RADAR, answered(60, HARMLESS))
    assert checks.faults(), "the message that reports the dangerous place again is not answered"
    checks.note_reported(RADAR, answered(60, DANGER))
    assert checks.faults() == {}


def test_an_acknowledgement_ends_the_fault_at_once(checks):
    checks.note(RADAR, answered(30, DANGER))
    checks.end(RADAR)
    assert checks.faults() == {}


def test_an_answer_that_failed_is_a_fault_and_places_without_ground_are_none(checks):
    nothing = answered(30)._replace(areas=())
    checks.note(RADAR, nothing._replace(faults=("an answer failed: MemoryError",)))
    assert "rocks from there could not be simulated" in checks.faults()[RADAR] and checks.is_failed(RADAR)
    checks.note_reported(RADAR, answered(30, HARMLESS))
    checks.note(RADAR, nothing)
    assert checks.faults() == {} and not checks.is_failed(RADAR)


def test_forgotten_or_lost_answers_leave_the_fault_until_the_places_are_judged_again(checks):
    checks.note(RADAR, answered(30, DANGER))
    checks.forget()
    assert checks.faults()
    checks.expect(RADAR, NOW + 5 * S, 1, NOW)
    checks.note_reported(RADAR, answered(5, HARMLESS))
    assert checks.faults()
    checks.note(RADAR, answered(5, HARMLESS))
    assert checks.faults() == {}
    checks.lose()
    assert checks.faults() and checks.is_failed(RADAR)


def test_what_was_dangerous_before_a_restart_is_a_fault_until_it_is_judged():
    checks = UnreportedEvidence(site())
    checks.suspect(RADAR)
    checks.expect(RADAR, NOW, 1, 0)
    checks.note_reported(RADAR, answered(0, HARMLESS))
    start = f"a place was reported by topic {RADAR} before the start of the node and is"
    assert checks.faults()[RADAR].startswith(start)


# --- places and faults together


def place_checks(period=None, **site_facts):
    thresholds = site(scan_period_s=period)
    if site_facts:
        thresholds = type(thresholds).model_validate({**thresholds.model_dump(), **site_facts})
    told, ended = {}, []
    checks = UnreportedEvidence(thresholds)
    return PlaceChecks(thresholds, 2.0, checks, told.__setitem__, ended.append), checks, told, ended


def test_a_message_gives_the_unreported_places_then_its_sources():
    one, checks, _, ended = place_checks()
    one.submitted(message(0, A))
    unreported, sources = one.submitted(message(30, B))
    assert rows(unreported) == [A] and unreported.is_unreported and rows(sources) == [B]
    assert [rows(each) for each in one.submitted(message(60, A, B))] == [[A, B]] and ended == [RADAR]
    assert checks.faults() == {}


def test_two_persons_must_acknowledge_where_the_site_wants_two():
    one, checks, _, _ = place_checks(acknowledge={"persons": 2})
    one.submitted(message(0, A))
    one.submitted(message(30, B))
    checks.note(RADAR, answered(30, DANGER))
    assert one.acknowledged("C. Shift", ()) == (), "the fault was not shown to this person"
    assert one.acknowledged("A. Shift", checks.faults().values()) == () and checks.faults()
    assert one.acknowledged("A. Shift", checks.faults().values()) == () and checks.faults()
    assert one.acknowledged("B. Shift", checks.faults().values()) == (RADAR,) and checks.faults() == {}
    assert len(one.submitted(message(60, B))) == 1, "an acknowledged place is not checked again"


def test_forgotten_places_are_a_fault_until_an_empty_message_or_an_acknowledgement(monkeypatch):
    monkeypatch.setattr(unreported_places, "MOST", 1)
    for ends in (lambda one: one.submitted(message(9)), lambda one: one.acknowledged("A. Shift", ())):
        one, checks, told, _ = place_checks()
        checks.suspect(RADAR)
        for second, place in enumerate((A, B, C)):
            one.submitted(message(second, place))
        (fault,) = told.values()
        assert fault.startswith(f"{RADAR} had reported more than 1 places that it reports no longer")
        ends(one)
        assert list(told.values()) == [""]
