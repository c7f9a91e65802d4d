"""Tests of the decision for each area: the same rules as for the site, applied to one area."""

import pytest
from live_sites.alert_evidence import NOW, RAMP, S, area, decided, evidence, later, seen_by, site

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Alert, Level

PIT = site({"ramp": RAMP, "crusher": RAMP, "truck_*": RAMP})
CALM = evidence(area(), area(name="crusher"))


def levels(alert: Alert) -> dict[str, Level]:
    """Return name -> shown level of each area."""
    return {one.name: one.level for one in alert.areas}


def test_each_area_has_its_own_level() -> None:
    alert = decided(evidence(area(3000), area(120, name="crusher"), area(name="truck_7")), thresholds=PIT)
    assert levels(alert) == {"ramp": Level.EVACUATE, "crusher": Level.WATCH, "truck_7": Level.NORMAL}
    assert alert.areas[1].why.startswith("watch because 120 of 10,000 rocks reached the area")
    assert alert.areas[2].why.startswith("no limit is reached; 0 of 10,000 rocks reached the area")


def test_an_area_is_held_by_itself_until_the_site_steps_down() -> None:
    one_after_the_other = decided(
        evidence(area(700), area(name="crusher")), evidence(area(), area(120, name="crusher")), CALM, thresholds=PIT
    )
    assert levels(one_after_the_other) == {"ramp": Level.RESTRICT, "crusher": Level.WATCH}
    assert [one.evident for one in one_after_the_other.areas] == [Level.NORMAL, Level.NORMAL]
    now = NOW + 3 * S
    still_rocks = later(evidence(area(), area(120, name="crusher")), 3)
    alert = decide(one_after_the_other, later(CALM, 3), PIT, now, seen_by(now))
    assert levels(alert) == {"ramp": Level.NORMAL, "crusher": Level.NORMAL}
    worse = decide(one_after_the_other, still_rocks, PIT, now)
    alert = decide(worse, later(still_rocks, 1), PIT, now + S, seen_by(now + S))
    assert (alert.void, alert.held) == ("", Level.WATCH)
    assert levels(alert) == {"ramp": Level.NORMAL, "crusher": Level.WATCH}


def test_of_several_answers_the_worst_is_told_of_an_area() -> None:
    for reached in ((120, 0), (0, 120)):
        alert = decided(evidence(*(area(n) for n in reached), area(name="crusher")), thresholds=PIT)
        assert levels(alert) == {"ramp": Level.WATCH, "crusher": Level.NORMAL}
        assert alert.areas[0].why.startswith("watch")


def test_a_fault_is_one_of_every_area_but_hides_no_evacuation() -> None:
    high = evidence(area(3000), area(120, name="crusher"), area(name="truck_7"))
    alert = decided(CALM, high, None, thresholds=PIT)
    assert levels(alert) == {"ramp": Level.EVACUATE, "crusher": Level.FAULT, "truck_7": Level.FAULT}
    assert {one.why for one in alert.areas} == {"there is no answer"}
    assert levels(decided(None, thresholds=PIT)) == {"ramp": Level.FAULT, "crusher": Level.FAULT}


def test_a_machine_that_left_is_told_of_as_long_as_a_level_of_it_is_held() -> None:
    moving = evidence(area(), area(name="crusher"), area(120, name="truck_7"), area(name="truck_8"))
    alert = decided(moving, CALM, thresholds=PIT)
    assert levels(alert) == {"ramp": Level.NORMAL, "crusher": Level.NORMAL, "truck_7": Level.WATCH}
    assert alert.areas[2].why == "the answer does not contain this area"
    now = NOW + 2 * S
    assert "truck_7" not in levels(decide(alert, later(CALM, 2), PIT, now, seen_by(now)))


def test_an_area_without_limits_has_no_level() -> None:
    alert = decided(evidence(area(), area(name="crusher"), area(3000, name="office")), thresholds=PIT)
    assert set(levels(alert)) == {"ramp", "crusher"}


