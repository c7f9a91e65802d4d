"""Tests that a danger is shown while answers to parts of a scan, or to other places, arrive in any order."""

import random

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.alert_evidence import FLOWN, NOW, S, area, evidence
from live_sites.answered_radar import FAR, RADAR, A, B, C, D, Radar

from rpf3d_core.alerts.levels import Level

NEAR_FAR = (72.0, 5.0, 10.0)
"""A place in the region of FAR."""
PLACES = (A, B, C, D, FAR, NEAR_FAR)
SHOWN = "which is neither shown as a level nor as a fault"


@pytest.fixture
def radar():
    """Return a radar that has reported the dangerous place A, which is answered."""
    made = Radar()
    made.answer(*made.send(0, A))
    return made


# --- scans in parts


@pytest.mark.parametrize("second_part", [(A,), (A, B), (C,)])
def test_the_answer_to_an_empty_part_hides_no_danger_that_a_further_part_may_report(radar, second_part):
    empty, further = radar.send(1), radar.send(1, *second_part)
    radar.answer(*empty)
    assert not radar.is_green, f"A is not answered, {SHOWN}"
    radar.answer(*further)
    assert not radar.is_green


@pytest.mark.parametrize("period", [None, 0.0])
@pytest.mark.parametrize("first_part", [(), (B,)])
def test_a_further_part_brings_back_the_danger_that_the_answer_to_an_earlier_part_had_ended(period, first_part):
    radar = Radar(period=period)
    radar.answer(*radar.send(0, A))
    radar.answer(*radar.send(1, *first_part))
    further = radar.send(1, A)
    assert not radar.is_green, f"the further part is not answered, {SHOWN}"
    radar.answer(*further)
    assert radar.alert().evident > Level.NORMAL


@pytest.mark.parametrize("period", [None, 0.0])
@pytest.mark.parametrize("parts", [[(A,), (B,)], [(A, B), (A, B)], [(), (A, B)], [(), (A,), (B,)]])
def test_the_fault_of_a_sensor_that_scans_faster_than_its_answers_ends(parts, period):
    """Each scan takes 1 s, each answer 1.5 s; no place is dangerous any more."""
    radar = Radar(period=period)
    radar.answer(*radar.send(0, A, B))
    radar.dangerous, flying, ready = set(), None, 0.0
    for step in range(1, 40):
        for part in parts if step % 2 else ():
            radar.queue(step / 2, *part)
        if flying is not None and step >= ready:
            radar.schedule.progress(flying, True)
            radar.answer(flying)
            flying = None
        if flying is None and radar.schedule.has_next and (flying := radar.schedule.next_trigger()) is not None:
            radar.schedule.begin(flying, True)
            ready = step + 3
    assert radar.is_green, radar.alert().faults


# --- answers in another order than their messages


def test_an_older_message_whose_new_answer_shows_danger_is_not_ended_by_a_harmless_newer_answer():
    """Terrain or area change, so that the message of another wall is answered again, with danger."""
    radar = Radar()
    radar.dangerous = set()
    older = radar.send(1, FAR, NEAR_FAR)
    radar.answer(*older, *radar.send(2, B))
    radar.dangerous = {FAR}
    radar.answer(*older)
    unreported, message = radar.send(3, NEAR_FAR)
    radar.answer(message)
    assert not radar.is_green, f"FAR is not answered, {SHOWN}"
    radar.answer(unreported)
    assert not radar.is_green


@pytest.fixture
def patched():
    """Return a radar with a dangerous place that its topic no longer reports: a patch has just made FAR dangerous.

    The message of FAR was answered again with danger, the unreported places were answered before the patch only.
    """
    radar = Radar()
    radar.dangerous = set()
    for second, place in ((1, FAR), (2, B)):
        radar.queue(second, place)
        radar.fly()
    radar.dangerous = {FAR}
    radar.schedule.answer_again()
    radar.fly_one()
    assert radar.alert().evident > Level.NORMAL
    return radar


def test_an_answer_to_unreported_places_from_before_the_danger_does_not_end_it(patched):
    patched.queue(3, B)
    patched.fly_one()
    patched.queue(4, NEAR_FAR)
    patched.fly_one()
    assert not patched.is_green, f"FAR is not answered over the new ground, {SHOWN}"
    patched.fly()
    assert not patched.is_green


def test_the_fault_of_such_a_danger_ends_once_all_is_harmless_again(patched):
    patched.dangerous = set()
    for second in (3, 4):
        patched.queue(second, NEAR_FAR)
        patched.fly()
    assert patched.is_green, patched.alert().faults


def test_after_an_error_the_answer_to_older_unreported_places_judges_no_newer_ones():
    radar = Radar()
    radar.answer(*radar.send(0, A, B, C))
    older, _ = radar.send(1, A, B)
    newer, message = radar.send(2, B)
    radar.regions.lose()
    radar.answer(older, message)
    assert not radar.is_green, f"A is not answered, {SHOWN}"
    radar.answer(newer)
    assert not radar.is_green


def test_messages_between_a_step_back_and_its_decision_are_expected_one_by_one():
    radar = Radar()
    radar.dangerous = {B}
    radar.answer(*radar.send(10, A, B))
    radar.places.restart()
    radar.now_ns = NOW
    (older, _), (newer, message) = radar.send(1, B), radar.send(2, C)
    radar.regions.forget(radar.now_ns)
    radar.answer(older, message)
    assert not radar.is_green, f"B is not answered, {SHOWN}"
    radar.answer(newer)
    assert not radar.is_green


