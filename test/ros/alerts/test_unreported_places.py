"""Tests of the places that a topic no longer reports: how long they count, when they are checked, when they end."""

import time
from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import numpy as np
from live_sites.alert_evidence import FLOWN, NOW, S, area, evidence, site

from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.alerts import checked_places, unreported_places
from rpf3d_ros.alerts import place_checks as place_checks_module
from rpf3d_ros.alerts.first_scans import FirstScans
from rpf3d_ros.alerts.place_checks import PlaceChecks
from rpf3d_ros.alerts.source_topics import BY_HAND, SourceTopics
from rpf3d_ros.alerts.unreported_evidence import UnreportedEvidence
from rpf3d_ros.alerts.unreported_places import ReportedPlaces, is_near

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


@pytest.mark.parametrize("period_s", [0.0, 60.0, None])
def test_a_part_of_a_scan_replaces_no_source_of_another_part(period_s):
    """The second part has a source 1 m from a source of the first part, at rest instead of thrown."""
    places, near = Steady(period_s, 2.0), (1.0, 0.0, 10.0)
    thrown = trigger_of(np.array([A]), np.array([[9.0, 0.0, 0.0]]), None, NOW, RADAR)
    places.received(thrown)
    both = places.received(message(0, near))
    assert rows(both.trigger) == [A, near] and both.trigger.velocities[0, 0] == 9.0 and both.unreported is None
    assert rows(places.received(message(0, near)).trigger) == [A, near], "a message that is sent twice adds nothing"
    later = places.received(message(1, near))
    assert rows(later.trigger) == [near] and later.unreported is None, "a later scan replaces the earlier one"


def test_without_a_scan_period_too_many_places_of_one_stamp_are_told(monkeypatch):
    monkeypatch.setattr(unreported_places, "MOST_IN_A_SCAN", 1)
    places = Steady(None, 2.0)
    places.received(message(0, A, B))
    update = places.received(message(0, C))
    assert update.too_many == "more than 1 places" and rows(update.trigger) == [B, C]
    one, _, told, _ = place_checks()
    for place in (A, B, C):
        one.submitted(message(1, place))
    assert "has reported more than 1 places in messages with one stamp" in told[f"places: {RADAR}"]


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
    assert places.received(message(1, C)).too_many == "more than 1 places"


def test_the_first_scan_is_a_fault_until_it_is_complete_also_after_a_restart():
    scans = FirstScans(60.0, silent_s=90.0)
    scanned(scans, 0, 0.0)
    scanned(scans, 59, 99.0)
    (fault,) = scans.faults()
    assert fault.startswith(f"the first scan of {RADAR} is not complete: the topic has been received for 59.000 s of")
    scanned(scans, 99, 59.0)
    assert scans.faults(), "the clock jumped ahead"
    scanned(scans, 99, 60.0)
    assert scans.faults() == ()
    scans.restart()
    scanned(scans, 0, 0.0)
    assert scans.faults()


def test_where_answers_take_longer_than_the_scan_period_the_first_scan_is_complete_with_the_first_answer_after_it():
    scans = FirstScans(3.0, silent_s=90.0)
    for second in range(8):
        scans.received(RADAR, NOW + second * S, float(second))
    scans.answered(RADAR, NOW + 2 * S)
    assert scans.faults() == (f"the first scan of {RADAR} is not complete: its sources have no answer yet",)
    scans.answered(RADAR, NOW + 7 * S)
    assert scans.faults() == ()


def test_an_answer_from_before_a_restart_completes_no_scan():
    scans = FirstScans(3.0, silent_s=90.0)
    scanned(scans, 1000, 0.0)
    scans.restart()
    scans.answered(RADAR, NOW + 1000 * S)
    scans.received(RADAR, NOW, 1.0)
    scans.answered(RADAR, NOW + 1000 * S)
    assert scans.faults()


def scanned(scans, second, now_s):
    """Note a message that is answered immediately."""
    scans.received(RADAR, NOW + second * S, now_s)
    scans.answered(RADAR, NOW + second * S)