def test_sources_that_are_refused_are_a_fault_of_every_area_that_was_told_of() -> None:
    """The evidence then contains no areas, and a display would continue to show the previous levels."""
    refused = evidence(faults=("the sources are refused",))._replace(areas=())
    moving = evidence(area(), area(name="crusher"), area(name="truck_7"))
    for thresholds in (PIT, site({"*": RAMP})):
        for answers in ((moving, refused), (moving, refused, None), (moving, None, refused)):
            told = levels(decided(*answers, thresholds=thresholds))
            assert told == dict.fromkeys(("ramp", "crusher", "truck_7"), Level.FAULT)


def test_a_small_answer_does_not_clear_an_area_that_no_decision_stands_on() -> None:
    small = evidence(area(flown=10), area(name="crusher", flown=10), area(name="truck_8", flown=10))
    alert = decided(CALM, small, thresholds=PIT)
    flown = "truck_8: only 10 rocks have flown (evidence.fewest_rocks: 1,000)"
    few = f"{flown}, and no earlier decision on this area is valid"
    assert (alert.level, alert.faults, alert.alarm) == (Level.FAULT, (few,), True)
    assert set(levels(alert).values()) == {Level.FAULT}
    again = decide(alert, later(small, 2), PIT, NOW + 2 * S)
    assert levels(again)["truck_8"] == Level.FAULT
    enough = later(evidence(area(), area(name="crusher"), area(name="truck_8")), 3)
    good = decide(again, enough, PIT, NOW + 3 * S)
    assert set(levels(good).values()) == {Level.NORMAL}
    assert set(levels(decide(good, later(small, 4), PIT, NOW + 4 * S)).values()) == {Level.NORMAL}
    worst = evidence(area(flown=10), area(name="crusher", flown=10), area(9, name="truck_8", flown=10))
    assert levels(decided(CALM, worst, thresholds=PIT))["truck_8"] == Level.EVACUATE


def test_an_acknowledgement_from_before_an_area_got_worse_lowers_nothing() -> None:
    """The evidence of the site as a whole did not get worse, because another area was as bad before."""
    one, both = evidence(area(700), area(name="crusher")), evidence(area(700), area(700, name="crusher"))
    alert = decided(evidence(area(3000), area(name="crusher")), one, both, CALM, thresholds=PIT)
    assert (alert.held, alert.worse_ns) == (Level.EVACUATE, NOW + 2 * S)
    now = NOW + 4 * S
    before, after = (decide(alert, later(CALM, 4), PIT, now, seen_by(NOW + at * S)) for at in (1, 3))
    assert before.void.startswith("the evidence has become worse since") and levels(before)["crusher"] == Level.RESTRICT
    assert after.void == "" and set(levels(after).values()) == {Level.NORMAL}


def test_an_area_that_the_site_sets_no_limits_for_any_more_says_so() -> None:
    held = decided(evidence(area(), area(700, name="crusher")), thresholds=PIT)
    alert = decide(held, later(evidence(area(), area(700, name="crusher")), 1), site(), NOW + S)
    assert levels(alert) == {"ramp": Level.NORMAL, "crusher": Level.RESTRICT}
    assert alert.areas[1].why == "the site file no longer has limits for this area"


@pytest.mark.parametrize("again", [None, CALM], ids=["without an answer", "with one"])
def test_after_a_decision_that_told_of_no_areas_any_may_have_been_the_one(again: Evidence | None) -> None:
    """The log is from a version without decisions for areas, and a node that starts again continues it."""
    pit = site({"ramp": RAMP, "crusher": RAMP, "wall: *": RAMP})
    both = evidence(area(700), area(700, name="crusher"), area(700, name="wall: north"))
    before = decided(both, thresholds=pit)
    words = tuple(sentence.replace(" because ", ", for ") for sentence in before.held_by)  # of that version
    before = before._replace(areas=(), held_by=words)
    told = None if again is None else later(again, 1)
    alert = decide(before, told, pit, NOW + S)
    held = dict.fromkeys(("ramp", "crusher", "wall: north"), Level.RESTRICT)
    assert {one.name: one.held for one in alert.areas} == held
    alert = decide(alert, later(CALM, 2), pit, NOW + 2 * S)
    assert levels(alert) == held
    alert = decide(alert, later(CALM, 3), pit, NOW + 3 * S, seen_by(NOW + 3 * S))
    assert levels(alert) == {"ramp": Level.NORMAL, "crusher": Level.NORMAL}
