"""Tests that the stated cause is the cluster whose figure reached the limit, in the newest answer."""

import json
from pathlib import Path

from live_sites.alert_evidence import EVACUATE, NORMAL, NOW, RESTRICT, S, area, decided, evidence, later, origin, site

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import AreaEvidence, Evidence
from rpf3d_core.alerts.levels import Alert, Level
from rpf3d_core.alerts.lines import Decision, canonical, decision_content, decision_of
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.origins import Origin, Origins, all_from

MANY, WIDE, STRONG, FAST = (origin(topic) for topic in ("many", "wide", "strong", "fast"))
ORIGINS = Origins(reached=MANY, predictive=WIDE, energy=STRONG, first_arrival=FAST)


def with_origins(one: AreaEvidence, origins: Origins = ORIGINS) -> Evidence:
    return evidence(one._replace(origins=origins))


def of_the_ramp(alert: Alert) -> Origin | None:
    (ramp,) = alert.areas
    return ramp.origin


def test_the_cluster_of_the_figure_that_reached_the_limit_is_named() -> None:
    over_sets = {"sets": 64, "predictive_low": 0.0, "predictive_high": 0.5, "left_high": 0.5}
    for one, expected in (
        (area(3000), MANY), (area(100, p95_energy=2e5, largest_energy=3e5), STRONG),
        (area(100, first_arrival_s=5.0), FAST), (area(100, **over_sets), WIDE), (area(0), None),
    ):  # fmt: skip
        assert of_the_ramp(decided(with_origins(one))) == expected
    sampling = decided(with_origins(area(600, **over_sets)), thresholds=site(interval="sampling"))
    assert of_the_ramp(sampling) == MANY


def test_a_level_that_is_held_keeps_the_cluster_that_gave_it_last() -> None:
    first, second = (with_origins(area(3000), all_from(origin(topic))) for topic in ("first", "second"))
    assert of_the_ramp(decided(first, NORMAL, RESTRICT, None)) == origin("first")
    assert of_the_ramp(decided(first, second, NORMAL)) == origin("second")
    risen = decided(with_origins(area(700), all_from(origin("first"))), second, with_origins(area(700)))
    assert (risen.held, of_the_ramp(risen)) == (Level.EVACUATE, origin("second"))


def test_a_decision_with_clusters_comes_back_from_its_line_and_is_reproduced(tmp_path: Path) -> None:
    answer = with_origins(area(3000), ORIGINS._replace(energy=MANY, first_arrival=None))
    alert = decide(None, answer, site(), NOW)
    decision = Decision(None, answer, None, NOW, alert)
    content = decision_content(decision)
    assert set(content["evidence"]["areas"][0]["origins"]) == {"reached", "predictive", "first_arrival"}
    assert decision_of(json.loads(canonical(content))) == decision
    with DecisionLog(tmp_path / "log", "0.1.0") as log:
        log.decided(decision, site())
        held = decide(alert, later(NORMAL, 1), site(), NOW + S)
        log.decided(Decision(alert, later(NORMAL, 1), None, NOW + S, held), site())
        assert log.last_alert is not None and of_the_ramp(log.last_alert) == MANY
    audit = audit_log(tmp_path / "log")
    assert audit.sound and audit.notes == [], audit.findings


def test_the_survey_of_the_answer_is_in_the_decision() -> None:
    assert [decided(answer).terrain_digest for answer in (EVACUATE, None)] == ["7e" * 32, ""]
    assert [decided(answer).terrain_stamp_ns for answer in (EVACUATE, None)] == [NOW - 60 * S, 0]