@pytest.mark.parametrize(("silent_s", "pause"), [(90.0, 61), (20.0, 21)])
def test_after_a_pause_of_its_topic_a_scan_begins_again(silent_s, pause):
    scans = FirstScans(60.0, silent_s)
    for second in (*range(0, 70, 10), 60 + pause - 1):
        scanned(scans, second, float(second))
    assert scans.faults() == ()
    again = 60 + pause - 1 + pause
    scanned(scans, again, float(again))
    (fault,) = scans.faults()
    assert fault.endswith("if the sensor pauses so long in each scan, state a longer time")
    assert fault.startswith(f"the first scan of {RADAR} after a pause of {pause}.000 s is not complete: the topic has")
    for second in range(again, again + 70, 10):
        scanned(scans, second, float(second))
    assert scans.faults() == ()


def test_lost_messages_are_a_fault_until_the_sensor_has_reported_every_place_again():
    for scan_s, ends in ((0, 31), (120, 121)):
        topics = SourceTopics(scan_ns=scan_s * S)
        topics.miss(RADAR, NOW)
        for second in (1, ends - 1, ends):
            lost = [each for each in topics.silent(NOW + (second - 30) * S, NOW + second * S) if "were lost" in each]
            assert bool(lost) is (second < ends)


def test_where_each_message_has_all_places_no_scan_is_awaited():
    for period in (None, 0.0):
        scans = FirstScans(period, silent_s=90.0)
        scanned(scans, 0, 0.0)
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
    assert again.restore(saved, (RADAR,), 0.0) == ([RADAR], [])
    update = again.received(message(9, B), is_suspect=True)
    assert rows(update.unreported) == [A] and update.last_ns == 0
    assert Steady(None, 2.0).restore(saved, ("other",), 0.0) == ([], []), "a removed sensor"


def test_with_a_scan_period_places_are_remembered_too_and_count_for_one_period_after_a_restart():
    places = Steady(60.0, 2.0)
    places.received(message(0, A))
    places.received(message(1, B))
    saved = places.to_remember((RADAR,))
    again = Steady(60.0, 2.0)
    assert again.restore(saved, (RADAR,), 100.0) == ([RADAR], [])
    assert rows(again.received(message(9, B), at=160.0).trigger) == [A, B]
    assert again.to_remember((RADAR,)) == saved, "also for a site file without the period"
    assert rows(again.received(message(10, B), at=161.0).trigger) == [B]


def test_topics_with_too_many_places_to_remember_are_named(monkeypatch):
    monkeypatch.setattr(unreported_places, "REMEMBERED", 1)
    places = Steady(None, 2.0)
    places.received(message(0, A, B))
    saved = places.to_remember((RADAR,))
    assert saved == {"": [RADAR]}
    assert Steady(None, 2.0).restore(saved, (RADAR,), 0.0) == ([], [RADAR])


# --- the faults


def answered(second, *areas, **facts):
    """Return the evidence of an answer to place A with the stamp NOW + `second` seconds; facts : other values."""
    facts = {"sources_digest": message(second, A).digest, **facts}
    return evidence(*areas, trigger_stamp_ns=NOW + second * S, **facts)


class Checked(UnreportedEvidence):
    """`UnreportedEvidence` with a clock that stands at `at` (s after NOW).

    Decisions are made on the last answer to reported sources (`last`), as for a sensor that sees one wall.
    """

    def __init__(self):
        super().__init__(site(), lambda: NOW + self.at * S, lambda: None)
        self.at, self.last = 0, ()

    def note_reported(self, topic, evidence, is_whole=True):
        super().note_reported(topic, evidence, is_whole)
        self.last = (evidence,)

    def faults(self):
        return super().faults(lambda topic: self.last)

    def expect_places(self, second, *places, last=0):
        """Expect an answer to places after a message with the stamp `second`; last : when they were last reported."""
        self.expect(message(second, *places), NOW + last * S)


@pytest.fixture
def checks():
    """Return checks in which a dangerous message at 0 s was answered, and a message at 30 s lacks its place."""
    made = Checked()
    made.note_reported(RADAR, answered(0, DANGER))
    made.expect_places(30, A)
    return made


