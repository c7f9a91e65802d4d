"""What is decided of each area: as of the site, but of one area alone."""

from alert_evidence import NOW, RAMP, S, area, decided, evidence, later, seen_by, site

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.levels import Alert, Level

PIT = site({"ramp": RAMP, "crusher": RAMP, "truck_*": RAMP})
CALM = evidence(area(), area(name="crusher"))


def levels(alert: Alert) -> dict[str, Level]:
    """Name -> what is shown of the area."""
    return {one.name: one.level for one in alert.areas}


def test_each_area_has_its_own_level() -> None:
    alert = decided(evidence(area(3000), area(120, name="crusher"), area(name="truck_7")), thresholds=PIT)
    assert levels(alert) == {"ramp": Level.EVACUATE, "crusher": Level.WATCH, "truck_7": Level.NORMAL}
    assert alert.areas[1].why.startswith("watch, for 120 of 10,000 rocks came")
    assert alert.areas[2].why.startswith("no limit is reached; 0 of 10,000 rocks came")


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
    assert alert.areas[2].why == "the answer says nothing of it"
    now = NOW + 2 * S
    assert "truck_7" not in levels(decide(alert, later(CALM, 2), PIT, now, seen_by(now)))


def test_an_area_without_limits_has_no_level() -> None:
    alert = decided(evidence(area(), area(name="crusher"), area(3000, name="office")), thresholds=PIT)
    assert set(levels(alert)) == {"ramp", "crusher"}


def test_after_a_decision_that_told_of_no_areas_all_are_held_as_the_site_was() -> None:
    """A log that was written before areas were decided: any of them may be the one."""
    before = decided(evidence(area(), area(700, name="crusher")), thresholds=PIT)._replace(areas=())
    now = NOW + S
    alert = decide(before, later(CALM, 1), PIT, now)
    assert levels(alert) == {"ramp": Level.RESTRICT, "crusher": Level.RESTRICT}
    alert = decide(alert, later(CALM, 2), PIT, now + S, seen_by(now + S))
    assert levels(alert) == {"ramp": Level.NORMAL, "crusher": Level.NORMAL}
