"""Tests of decisions: levels rise at once, fall by acknowledgement, and are never normal on doubtful evidence."""

import math
from typing import Any

import pytest
from live_sites.alert_evidence import (
    EVACUATE,
    FLOWN,
    NORMAL,
    NOW,
    RESTRICT,
    WATCH,
    S,
    area,
    decided,
    evidence,
    later,
    nothing_seen,
    seen_by,
    site,
)

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Acknowledgement, Level, acknowledgement
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.errors import InputError

LEVELS = [(NORMAL, Level.NORMAL), (WATCH, Level.WATCH), (RESTRICT, Level.RESTRICT), (EVACUATE, Level.EVACUATE)]


@pytest.mark.parametrize(("answer", "level"), LEVELS, ids=lambda value: getattr(value, "name", ""))
def test_each_level_is_reached_at_once(answer: Evidence, level: Level) -> None:
    alert = decided(NORMAL, answer)
    assert (alert.level, alert.held, alert.evident, alert.faults) == (level, level, level, ())
    assert alert.alarm is (level >= Level.RESTRICT)


def test_no_sources_seen_is_evidence_and_may_be_normal() -> None:
    alert = decided(nothing_seen())
    assert (alert.level, alert.alarm) == (Level.NORMAL, False)
    assert alert.reasons == ("ramp: no limit is reached; there is no source, so no rock flew",)


def test_the_upper_end_of_the_interval_is_compared_unless_the_site_wants_the_share() -> None:
    almost = evidence(area(95))  # 0.95 %, up to 1.16 %
    assert decided(almost).level == Level.WATCH
    assert decided(almost, thresholds=site(reach_probability_is="share")).level == Level.NORMAL
    assert decided(evidence(area(100)), thresholds=site(reach_probability_is="share")).level == Level.WATCH


@pytest.mark.parametrize(("energy", "level"), [(99_999.0, Level.NORMAL), (100_000.0, Level.RESTRICT)])
def test_an_energy_at_its_limit_reaches_it(energy: float, level: Level) -> None:
    answer = evidence(area(30, p95_energy=energy, largest_energy=1e6))
    assert decided(answer).level == level


def test_without_a_percentile_the_largest_energy_stands_for_it() -> None:
    alert = decided(evidence(area(5, p95_energy=None, largest_energy=1e5)))
    assert alert.level == Level.RESTRICT
    assert alert.reasons[0].startswith("ramp: restrict because largest energy (too few rocks for a p95)")


@pytest.mark.parametrize(("arrival", "level"), [(10.0, Level.EVACUATE), (10.1, Level.NORMAL)])
def test_a_rock_that_comes_within_evacuation_time_and_margin_comes_too_soon(arrival: float, level: Level) -> None:
    assert decided(evidence(area(1, first_arrival_s=arrival))).level == level


def test_the_worst_area_decides_and_tells_first() -> None:
    limit = {"reach_probability": 0.01}
    thresholds = site({"ramp": {"watch": limit}, "cr*": {"evacuate": limit}})
    alert = decided(evidence(area(200), area(200, name="crusher")), thresholds=thresholds)
    assert alert.level == Level.EVACUATE
    assert [reason.split(":")[0] for reason in alert.reasons] == ["crusher", "ramp"]


def test_of_an_area_that_several_answers_tell_of_the_worst_counts() -> None:
    for areas in ((area(120), area(3000, flown=5000)), (area(3000, flown=5000), area(120))):
        assert decided(evidence(*areas)).level == Level.EVACUATE
    one_small = evidence(area(), area(flown=64))
    assert "too few rocks" in void_of(EVACUATE, NORMAL, last=one_small, given=seen_by(NOW + 2 * S))


def test_an_areas_own_limits_come_before_a_pattern_and_the_first_pattern_before_others() -> None:
    watch, evacuate = {"watch": {"reach_probability": 0.01}}, {"evacuate": {"reach_probability": 0.01}}
    thresholds = site({"r*": evacuate, "ra*": watch, "ramp": watch})
    assert decided(evidence(area(200)), thresholds=thresholds).level == Level.WATCH
    answer = evidence(area(), area(200, name="range"))
    assert decided(answer, thresholds=thresholds).level == Level.EVACUATE


