"""Tests of the time since which a level is shown without a break, also after expiry of a decision or a restart."""

from pathlib import Path

import pytest
from live_sites.alert_evidence import (
    EVACUATE,
    NORMAL,
    NOW,
    RAMP,
    RESTRICT,
    WATCH,
    S,
    area,
    decided,
    evidence,
    later,
    logged_shift,
    seen_by,
    site,
)

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Alert, Since
from rpf3d_core.alerts.log import DecisionLog

VALID = 10
"""Time (s) for which a decision of the small site is valid."""


def at(second: float) -> int:
    return NOW + round(second * S)


def sinces(alert: Alert) -> set[Since | None]:
    """Return the set of times since which the levels of the site and of its areas are shown."""
    return {alert.since, *(one.since for one in alert.areas)}


def continued(alert: Alert, answer: Evidence | None, second: float) -> Alert:
    told = None if answer is None else answer._replace(at_ns=at(second) - S, trigger_stamp_ns=at(second) - 2 * S)
    return decide(alert, told, site(), at(second))


def test_decisions_that_show_the_same_level_do_not_renew_its_time() -> None:
    for answer, not_normal in ((NORMAL, None), (WATCH, NOW), (EVACUATE, NOW), (None, NOW)):
        assert sinces(decided(answer, answer, answer)) == {Since(level_ns=NOW, not_normal_ns=not_normal)}


def test_the_time_of_a_level_begins_with_the_level_and_that_of_any_level_above_normal_goes_on() -> None:
    alert = decided(NORMAL, NORMAL, WATCH, RESTRICT, None, RESTRICT)
    assert sinces(alert) == {Since(level_ns=at(5), not_normal_ns=at(2))}
    calm = continued(alert, NORMAL, 6)
    assert sinces(calm) == sinces(alert), "the level is held"
    lowered = decide(calm, later(NORMAL, 7), site(), at(7), seen_by(at(7)))
    assert sinces(lowered) == {Since(level_ns=at(7), not_normal_ns=None)}


def test_each_area_has_its_own_time() -> None:
    pit = site({"ramp": RAMP, "crusher": RAMP})
    both = [evidence(area(a), area(b, name="crusher")) for a, b in ((0, 0), (700, 0), (700, 120))]
    alert = decided(*both, thresholds=pit)
    assert alert.since == Since(level_ns=at(1), not_normal_ns=at(1))
    assert [one.since for one in alert.areas] == [Since(at(1), at(1)), Since(at(2), at(2))]


@pytest.mark.parametrize(("answer", "expected"), [
    (NORMAL, Since(level_ns=at(20), not_normal_ns=None)),
    (RESTRICT, Since(level_ns=at(20), not_normal_ns=NOW)),
    (EVACUATE, Since(level_ns=NOW, not_normal_ns=NOW)),
    (None, Since(level_ns=NOW, not_normal_ns=NOW)),
])  # fmt: skip
def test_after_the_end_of_a_decision_a_subscriber_has_shown_a_fault_so_the_level_begins_again(answer, expected) -> None:
    """After the expiry, `evacuate` is kept, and a fault stays a fault."""
    assert sinces(continued(decided(answer), answer, 20)) == {expected}


def test_a_fault_that_follows_after_the_end_of_a_decision_began_with_the_end() -> None:
    assert sinces(continued(decided(NORMAL), None, 20)) == {Since(level_ns=at(VALID), not_normal_ns=at(VALID))}
    assert sinces(continued(decided(WATCH), None, 20)) == {Since(level_ns=at(VALID), not_normal_ns=NOW)}


def test_where_the_clock_goes_back_no_level_began_in_the_future() -> None:
    assert sinces(continued(decided(None), None, -5)) == {Since(level_ns=at(-5), not_normal_ns=at(-5))}


def test_the_log_keeps_the_time_over_a_restart(tmp_path: Path) -> None:
    before = logged_shift(tmp_path / "log")[3]
    with DecisionLog(tmp_path / "log", "0.1.0") as log:
        last = log.last_alert
    assert last is not None and last.since == Since(level_ns=at(5), not_normal_ns=None)
    assert sinces(before) == {Since(level_ns=at(2), not_normal_ns=at(1))}
    assert sinces(continued(last, NORMAL, 7)) == {Since(level_ns=at(5), not_normal_ns=None)}
    assert audit_log(tmp_path / "log").sound
