"""Tests that evidence for the former place of a moved area is a fault after the stated time."""

import json
from pathlib import Path

import pytest
from live_sites.alert_evidence import NORMAL, NOW, S, area, decided, evidence, later, seen_by, site

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence, Outdated
from rpf3d_core.alerts.levels import Alert, Judged, Level
from rpf3d_core.alerts.lines import Decision, canonical, decision_content, decision_of
from rpf3d_core.alerts.log import DecisionLog

HERE, THERE = "aa" * 32, "bb" * 32


def at_place(outline: str, reached: int = 0, flown: int = 10_000, outlined_ns: int = NOW) -> Evidence:
    """Return evidence of the ramp with an outline that is watched since `outlined_ns`."""
    return evidence(area(reached, flown=flown, outline=outline, outlined_ns=outlined_ns))


def judged(alert: Alert) -> Judged | None:
    (ramp,) = alert.areas
    return ramp.judged


def test_an_answer_for_the_former_place_of_an_area_is_a_fault_after_the_stated_time() -> None:
    since = NOW + S // 2
    outdated = NORMAL._replace(outdated=(Outdated("ramp", since),))
    early = decide(decided(NORMAL), later(outdated, 1), site(), NOW + S)
    assert early.level == Level.NORMAL and early.valid_until_ns == since + S, "the decision ends with the stated time"
    (fault,) = decide(early, later(outdated, 2), site(), since + S).faults
    assert fault.startswith("ramp: the area moved 1.000 s ago, and some sources are not yet simulated")
    assert decide(early, later(outdated, 2), site(moved_area_s=3), since + S).level == Level.NORMAL
    assert decide(early, later(outdated, 1), site(moved_area_s=0), since).level == Level.FAULT


def test_an_area_without_limits_may_move() -> None:
    outdated = NORMAL._replace(outdated=(Outdated("office", NOW - 100 * S),))
    assert decided(outdated).faults == ()


def test_a_small_answer_for_a_new_place_stands_on_the_decision_for_the_former_place_for_the_stated_time_only() -> None:
    alert, move = decided(at_place(HERE)), NOW + S
    small = at_place(THERE, flown=10, outlined_ns=move)
    first = decide(alert, later(small, 1), site(), move + S // 4)
    assert (first.level, judged(first)) == (Level.NORMAL, Judged(outline=HERE, moved_ns=move))
    assert first.valid_until_ns == move + S
    moved_again = at_place("cc" * 32, flown=10, outlined_ns=move + S // 2)
    again = decide(first, later(moved_again, 1), site(), move + 3 * S // 4)
    assert judged(again) == judged(first), "the place that was judged was left at the first move"
    over = decide(again, later(moved_again, 2), site(), move + S)
    assert over.level == Level.FAULT and "only 10 rocks have flown" in over.faults[0]
    full = decide(over, later(at_place(THERE, outlined_ns=move), 3), site(), move + 2 * S)
    assert (full.level, judged(full)) == (Level.NORMAL, Judged(outline=THERE, moved_ns=None))


def test_a_small_answer_for_the_place_that_was_judged_stands_as_long_as_the_decision() -> None:
    alert = decide(decided(at_place(HERE)), later(at_place(HERE, flown=10), 5), site(), NOW + 5 * S)
    assert alert.level == Level.NORMAL and alert.valid_until_ns == NOW + 10 * S


def test_a_place_of_another_configuration_is_never_the_base_of_a_small_answer() -> None:
    """An outline from the scene has the time 0, because it is watched from the start."""
    small = later(at_place(THERE, flown=10, outlined_ns=0), 1)
    assert decide(decided(at_place(HERE, outlined_ns=0)), small, site(), NOW + S).level == Level.FAULT


def test_an_acknowledgement_of_one_who_saw_the_former_place_lowers_nothing_that_is_above_normal() -> None:
    alert = decided(at_place(HERE, 3000), at_place(HERE, 700))
    same, moved = (
        decide(alert, later(at_place(outline, 700), 2), site(), NOW + 2 * S, seen_by(NOW + 2 * S))
        for outline in (HERE, THERE)
    )
    assert (same.void, same.held) == ("", Level.RESTRICT)
    assert moved.void.startswith("the evidence has become worse") and moved.held == Level.EVACUATE
    calm = decide(alert, later(at_place(THERE), 2), site(), NOW + 2 * S, seen_by(NOW + 2 * S))
    assert (calm.void, calm.held) == ("", Level.NORMAL)


def test_the_outline_stands_in_the_log_and_the_audit_decides_on_it_again(tmp_path: Path) -> None:
    first, move = at_place(HERE), NOW + S
    alert = decide(None, first, site(), NOW)
    answers = [later(at_place(THERE, flown=10, outlined_ns=move), 1), later(NORMAL, 2)]
    answers[1] = answers[1]._replace(outdated=(Outdated("ramp", move),))
    with DecisionLog(tmp_path / "log", "0.1.0") as log:
        log.decided(Decision(None, first, None, NOW, alert), site())
        for answer, now in zip(answers, (move + S // 2, move + 2 * S), strict=True):
            before, alert = alert, decide(alert, answer, site(), now)
            decision = Decision(before, answer, None, now, alert)
            assert decision_of(json.loads(canonical(decision_content(decision)))) == decision
            log.decided(decision, site())
    assert alert.level == Level.FAULT
    audit = audit_log(tmp_path / "log")
    assert audit.sound and audit.reproduced == 3, audit.findings
    assert HERE in (tmp_path / "log" / "decisions-000001.jsonl").read_text(encoding="utf-8")


@pytest.mark.parametrize("seconds", [-1, 1e10])
def test_the_time_for_a_moved_area_is_a_period(seconds: float) -> None:
    with pytest.raises(ValueError, match="moved_area_s"):
        site(moved_area_s=seconds)