def test_an_area_without_limits_is_said_and_decides_nothing() -> None:
    alert = decided(evidence(area(), area(9000, name="dump")))
    assert alert.level == Level.NORMAL
    assert "dump: the site file has no limits for this area" in alert.reasons


def test_the_level_stays_until_it_is_acknowledged_and_tells_what_raised_it() -> None:
    alert = decided(NORMAL, EVACUATE, NORMAL, NORMAL)
    assert (alert.level, alert.held, alert.evident, alert.alarm) == (Level.EVACUATE, Level.EVACUATE, Level.NORMAL, True)
    assert alert.held_since_ns == NOW + S
    why = "evacuate because 3,000 of 10,000 rocks reached the area (up to 30.9 %), limit 20 %"
    assert alert.held_by == (f"ramp: {why}",)
    assert any("evacuate has been held since" in reason and alert.held_by[0] in reason for reason in alert.reasons)


@pytest.mark.parametrize(("answer", "level"), LEVELS[:3], ids=lambda value: getattr(value, "name", ""))
def test_an_acknowledgement_lets_the_level_fall_to_what_the_evidence_says(answer: Evidence, level: Level) -> None:
    held = decided(EVACUATE, answer)
    alert = decide(held, later(answer, 2), site(), NOW + 2 * S, seen_by(NOW + 2 * S))
    assert (alert.level, alert.held, alert.void) == (level, level, "")
    assert alert.acknowledgement is not None
    after = decide(alert, later(answer, 3), site(), NOW + 3 * S)
    assert (after.level, after.acknowledgement) == (level, None)


def void_of(*answers: Evidence | None, last: Evidence | None, given: Acknowledgement) -> str:
    """Return why an acknowledgement does not count; the held level must not fall."""
    held = decided(*answers)
    at = len(answers)
    told = None if last is None else later(last, at)
    alert = decide(held, told, site(), NOW + at * S, given)
    assert alert.held >= held.held
    assert f"the acknowledgement does not count: {alert.void}" in alert.reasons
    return alert.void


def test_an_acknowledgement_while_the_evidence_is_as_bad_does_not_count_later() -> None:
    assert "still gives evacuate" in void_of(EVACUATE, last=EVACUATE, given=seen_by(NOW + S))
    held = decided(EVACUATE, EVACUATE)
    given = decide(held, later(EVACUATE, 2), site(), NOW + 2 * S, seen_by(NOW + 2 * S))
    assert decide(given, later(NORMAL, 3), site(), NOW + 3 * S).level == Level.EVACUATE


def test_an_acknowledgement_from_before_the_evidence_got_worse_is_void() -> None:
    assert "become worse" in void_of(EVACUATE, NORMAL, last=WATCH, given=seen_by(NOW + 2 * S))
    assert "become worse" in void_of(EVACUATE, NORMAL, WATCH, last=WATCH, given=seen_by(NOW + S))
    assert void_of(EVACUATE, NORMAL, WATCH, last=None, given=seen_by(NOW + 3 * S)) != ""


def test_an_acknowledgement_counts_for_nothing_without_evidence_that_can_be_believed() -> None:
    stale = later(NORMAL, -100)
    assert "has a fault" in void_of(EVACUATE, NORMAL, last=None, given=seen_by(NOW + 2 * S))
    assert "has a fault" in void_of(EVACUATE, NORMAL, last=stale, given=seen_by(NOW + 2 * S))
    assert "in the future" in void_of(EVACUATE, NORMAL, last=NORMAL, given=seen_by(NOW + 9 * S))
    assert "no name" in void_of(EVACUATE, NORMAL, last=NORMAL, given=Acknowledgement(" ", "why", NOW + 2 * S))
    assert "no level above normal is held" in void_of(NORMAL, last=NORMAL, given=seen_by(NOW + S))


def test_an_acknowledgement_needs_a_person_and_a_reason() -> None:
    assert acknowledgement(" A. Shift ", " seen ", NOW) == Acknowledgement("A. Shift", "seen", NOW)
    with pytest.raises(InputError, match="name of the person"):
        acknowledgement(" ", "seen", NOW)
    with pytest.raises(InputError, match="Shift gave no reason"):
        acknowledgement("A. Shift", "", NOW)


