"""Tests of sites that require two persons: the first acknowledgement waits, for a limited time, for another name."""

from pathlib import Path

import pytest
from live_sites.alert_evidence import EVACUATE, NORMAL, NOW, RESTRICT, S, decided, later, seen_by, site
from programs.command_line import call

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import ANOTHER_PERSON, Acknowledgement, Alert, Level, acknowledgement
from rpf3d_core.alerts.lines import Decision, alert_content
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.persons import person_of
from rpf3d_core.alerts.site_model import AcknowledgeSpec, Thresholds

WITHIN = 20
ONE = site()


def two(held_from: str = "watch") -> Thresholds:
    terms = AcknowledgeSpec(persons=2, held_from=held_from, within_s=WITHIN)
    return ONE.model_copy(update={"acknowledge": terms})


TWO = two()
HELD = decided(EVACUATE, NORMAL, thresholds=TWO)
"""An alert that holds `evacuate` while the newest answer is normal."""


def said(by: str, second: float) -> Acknowledgement:
    return acknowledgement(by, f"{by} has looked", NOW + round(second * S), client=f"/{by[0]} (enclave /)")


def step(alert: Alert, second: int, by: str = "", answer: Evidence | None = NORMAL, terms: Thresholds = TWO) -> Alert:
    told = None if answer is None else later(answer, second)
    return decide(alert, told, terms, NOW + second * S, said(by, second) if by else None)


def test_the_level_falls_only_when_another_person_acknowledges_too() -> None:
    first = step(HELD, 2, "A. Shift")
    assert (first.level, first.held) == (Level.EVACUATE, Level.EVACUATE)
    assert ANOTHER_PERSON in first.void and first.waiting == (said("A. Shift", 2),)
    assert first.waiting_until_ns == NOW + (2 + WITHIN) * S
    assert "A. Shift has acknowledged: A. Shift has looked; another person must acknowledge by" in first.reasons[1]
    between = step(first, 3)
    assert between.waiting == first.waiting and between.reasons[0].startswith("A. Shift has acknowledged")
    second = step(between, 4, "B. Survey")
    assert (second.level, second.held, second.void, second.waiting) == (Level.NORMAL, Level.NORMAL, "", ())
    assert step(HELD, 2, "A. Shift", terms=ONE).level == Level.NORMAL, (
        "one person is enough where the site says nothing"
    )


@pytest.mark.parametrize("again", ["A. Shift", "a shift", "A.  SHIFT ", "Á. Shift"])
def test_the_same_name_counts_once(again: str) -> None:
    alert = step(step(HELD, 2, "A. Shift"), 3, again)
    assert alert.held == Level.EVACUATE and ANOTHER_PERSON in alert.void
    assert alert.waiting == (said(again, 3),)


def test_the_first_acknowledgement_is_void_after_the_stated_time() -> None:
    first = step(HELD, 2, "A. Shift")
    in_time, too_late = (step(first, 2 + WITHIN + late, "B. Survey") for late in (0, 1))
    assert in_time.held == Level.NORMAL
    assert too_late.held == Level.EVACUATE and too_late.waiting == (said("B. Survey", 3 + WITHIN),)
    expired = step(first, 3 + WITHIN)
    assert expired.waiting == () and expired.waiting_until_ns is None
    assert not any(ANOTHER_PERSON in reason for reason in expired.reasons)


@pytest.mark.parametrize("meanwhile", [None, RESTRICT, EVACUATE], ids=["a fault", "worse", "evacuate"])
def test_what_the_first_person_saw_does_not_count_after_the_evidence_got_worse_or_had_a_fault(meanwhile) -> None:
    first = step(HELD, 2, "A. Shift")
    worse = step(first, 3, answer=meanwhile)
    assert worse.waiting == ()
    calm = step(worse, 4)
    assert step(calm, 5, "B. Survey").held == Level.EVACUATE


def test_an_acknowledgement_that_does_not_count_waits_for_no_one() -> None:
    faulty = step(step(HELD, 2, "A. Shift", answer=None), 3)
    assert faulty.waiting == ()
    early = step(decided(EVACUATE, thresholds=TWO), 1, "A. Shift", answer=EVACUATE)
    assert early.waiting == () and early.void.startswith("the evidence still gives evacuate")


def test_the_site_says_from_which_held_level_two_are_needed() -> None:
    held = decided(RESTRICT, NORMAL)
    assert step(held, 2, "A. Shift", terms=two("evacuate")).held == Level.NORMAL
    assert step(held, 2, "A. Shift", terms=two("restrict")).held == Level.RESTRICT
    assert step(HELD, 2, "A. Shift", terms=two("evacuate")).held == Level.EVACUATE


def test_names_are_compared_by_letters_and_digits() -> None:
    assert person_of("J. Müller-2") == person_of("j muller 2") == "jmuller2"
    assert person_of("J. Meyer") != person_of("K. Meyer")


def test_both_persons_stand_in_the_log_and_the_audit_decides_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    alert: Alert | None = None
    with DecisionLog(tmp_path / "log", "0.1.0") as log:
        for second, by in enumerate(("", "", "A. Shift", "B. Survey")):
            answer, now = later(NORMAL if second else EVACUATE, second), NOW + second * S
            given = said(by, second) if by else None
            before, alert = alert, decide(alert, answer, TWO, now, given)
            log.decided(Decision(before, answer, given, now, alert), TWO)
    found = audit_log(tmp_path / "log")
    assert found.sound and found.reproduced == 4, found.findings
    assert [change.alert.waiting for change in found.changes][-2:] == [(said("A. Shift", 2),), ()]
    text = (tmp_path / "log" / "decisions-000001.jsonl").read_text(encoding="utf-8")
    assert '"client":"/A (enclave /)"' in text and '"client":"/B (enclave /)"' in text
    assert call(monkeypatch, "audit", tmp_path / "log") == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "acknowledgement waiting for another person, by A. Shift" in shown and "acknowledged by" in shown


def test_an_acknowledgement_of_one_person_has_no_keys_that_older_logs_lack() -> None:
    content = alert_content(decide(HELD, later(NORMAL, 2), ONE, NOW + 2 * S, seen_by(NOW + 2 * S)))
    assert set(content["acknowledgement"]) == {"by", "why", "at_ns"} and "waiting" not in content


@pytest.mark.parametrize(("terms", "key"), [
    ({"persons": 3}, "persons"), ({"persons": 0}, "persons"), ({"persons": 2, "within_s": 0}, "within_s"),
    ({"held_from": "fault"}, "held_from"), ({"people": 2}, "people"),
])  # fmt: skip
def test_terms_that_are_none_are_refused(terms: dict, key: str) -> None:
    with pytest.raises(ValueError, match=key):
        Thresholds.model_validate({**ONE.model_dump(), "acknowledge": terms})