def test_a_dangerous_place_is_a_fault_that_says_what_to_do(checks):
    checks.note(RADAR, answered(30, DANGER))
    (fault,) = checks.faults().values()
    assert fault.startswith(
        f"topic {RADAR} no longer reports the place at (0.0, 0.0, 10.0) m (reported until 2027-01-15 08:00:00.000 UTC);"
        " rocks from there may reach a limit of the site: look at the slope and acknowledge; or "
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
    checks.expect_places(60, A)
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
    checks.expect_places(60, B, last=30)  # the first place is reported again, the other is not
    checks.note(RADAR, answered(60, HARMLESS, sources_digest=message(60, B).digest))
    assert checks.faults(), "the message that reports the dangerous place again is not answered"
    checks.note_reported(RADAR, answered(60, DANGER))
    assert checks.faults() == {}


def test_an_acknowledgement_ends_the_fault_at_once(checks):
    checks.note(RADAR, answered(30, DANGER))
    checks.end(RADAR)
    assert checks.faults() == {}


def test_places_that_cannot_be_simulated_are_a_fault_that_says_why(checks):
    nothing = answered(30)._replace(areas=())
    for why in ("an answer failed: MemoryError", "source 1 is not above the terrain"):
        checks.note(RADAR, nothing._replace(faults=(why,)))
        assert f"rocks from there could not be simulated ({why}): " in checks.faults()[RADAR]
    assert checks.is_due(RADAR)
    checks.note_reported(RADAR, answered(30, HARMLESS))
    checks.expect_places(60, A)
    assert "could not be simulated" in checks.faults()[RADAR], "the next message shows no other level in between"
    checks.note(RADAR, answered(60, HARMLESS))
    assert checks.faults() == {} and not checks.is_due(RADAR)


def test_places_of_which_some_are_over_a_hole_are_a_fault_until_all_are_simulated(checks):
    checks.note_reported(RADAR, answered(30, HARMLESS))
    checks.note(RADAR, answered(30, HARMLESS, faults=("source 2 of 2 is over a hole",)))
    assert "could not be simulated (source 2 of 2 is over a hole)" in checks.faults()[RADAR]
    assert not checks.is_due(RADAR), "only other terrain can change this"
    checks.note(RADAR, answered(30, HARMLESS))
    assert checks.faults() == {}


def test_places_that_are_not_answered_in_time_are_a_fault_whatever_was_reported_before():
    checks = Checked()
    checks.note_reported(RADAR, answered(0, HARMLESS))
    checks.expect_places(1, A)
    assert checks.faults() == {} and checks.ends_ns() == [NOW + 5 * S]
    for checks.at in (1, 2, 3, 4, 5):  # more places with each message
        checks.expect_places(1 + checks.at, A, B)
    assert "have not been simulated within 5 s (evidence.changed_terrain_s)" in checks.faults()[RADAR]
    assert checks.ends_ns() == []
    checks.note(RADAR, answered(6, HARMLESS, sources_digest=message(6, A, B).digest))
    assert checks.faults() == {}


def test_answers_that_come_later_than_the_next_messages_count():
    checks = Checked()
    checks.note_reported(RADAR, answered(0, HARMLESS))
    for checks.at in range(60):
        checks.expect_places(checks.at, A, B)
        checks.note(RADAR, answered(checks.at - 1, HARMLESS, sources_digest=message(checks.at - 1, A, B).digest))
        assert checks.faults() == {}
    checks.note(RADAR, answered(59, DANGER, sources_digest=message(59, A, B).digest))
    assert checks.faults()


def test_an_area_that_moves_before_an_answer_is_seen_in_the_former_answer():
    checks = Checked()
    checks.expect_places(1, A)
    checks.note(RADAR, answered(1, HARMLESS))
    checks.expect_places(2, A, B)
    assert len(checks.parts()) == 1, "the outline of this evidence is compared with the present one"


def test_many_expected_answers_are_late_as_early_as_the_first_that_was_dropped(monkeypatch):
    monkeypatch.setattr(checked_places, "MOST_EXPECTED", 2)
    checks = Checked()
    for checks.at in range(4):
        checks.expect_places(checks.at, A)
    checks.note(RADAR, answered(0, HARMLESS, sources_digest=message(0, A).digest))
    assert min(checks.ends_ns()) == NOW + 6 * S
    checks.note(RADAR, answered(3, HARMLESS, sources_digest=message(3, A).digest))
    assert checks.ends_ns() == []


def test_places_with_one_stamp_have_each_their_own_answer():
    checks = Checked()
    checks.expect_places(1, A)
    checks.expect_places(1, B)
    checks.note(RADAR, answered(1, HARMLESS, sources_digest=message(1, A).digest))
    checks.at = 9
    assert checks.faults()


def test_a_danger_that_was_shown_makes_all_unreported_places_suspect():
    checks = Checked()
    checks.note_reported(RADAR, answered(10, DANGER))
    checks.expect_places(30, A, B, last=20)
    checks.note_reported(RADAR, answered(30, HARMLESS))
    assert checks.faults()


def test_a_fault_that_is_ending_stands_until_the_message_that_ends_it_is_answered(checks):
    checks.note_reported(RADAR, answered(30, HARMLESS))
    assert checks.faults(), "the places are not answered yet"
    checks.end(RADAR, NOW + 60 * S)
    assert checks.faults()
    checks.note_reported(RADAR, answered(60, DANGER))
    assert checks.faults() == {}


def test_forgotten_or_lost_answers_leave_the_fault_until_the_places_are_judged_again(checks):
    checks.note(RADAR, answered(30, DANGER))
    checks.forget()
    assert checks.faults()
    assert checks.suspects == (RADAR,)
    checks.expect_places(5, A)
    checks.note_reported(RADAR, answered(5, HARMLESS))
    assert checks.faults()
    checks.note(RADAR, answered(5, HARMLESS))
    assert checks.faults() == {}
    checks.lose()
    assert checks.faults() and checks.is_due(RADAR)


def test_what_was_dangerous_before_a_restart_is_a_fault_until_it_is_judged():
    checks = Checked()
    checks.suspect(RADAR)
    assert checks.suspects == (RADAR,), "a second restart may come before the first message"
    checks.expect(message(0, A), 0)
    checks.note_reported(RADAR, answered(0, HARMLESS))
    assert "(reported before the start of the node); rocks" in checks.faults()[RADAR]
    checks.note(RADAR, answered(0, HARMLESS))
    assert checks.faults() == {} and checks.suspects == (), "all that is known is harmless now"


def test_a_topic_is_suspect_while_its_last_message_is_not_answered_or_judged():
    checks = Checked()
    checks.note_reported(RADAR, answered(0, HARMLESS))
    assert checks.suspects == ()
    checks.received(RADAR, NOW + 1 * S, NOW + 1 * S)
    assert checks.suspects == (RADAR,)
    checks.note_reported(RADAR, answered(1, area(flown=50)))
    assert checks.suspects == (RADAR,), "a small answer judges nothing"
    checks.note_reported(RADAR, answered(1, HARMLESS))
    assert checks.suspects == ()


def harmless(checks):
    checks.note_reported(RADAR, answered(0, HARMLESS))


def harmless_with_an_unreported_place(checks):
    harmless(checks)
    checks.expect_places(1, A)
    checks.note(RADAR, answered(1, HARMLESS))
    checks.note_reported(RADAR, answered(1, HARMLESS))


def dangerous(checks):
    checks.note_reported(RADAR, answered(0, DANGER))


def not_answered(checks):
    harmless(checks)
    checks.received(RADAR, NOW + 1 * S, NOW + 1 * S)


def dangerous_at_an_unreported_place(checks):
    harmless(checks)
    checks.expect_places(1, A)
    checks.note(RADAR, answered(1, DANGER))


def dangerous_before_a_restart(checks):
    checks.suspect(RADAR)


def dangerous_long_ago(checks):
    dangerous(checks)
    checks.note_reported(RADAR, answered(1, HARMLESS))


@pytest.mark.parametrize(
    ("happens", "is_possible"),
    [
        (harmless, False), (harmless_with_an_unreported_place, False), (dangerous_long_ago, False), (dangerous, True),
        (not_answered, True), (dangerous_at_an_unreported_place, True), (dangerous_before_a_restart, True),
    ],
)  # fmt: skip
def test_where_danger_was_possible_it_is_so_after_all_answers_were_forgotten_and_nowhere_else(happens, is_possible):
    checks = Checked()
    happens(checks)
    expected = (RADAR,) if is_possible else ()
    assert checks.dangers == expected
    for _ in range(2):
        checks.forget()
        assert checks.dangers == expected
        assert checks.suspects == (RADAR,), "nothing is judged any more"
    checks.received(RADAR, NOW + 5 * S, NOW + 5 * S)
    assert checks.dangers == (RADAR,), "a message with sources is not answered"
    checks.end(RADAR)
    checks.note_reported(RADAR, answered(5, HARMLESS), is_whole=False)
    assert checks.dangers == expected, "other places of the scan have not been reported"
    checks.note_reported(RADAR, answered(5, area(flown=50)))
    assert checks.dangers == expected, "a small answer judges nothing"
    checks.note_reported(RADAR, answered(6, HARMLESS))
    assert checks.dangers == ()


def note_danger(checks):
    checks.note(RADAR, answered(9, DANGER))


def note_fault(checks):
    checks.note(RADAR, answered(9, HARMLESS)._replace(faults=("over a hole",)))


@pytest.mark.parametrize("happens", [note_danger, note_fault, UnreportedEvidence.lose], ids=["danger", "fault", "lost"])
def test_danger_at_unreported_places_counts_after_the_answers_of_a_harmless_topic_were_forgotten(happens):
    checks = Checked()
    harmless_with_an_unreported_place(checks)
    checks.forget()
    assert checks.dangers == ()
    checks.note_reported(RADAR, answered(8, HARMLESS))
    happens(checks)
    assert checks.dangers == (RADAR,)
    for _ in range(2):
        checks.forget()
        assert checks.dangers == (RADAR,)


def test_a_danger_of_which_not_all_places_were_answered_is_ended_by_no_harmless_answer_to_a_part():
    checks = Checked()
    not_answered(checks)
    checks.forget()
    checks.note_reported(RADAR, answered(2, DANGER), is_whole=False)
    checks.note_reported(RADAR, answered(3, HARMLESS), is_whole=False)
    assert checks.dangers == (RADAR,)


def test_an_answer_to_a_part_of_the_sources_ends_no_danger():
    """A source under the ground releases no rock: the others may be harmless, but it is not known about this one."""
    partly = answered(1, HARMLESS)._replace(faults=("1 of 2 sources is under the ground",))
    for happens in (harmless, dangerous):
        checks = Checked()
        happens(checks)
        checks.note_reported(RADAR, partly)
        assert checks.dangers == (RADAR,)
        checks.note_reported(RADAR, answered(2, HARMLESS))
        assert checks.dangers == ()


def test_an_older_harmless_answer_ends_no_newer_danger():
    checks = Checked()
    checks.suspect(RADAR)
    checks.note_reported(RADAR, answered(2, DANGER))
    checks.note_reported(RADAR, answered(1, HARMLESS))
    assert checks.dangers == (RADAR,)


def test_an_empty_message_ends_a_danger_from_before_unless_it_has_the_stamp_of_sources():
    checks = Checked()
    checks.suspect(RADAR)
    checks.received(RADAR, NOW + 5 * S, NOW + 5 * S)
    nothing = answered(5)._replace(sources=0)
    checks.note_reported(RADAR, nothing)
    assert checks.dangers == (RADAR,), "the sources of this stamp count"
    checks.note_reported(RADAR, nothing._replace(trigger_stamp_ns=NOW + 6 * S))
    assert checks.dangers == ()


def test_an_answer_from_before_the_first_area_judges_nothing_when_there_is_one():
    checks = Checked()
    checks.note_reported(RADAR, answered(1, HARMLESS))
    checks.expect_places(1, A)
    checks.note(RADAR, answered(1)._replace(areas=()))
    assert checks.faults() == {}
    checks.watch({"ramp": "1"})
    assert min(checks.ends_ns()) == NOW + 1 * S, "moved_area_s"
    checks.note(RADAR, answered(1)._replace(areas=()))
    checks.at = 1
    assert "have not been simulated within 1 s (evidence.moved_area_s)" in checks.faults()[RADAR]
    checks.note(RADAR, answered(1, HARMLESS))
    assert checks.faults() == {}


def test_a_small_answer_does_not_replace_the_answer_for_a_former_outline():
    checks = Checked()
    checks.expect_places(1, A)
    checks.note(RADAR, answered(1, HARMLESS))
    checks.note(RADAR, answered(1, area(flown=1)))
    assert checks.parts()[0].areas == (HARMLESS,)


def test_a_topic_without_an_answer_is_suspect():
    checks = Checked()
    checks.expect_places(1, A)
    checks.note(RADAR, answered(1, HARMLESS))
    assert checks.suspects == (RADAR,)
    checks.note_reported(RADAR, answered(1, HARMLESS))
    assert checks.suspects == ()


# --- places and faults together


def place_checks(period=None, **site_facts):
    thresholds = site(scan_period_s=period)
    if site_facts:
        thresholds = type(thresholds).model_validate({**thresholds.model_dump(), **site_facts})
    told, ended = {}, []
    checks = UnreportedEvidence(thresholds, lambda: NOW, lambda: None)
    scans = FirstScans(period, silent_s=90.0)
    return PlaceChecks(thresholds, 2.0, checks, scans, told.__setitem__, ended.append), checks, told, ended


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
    checks.note_reported(RADAR, answered(30, HARMLESS))
    assert one.acknowledged("C. Shift", ()) == (), "the fault was not shown to this person"
    assert one.acknowledged("A. Shift", checks.faults().values()) == () and checks.faults()
    assert one.acknowledged("A. Shift", checks.faults().values()) == () and checks.faults()
    assert one.acknowledged("B. Shift", checks.faults().values()) == (RADAR,) and checks.faults() == {}
    assert len(one.submitted(message(60, B))) == 1, "an acknowledged place is not checked again"


def test_two_persons_who_saw_different_places_end_no_fault():
    one, checks, _, _ = place_checks(acknowledge={"persons": 2})
    one.submitted(message(0, A))
    one.submitted(message(30, B))
    checks.note(RADAR, answered(30, DANGER))
    assert one.acknowledged("A. Shift", checks.faults().values()) == ()
    one.submitted(message(60, C))  # now B is missing, too
    assert one.acknowledged("B. Shift", checks.faults().values()) == () and checks.faults()
    unreported, _ = one.submitted(message(61, C))
    assert rows(unreported) == [B], "both saw A"


def test_two_persons_end_the_fault_of_the_places_that_both_saw_although_others_come_and_go():
    one, checks, _, _ = place_checks(acknowledge={"persons": 2})
    one.submitted(message(0, A, B))
    one.submitted(message(10, B))
    checks.note(RADAR, answered(10, DANGER))
    assert one.acknowledged("A. Shift", checks.faults().values()) == ()
    one.submitted(message(20, C))
    one.submitted(message(30, B))
    one.acknowledged("B. Shift", checks.faults().values())
    assert [rows(each) for each in one.submitted(message(31, B))] == [[C], [B]]


def forgets(monkeypatch, period=None):
    """Return checks that had to forget places of topic RADAR, and their faults by cause."""
    monkeypatch.setattr(unreported_places, "MOST" if period is None else "MOST_IN_A_SCAN", 1)
    one, checks, told, _ = place_checks(period)
    checks.suspect(RADAR)
    for second, place in enumerate((A, B, C)):
        one.submitted(message(second, place))
    return one, told


def test_forgotten_places_are_a_fault_until_an_empty_message_or_an_acknowledgement(monkeypatch):
    for ends in (
        lambda one, told: one.submitted(message(9)),
        lambda one, told: one.acknowledged("A. Shift", list(told.values())),
    ):
        one, told = forgets(monkeypatch)
        (fault,) = told.values()
        assert fault.startswith(f"{RADAR} had reported more than 1 places that it reports no longer")
        ends(one, told)
        assert list(told.values()) == [""]


def test_an_empty_message_with_the_stamp_of_sources_does_not_end_the_fault_of_forgotten_places(monkeypatch):
    one, told = forgets(monkeypatch)
    (fault,) = told.values()
    one.submitted(message(2))
    assert list(told.values()) == [fault]


def test_after_more_places_are_forgotten_the_fault_is_another_one(monkeypatch):
    one, told = forgets(monkeypatch)
    (before,) = told.values()
    one.submitted(message(3, A))
    (fault,) = told.values()
    assert fault != before and one.acknowledged("A. Shift", [before]) == () and list(told.values()) == [fault]


def test_places_of_which_the_message_is_not_answered_are_not_forgotten_silently(monkeypatch):
    monkeypatch.setattr(unreported_places, "MOST", 1)
    one, checks, told, _ = place_checks()
    checks.note_reported(RADAR, answered(0, HARMLESS))
    one.submitted(message(1, A, B))
    one.submitted(message(2, C))
    told_at = "the node has forgotten some of these places, the last of them at 2027-01-15 08:00:02"
    assert told_at in told[f"places: {RADAR}"]


def test_places_of_which_the_message_is_not_answered_are_remembered_for_a_restart():
    one, checks, _, _ = place_checks()
    one.submitted(message(0, B))
    checks.note_reported(RADAR, answered(0, HARMLESS))
    assert one.to_remember() == {"dangers": []}
    one.submitted(message(1, A, B))
    assert len(one.to_remember()["places"][RADAR]) == 2


def test_places_of_a_part_that_is_not_answered_are_remembered_for_a_restart():
    one, checks, _, _ = place_checks()
    one.submitted(message(1, A))
    checks.note_reported(RADAR, answered(1, HARMLESS))
    (both,) = one.submitted(message(1, B))
    assert len(one.to_remember()["places"][RADAR]) == 2 and one.to_remember()["dangers"] == [RADAR]
    checks.note_reported(RADAR, answered(1, HARMLESS)._replace(trigger_stamp_ns=both.stamp_ns))
    assert one.to_remember() == {"dangers": []}


def test_the_fault_of_a_place_ends_only_when_the_part_that_reports_it_again_is_answered():
    one, checks, _, _ = place_checks()
    one.submitted(message(0, A, B))
    checks.note_reported(RADAR, answered(0, DANGER))
    one.submitted(message(1, A))
    checks.note_reported(RADAR, answered(1, HARMLESS))
    assert checks.faults()
    (both,) = one.submitted(message(1, B))
    assert rows(both) == [A, B] and checks.faults() and checks.suspects == (RADAR,)
    checks.note_reported(RADAR, answered(1, HARMLESS)._replace(trigger_stamp_ns=both.stamp_ns))
    assert not checks.faults()


@pytest.mark.parametrize("parts", [((), (B,)), ((B,), ())])
def test_an_empty_part_of_a_scan_does_not_end_the_places_of_the_scan_before(parts):
    one, checks, _, _ = place_checks()
    one.submitted(message(0, A, B))
    checks.note_reported(RADAR, answered(0, DANGER))
    for part in parts:
        triggers = one.submitted(message(1, *part))
        if part:
            assert [rows(each) for each in triggers] == [[A], [B]]
        for each in triggers[-1:]:
            is_answer = {"sources": len(part), "sources_digest": each.digest}
            checks.note_reported(RADAR, answered(1, HARMLESS)._replace(trigger_stamp_ns=each.stamp_ns, **is_answer))
    assert checks.faults(), "the place is not reported any more, and its last answer was dangerous"


@pytest.mark.parametrize("period_s", [0.0, 60.0, None])
def test_each_message_of_a_scan_has_a_later_stamp_than_the_message_before(period_s):
    """Also if a message repeats the sources of all parts before, or has no sources and comes first."""
    for scan in ([(A,), (B,), (A, B, C)], [(A,), (A, B), (A, B, C)], [(A,), (A,), (B,)], [(), (A,), (B,)]):
        places = Steady(period_s, 2.0)
        stamps = [places.received(message(1, *part)).trigger.stamp_ns for part in scan]
        assert stamps == sorted(set(stamps)) and stamps[0] == NOW + S


def test_an_empty_message_with_the_stamp_of_sources_is_no_answer_to_them():
    one, checks, _, _ = place_checks()
    checks.note_reported(RADAR, answered(0, HARMLESS))
    (sources,) = one.submitted(message(1, A))
    assert one.submitted(message(1)) == [], "it is not simulated, and clears nothing"
    checks.note_reported(RADAR, answered(1, sources=0))
    assert checks.suspects == (RADAR,) and len(one.to_remember()["places"][RADAR]) == 1
    checks.note_reported(RADAR, answered(1, HARMLESS, sources_digest=sources.digest))
    assert checks.suspects == ()


def test_an_empty_part_of_a_scan_ends_no_fault_of_forgotten_places(monkeypatch):
    one, told = forgets(monkeypatch)
    (cause,) = told
    sentence = told[cause]
    one.submitted(message(500))
    assert told[cause] == ""
    one.submitted(message(500, B))
    assert told[cause] == sentence
    one.submitted(message(501))
    one.submitted(message(502, B))
    assert told[cause] == "", "an empty message is a whole scan if no part follows"


def test_until_the_first_of_several_expected_answers_arrives_the_oldest_danger_counts():
    checks = Checked()
    checks.note_reported(RADAR, answered(0, DANGER))
    checks.expect_places(1, A, last=0)
    checks.note_reported(RADAR, answered(1, HARMLESS))
    assert checks.faults()
    checks.expect_places(2, B, last=1)
    assert checks.faults()


def test_a_fault_of_forgotten_places_that_nobody_saw_is_not_acknowledged(monkeypatch):
    one, told = forgets(monkeypatch)
    (fault,) = told.values()
    assert one.acknowledged("A. Shift", ["another fault"]) == () and list(told.values()) == [fault]


def test_forgotten_places_are_remembered_for_every_restart(monkeypatch):
    one, _ = forgets(monkeypatch)
    for _restart in range(2):
        saved = one.to_remember()["places"]
        assert saved[""] == [RADAR]
        one, _checks, told, _ended = place_checks()
        one.restore(saved, (RADAR,))
        (fault,) = told.values()
        assert "had reported more places before the start of the node than the node remembers" in fault


def test_with_a_scan_period_too_many_places_are_a_fault_until_all_have_been_reported_again(monkeypatch):
    monkeypatch.setattr(place_checks_module, "time", steady := SimpleNamespace(monotonic=lambda: steady.at, at=0.0))
    one, told = forgets(monkeypatch, period=60.0)
    (fault,) = told.values()
    assert "has reported more than 1 places within evidence.scan_period_s" in fault
    monkeypatch.setattr(unreported_places, "MOST_IN_A_SCAN", 9)
    for second, steady.at, is_fault in ((3, 3.0, True), (62, 62.0, True), (99, 50.0, True), (99, 99.0, False)):
        one.submitted(message(second, A))
        assert bool(told[f"places: {RADAR}"]) is is_fault, second


def test_places_are_compared_quickly_however_many_they_are():
    many = np.random.default_rng(1).uniform(0.0, 500.0, (20_000, 3))
    began = time.process_time()
    near = is_near(many + np.array([0.0, 0.0, 1.0]), many, 1.5)
    assert time.process_time() - began < 2.0 and near.all()
    assert is_near(np.array([A, B]), np.array([(0.0, 2.0, 10.0)]), 2.0).tolist() == [True, False]
    assert is_near(np.empty((0, 3)), many, 1.0).tolist() == [] and not is_near(many, np.empty((0, 3)), 1.0).any()


def test_a_danger_of_a_click_is_no_fault_once_the_click_is_too_old(checks):
    """No later message of a sensor would answer for it."""
    for second, found in ((40, HARMLESS), (30, DANGER)):  # an older click is answered again, with danger
        checks.received(BY_HAND, NOW + second * S, NOW + second * S)
        checks.note_reported(BY_HAND, answered(second, found))
    checks.last = ()
    assert BY_HAND not in checks.faults()