@pytest.mark.parametrize(
    ("answer", "shown"),
    [(NORMAL, Level.FAULT), (WATCH, Level.FAULT), (RESTRICT, Level.FAULT), (EVACUATE, Level.EVACUATE)],
)
def test_a_fault_never_looks_safer_than_what_is_held_and_clears_to_that(answer: Evidence, shown: Level) -> None:
    before = decided(answer)
    faulty = decide(before, None, site(), NOW + S)
    assert (faulty.level, faulty.held, faulty.alarm) == (shown, before.held, True)
    assert faulty.faults and faulty.faults[0] in faulty.reasons
    assert faulty.level.severity >= before.level.severity
    cleared = decide(faulty, later(NORMAL, 2), site(), NOW + 2 * S)
    assert (cleared.level, cleared.held, cleared.faults) == (before.held, before.held, ())


def test_evidence_that_is_not_believed_may_still_raise_the_level() -> None:
    alert = decided(NORMAL, EVACUATE._replace(faults=("the survey was refused",)))
    assert (alert.level, alert.held) == (Level.EVACUATE, Level.EVACUATE)
    assert alert.faults == ("the survey was refused",)


def few(reached: int, flown: int = 64) -> Evidence:
    return evidence(area(reached, flown=flown))


def test_a_small_answer_raises_by_what_its_rocks_did_and_not_by_its_wide_interval() -> None:
    assert decided(NORMAL, few(0)).level == Level.NORMAL, "up to 5.7 % is no finding"
    assert decided(NORMAL, few(1)).level == Level.WATCH
    assert decided(NORMAL, few(20)).level == Level.EVACUATE


def test_a_small_answer_is_never_normal_by_itself() -> None:
    assert decided(few(0)).level == Level.FAULT
    assert decided(None, few(0)).level == Level.FAULT
    assert "no earlier decision is valid" in decided(few(0)).faults[0]


def test_a_small_answer_does_not_make_the_decision_before_last_longer() -> None:
    before = decided(NORMAL)
    bridged = decide(before, later(few(0), 9), site(), NOW + 9 * S)
    assert (bridged.level, bridged.valid_until_ns) == (Level.NORMAL, before.valid_until_ns)
    assert decide(bridged, later(few(0), 10), site(), NOW + 10 * S).level == Level.FAULT


def test_a_small_answer_lowers_nothing() -> None:
    assert "too few rocks" in void_of(EVACUATE, NORMAL, last=few(0), given=seen_by(NOW + 2 * S))


FAULTS: dict[str, tuple[Evidence | None, str]] = {
    "no evidence": (None, "there is no evidence"),
    "stale sources": (evidence(trigger_stamp_ns=NOW - 30 * S - 1), "the sources are stale"),
    "terrain without a stamp": (evidence(terrain_stamp_ns=0), "the terrain is without a time stamp: the stamp is 0"),
    "stale terrain": (evidence(terrain_stamp_ns=NOW - 3600 * S - 1), "the terrain is stale"),
    "sources of the future": (evidence(trigger_stamp_ns=NOW + S), "the sources are stamped 1.000 s in the future"),
    "terrain of the future": (evidence(terrain_stamp_ns=NOW + S), "the terrain is stamped"),
    "answer of the future": (evidence(at_ns=NOW + S), "the answer is stamped"),
    "answer before the question": (evidence(at_ns=NOW - 9 * S), "the answer is older than the stamp of its sources"),
    "told by the maker": (evidence(faults=("the survey was refused",)), "the survey was refused"),
    "an area is missing": (evidence(area(name="crusher")), "ramp: the site file watches this area"),
    "no area": (evidence()._replace(areas=()), "no area with limits in the site file"),
    "fewer than no sources": (evidence(sources=-1), "the number of sources is -1"),
    "an interval of no rocks": (nothing_seen(areas=(area(flown=0, low=0.0, high=0.9),)), "the interval"),
    "rocks without a source": (evidence(sources=0), "but there is no source"),
    "sources without rocks": (evidence(area(flown=0)), "no rock flew"),
    "fewer than none came": (evidence(area(0)._replace(reached=-1)), "-1 of 10000 rocks reached"),
    "fewer than none flew": (evidence(area(0)._replace(flown=-5)), "0 of -5 rocks reached"),
    "NaN share": (evidence(area(high=math.nan)), "the interval"),
    "NaN lower end": (evidence(area(low=math.nan)), "the interval"),
    "infinite share": (evidence(area(low=-math.inf)), "the interval"),
    "negative share": (evidence(area(low=-0.1)), "the interval"),
    "low above high": (evidence(area(50, low=0.008, high=0.002)), "the interval"),
    "share outside its interval": (evidence(area(50, low=0.0, high=0.001)), "the interval"),
    "NaN energy": (evidence(area(5, largest_energy=math.nan)), "the largest energy is nan"),
    "negative energy": (evidence(area(5, p95_energy=-1.0)), "the p95 energy is -1.0"),
    "p95 above the largest": (evidence(area(5, p95_energy=3e3)), "above the largest"),
    "no energy": (evidence(area(5, p95_energy=None, largest_energy=None)), "energy or their arrival time is unknown"),
    "no arrival": (evidence(area(5, first_arrival_s=None)), "energy or their arrival time is unknown"),
    "NaN arrival": (evidence(area(5, first_arrival_s=math.nan)), "the first arrival is nan"),
    "endless arrival": (evidence(area(5, first_arrival_s=math.inf)), "the first arrival is inf"),
    "arrival of no rock": (evidence(area(0, first_arrival_s=60.0)), "no rock reached the area, but there is a first"),
    "cut off": (evidence(unfinished=1001), "1001 of 10000 rocks were cut off in flight"),
    "more cut off than flew": (evidence(unfinished=FLOWN + 1), "were cut off in flight, which is impossible"),
    "fewer than none cut off": (evidence(unfinished=-1), "were cut off in flight, which is impossible"),
}  # fmt: skip