def test_a_fault_lasts_from_a_step_back_of_the_clock_until_its_decision():
    radar = Radar(period=0.0)
    radar.answer(*radar.send(0, A))
    first, _ = *radar.send(1, B), radar.send(1, A)
    radar.answer(first)
    assert not radar.is_green
    radar.places.restart()
    assert not radar.is_green, "the desk has not forgotten the answers yet"


def test_an_acknowledgement_does_not_end_the_fault_of_places_that_were_late_and_are_reported_again():
    radar = Radar()
    radar.dangerous = set()
    radar.answer(*radar.send(0, A), radar.send(1, B)[1])
    radar.now_ns += 20 * S
    late = radar.alert().faults
    assert late
    radar.dangerous = {A}
    again = radar.send(30, A, B)
    radar.places.acknowledged("A. Shift", late)
    assert not radar.is_green, f"A is not answered, {SHOWN}"
    radar.answer(*again)
    assert radar.alert().evident > Level.NORMAL


# --- levels


def test_a_higher_danger_is_not_hidden_by_a_lower_level_of_another_place(radar):
    """A causes `evacuate`, B only `watch`; A is not answered yet."""
    unreported, message = radar.send(1, B)
    note_watch(radar, message)
    alert = radar.alert()
    assert alert.evident == Level.WATCH and alert.faults, f"A may still cause `evacuate`, {SHOWN}"
    radar.dangerous = set()
    radar.answer(unreported)
    assert radar.alert().evident == Level.WATCH and not radar.alert().faults


def test_a_danger_that_became_smaller_is_no_fault_while_the_next_message_is_not_answered(radar):
    (message,) = radar.send(1, A)
    note_watch(radar, message)
    radar.send(2, A)
    assert radar.alert().evident == Level.WATCH and not radar.alert().faults


def note_watch(radar, trigger):
    """Answer a trigger with a level of `watch`."""
    found = evidence(
        area(FLOWN // 50), trigger_stamp_ns=trigger.stamp_ns, at_ns=radar.now_ns, sources_digest=trigger.digest,
        sources=len(trigger.positions),
    )  # fmt: skip
    radar.regions.note(radar.region_of(trigger), RADAR, found)


# --- random sequences


class Known:
    """What a person would know of the places from messages and answers, by rules of its own.

    A danger that an answer showed at message number n lasts until all places were answered without danger; places that
    were first reported later than n, and are not answered, do not count.
    """

    def __init__(self):
        self.number, self.shown_at = 0, None
        self.first, self.dangerous = {}, {}  # by place: number of its first message; whether it was dangerous last

    def reported(self, places):
        self.number += 1
        for place in places:
            self.first.setdefault(place, self.number)
        return self.number

    def answered(self, number, places, dangerous):
        for place in places:
            self.dangerous[place] = place in dangerous
        if dangerous & places:
            self.shown_at = number
        elif self.shown_at is not None and not any(map(self._may_be_dangerous, self.first)):
            self.shown_at = None

    def _may_be_dangerous(self, place):
        return self.dangerous.get(place, self.first[place] <= self.shown_at)


def wander(seed, parts, empty):
    """Yield after each of 100 random steps whether a danger must be shown, and the radar.

    parts : probability that a message is a further part of a scan
    empty : probability that a scan begins with an empty part
    """
    chance, radar, known, second = random.Random(seed), Radar(), Known(), 0
    share = chance.choice((0.0, 0.1, 0.4))  # of the places in a message
    radar.dangerous, flying, late, number_of = set(chance.sample(PLACES, 2)), None, [], {}
    for _ in range(100):
        kind = chance.random()
        if kind < 0.05:  # other terrain
            radar.dangerous = set(chance.sample(PLACES, chance.choice((0, 1, 2))))
            radar.schedule.answer_again()
        elif kind < 0.55:
            second += chance.random() >= parts
            places = [place for place in PLACES if chance.random() < share] or [chance.choice(PLACES)]
            number = known.reported(places)
            for part in ([], places) if chance.random() < empty else (places,):
                for trigger in radar.send(second, *part):
                    number_of[trigger.digest] = number
                    radar.schedule.submit(trigger)
        elif kind < 0.8 and flying is not None:  # flown, but not noted yet
            radar.schedule.progress(flying, True)
            late.append((flying, set(radar.dangerous)))
            flying = None
        elif kind < 0.8 and radar.schedule.has_next and (flying := radar.schedule.next_trigger()) is not None:
            radar.schedule.begin(flying, True)
        elif late:
            trigger, dangerous = late.pop(0)
            now, radar.dangerous = radar.dangerous, dangerous
            radar.answer(trigger)
            radar.dangerous = now
            known.answered(number_of[trigger.digest], set(map(tuple, trigger.positions.tolist())), dangerous)
        yield known.shown_at is not None, radar


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize(("parts", "empty"), [(0.0, 0.0), (0.4, 0.0), (0.4, 0.2)])
def test_no_random_order_of_parts_and_answers_hides_a_danger(seed, parts, empty):
    for must_show, radar in wander(seed, parts, empty):
        assert not (must_show and radar.is_green), SHOWN


@pytest.mark.parametrize("seed", range(20))
def test_the_fault_ends_once_all_is_answered_without_danger(seed):
    *_, (_, radar) = wander(seed, 0.4, 0.2)
    radar.dangerous = set()
    radar.schedule.answer_again()
    for second in (1000, 1001):
        radar.queue(second, *PLACES)
        radar.fly()
    assert radar.is_green, radar.alert().faults