@pytest.mark.parametrize(("answer", "sentence"), FAULTS.values(), ids=FAULTS)
def test_evidence_that_cannot_be_believed_is_a_fault_and_says_why(answer: Evidence | None, sentence: str) -> None:
    alert = decide(decided(NORMAL), answer, site(), NOW)
    assert alert.level == Level.FAULT
    assert sentence in " / ".join(alert.faults)
    assert alert.alarm


def test_more_rocks_that_came_than_flew_are_a_fault_and_as_bad_as_all_of_them() -> None:
    alert = decided(NORMAL, evidence(area(1)._replace(reached=FLOWN + 1)))
    assert (alert.level, alert.held) == (Level.EVACUATE, Level.EVACUATE)
    assert "10001 of 10000 rocks reached the area, which is impossible" in alert.faults[0]


@pytest.mark.parametrize("value", [math.inf, 1e300])
@pytest.mark.parametrize("which", ["p95_energy", "largest_energy"])
def test_an_energy_beyond_all_bounds_is_never_normal(which: str, value: float) -> None:
    facts: dict[str, Any] = {"p95_energy": None, "largest_energy": value, which: value}
    assert decided(evidence(area(5, **facts))).level != Level.NORMAL


@pytest.mark.parametrize(("facts", "level"), [
    ({"trigger_stamp_ns": NOW - 30 * S}, Level.NORMAL),
    ({"terrain_stamp_ns": NOW - 3600 * S}, Level.NORMAL),
    ({"trigger_stamp_ns": NOW + S // 2, "at_ns": NOW}, Level.NORMAL),
    ({"unfinished": 1000}, Level.NORMAL),
])  # fmt: skip
def test_evidence_at_the_bound_of_what_the_site_allows_is_believed(facts: dict[str, int], level: Level) -> None:
    far_from_it = site({"ramp": {"evacuate": {"reach_probability": 0.5}}})
    assert decided(evidence(**facts), thresholds=far_from_it).level == level


def test_rocks_that_were_cut_off_are_a_fault_where_they_would_raise_the_level() -> None:
    limits = site({"ramp": {"restrict": {"reach_probability": 0.05}, "evacuate": {"reach_probability": 0.5}}})
    assert decided(evidence(area(50), unfinished=300), thresholds=limits).level == Level.NORMAL
    alert = decided(evidence(area(50), unfinished=450), thresholds=limits)
    assert alert.level == Level.FAULT and "450 rocks were cut off in flight" in alert.faults[0]
    alert = decided(evidence(area(600), unfinished=450), thresholds=limits)
    assert alert.level == Level.RESTRICT, "the limit is reached without them"


ENERGY = site({"ramp": {"restrict": {"p95_energy_j": 5e4}}}, most_left=0.5)
ARRIVAL = site({"ramp": {"restrict": {"first_arrival_s": {"evacuation": 10, "margin": 5}}}}, most_left=0.5)


@pytest.mark.parametrize(("facts", "thresholds", "level"), [
    ({"left": 10}, ENERGY, Level.NORMAL),  # 10 of 210: the p95 is that of a rock that came
    ({"left": 11}, ENERGY, Level.FAULT),
    ({"left": 10, "largest_energy": 6e4}, ENERGY, Level.FAULT),
    ({"left": 0, "largest_energy": 6e4}, ENERGY, Level.NORMAL),
    ({"left": 1, "p95_energy": None}, ENERGY, Level.FAULT),  # the largest energy counts
    ({"left": 0}, ARRIVAL, Level.NORMAL),
    ({"left": 1}, ARRIVAL, Level.FAULT),
    ({"left": 1, "first_arrival_s": 14.0}, ARRIVAL, Level.RESTRICT),
])  # fmt: skip
def test_the_energy_and_arrival_of_rocks_that_left_are_not_taken_for_small(
    facts: dict[str, Any], thresholds: Thresholds, level: Level
) -> None:
    assert decided(evidence(area(200, **facts)), thresholds=thresholds).level == level


def test_a_clock_that_goes_back_is_a_fault_once() -> None:
    before = decided(NORMAL)
    back = NOW - 100 * S
    alert = decide(before, evidence(now=back), site(), back)
    assert alert.level == Level.FAULT
    assert "the clock went back by 100.000 s" in alert.faults[0]
    assert decide(alert, evidence(now=back + S), site(), back + S).level == Level.NORMAL


def test_evidence_from_before_the_clock_went_back_stays_a_fault() -> None:
    before, back = decided(NORMAL), NOW - 100 * S
    first = decide(before, NORMAL, site(), back)
    assert decide(first, NORMAL, site(), back + S).level == Level.FAULT


def test_an_acknowledgement_counts_again_after_the_clock_went_back() -> None:
    held, back = decided(EVACUATE, NORMAL), NOW - 100 * S
    first = decide(held, evidence(now=back), site(), back)
    assert first.level == Level.EVACUATE
    later_on = back + S
    assert decide(first, evidence(now=later_on), site(), later_on, seen_by(later_on)).level == Level.NORMAL


def test_what_is_held_is_never_held_since_a_time_to_come() -> None:
    held, back = decided(NORMAL, EVACUATE), NOW - 100 * S
    assert decide(held, evidence(now=back), site(), back).held_since_ns == back


def test_an_answer_stamped_in_the_future_does_not_make_the_next_one_old() -> None:
    faulty = decide(decided(NORMAL), evidence(at_ns=NOW + 60 * S), site(), NOW)
    assert faulty.level == Level.FAULT
    assert decide(faulty, later(NORMAL, 1), site(), NOW + S).level == Level.NORMAL


def test_what_holds_a_level_is_told_of_the_areas_that_raised_it_only() -> None:
    limit = {"reach_probability": 0.01}
    thresholds = site({"ramp": {"watch": limit}, "cr*": {"evacuate": limit}})
    alert = decided(evidence(area(200), area(200, name="crusher")), thresholds=thresholds)
    assert [sentence.split(" because")[0] for sentence in alert.held_by] == ["crusher: evacuate"]


def test_an_answer_older_than_one_that_was_decided_on_is_a_fault() -> None:
    alert = decide(decided(NORMAL), evidence(at_ns=NOW - 2 * S), site(), NOW)
    assert alert.level == Level.FAULT
    assert "1.000 s older than the answer" in alert.faults[0]
    again = decide(alert, evidence(at_ns=NOW - 2 * S), site(), NOW)
    assert again.level == Level.FAULT, "the same old answer does not become the newest by being looked at"


@pytest.mark.parametrize(("facts", "until"), [
    ({}, NOW + 10 * S),
    ({"trigger_stamp_ns": NOW - 25 * S}, NOW + 5 * S),
    ({"terrain_stamp_ns": NOW - 3599 * S}, NOW + S),
])  # fmt: skip
def test_a_decision_is_valid_no_longer_than_its_evidence(facts: dict[str, int], until: int) -> None:
    assert decided(evidence(**facts)).valid_until_ns == until
    assert decide(None, None, site(), NOW).valid_until_ns == NOW + 10 * S
