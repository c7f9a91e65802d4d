"""Tests of decisions on the ends over parameter sets of energy and first arrival: comparison, reason, log, refusal."""

import json
from pathlib import Path

import pytest
from live_sites.alert_evidence import NOW, area, decided, evidence, origin, site

from rpf3d_core.alerts import limits
from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.lines import Decision, canonical, decision_content, decision_of
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.origins import Origins
from rpf3d_core.live.evidence import together

SAMPLING = site(interval="sampling")
SETS = {"sets": 64, "predictive_low": 0.0, "predictive_high": 0.02}
ENERGY = {"p95_energy": 9e4, "largest_energy": 3e5, "energy_high": 2e5, "energy_sets": 50}
ARRIVAL = {"first_arrival_s": 12.0, "first_arrival_low_s": 9.0}
BOTH = area(100, **SETS, **ENERGY, **ARRIVAL)


def test_the_safe_ends_are_compared_unless_the_site_chooses_sampling():
    strong, fast = area(50, **SETS, **ENERGY), area(50, **SETS, **ARRIVAL)
    assert decided(evidence(strong)).level == Level.RESTRICT
    assert decided(evidence(fast)).level == Level.EVACUATE
    for one in (strong, fast):
        assert decided(evidence(one), thresholds=SAMPLING).level == Level.NORMAL


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        (ENERGY, "p95 energy 90000 J (up to 200000 J, predictive over 50 parameter sets), limit 100000 J"),
        ({**ENERGY, "energy_sets": 12}, "p95 energy 90000 J (up to 200000 J, the largest of all 64 parameter sets: "
         "only 12 have a p95, 39 are needed for a predictive interval), limit 100000 J"),
        ({**ENERGY, "p95_energy": 2e5, "energy_high": None, "energy_sets": 0},
         "p95 energy 200000 J (of all parameter sets together), limit 100000 J"),
        (ARRIVAL, "the first rock arrives after 12.0 s (after 9.0 s in the fastest of 64 parameter sets), but "
         "evacuation takes 8 s plus a margin of 2 s"),
        ({"first_arrival_s": 9.0}, "the first rock arrives after 9.0 s (of all parameter sets together), but "
         "evacuation takes 8 s plus a margin of 2 s"),
    ],
)  # fmt: skip
def test_the_reason_says_which_end_reached_the_limit(facts, words):
    assert words in decided(evidence(area(100, **SETS, **facts))).reasons[0]


def test_without_unknowns_reasons_and_lines_of_the_log_are_as_they_are_without_ends():
    strong = area(100, p95_energy=2e5, largest_energy=3e5)
    assert decided(evidence(strong)).reasons == ("ramp: restrict because p95 energy 200000 J, limit 100000 J",)
    few = area(10, p95_energy=None, largest_energy=2e5, first_arrival_s=9.0)
    assert decided(evidence(few)).reasons == (
        "ramp: evacuate because the first rock arrives after 9.0 s, but evacuation takes 8 s plus a margin of 2 s",
    )
    assert decided(evidence(area(10))).reasons == (
        "ramp: no limit is reached; 10 of 10,000 rocks reached the area (up to 0.184 %)",
    )
    content = decision_content(Decision(None, evidence(strong), None, NOW, decided(evidence(strong))))
    added = {"energy_high", "energy_sets", "first_arrival_low_s", "notes"}
    assert added.isdisjoint(content["evidence"]) and added.isdisjoint(content["evidence"]["areas"][0])


@pytest.mark.parametrize(
    "wrong",
    [{"energy_high": float("nan")}, {"energy_high": float("inf")}, {"energy_high": -1.0}, {"energy_high": 8e4},
     {"energy_sets": 65}, {"energy_sets": -1}, {"first_arrival_low_s": float("nan")}, {"first_arrival_low_s": -1.0},
     {"first_arrival_low_s": 13.0}, {"sets": 0, "predictive_low": None, "predictive_high": None}],
)  # fmt: skip
def test_impossible_ends_are_a_fault(wrong):
    assert decided(evidence(BOTH)).faults == ()
    assert decided(evidence(BOTH._replace(**wrong))).faults != ()


@pytest.mark.parametrize("end", [float("nan"), 0.0, None])
def test_a_wrong_end_hides_no_energy_of_all_rocks_together(end):
    assert decided(evidence(area(100, **SETS, p95_energy=2e5, largest_energy=3e5, energy_high=end))).evident >= (
        Level.RESTRICT
    )


def test_the_cluster_of_the_end_that_reached_the_limit_is_named():
    pooled, high, low = origin("pooled"), origin("high"), origin("low")
    origins = Origins(
        reached=pooled, predictive=pooled, energy=pooled, first_arrival=pooled, energy_high=high, first_arrival_low=low
    )
    for facts, expected in (
        (ENERGY, high), ({**ENERGY, "p95_energy": 1.5e5}, pooled), (ARRIVAL, low),
        ({**ARRIVAL, "first_arrival_s": 9.5}, pooled),
    ):  # fmt: skip
        (ramp,) = decided(evidence(area(100, **SETS, origins=origins, **facts))).areas
        assert ramp.origin == expected
    same = origins._replace(energy_high=None, first_arrival_low=None)
    (ramp,) = decided(evidence(area(100, **SETS, origins=same, **ENERGY))).areas
    assert ramp.origin == pooled


def test_of_several_walls_the_worst_ends_count_also_where_one_has_none():
    strong = area(100, **SETS, **ENERGY)
    fast = area(100, sets=64, predictive_low=0.0, predictive_high=0.02, **ARRIVAL, energy_high=5e3, energy_sets=64)
    for walls in ([strong, fast], [fast, strong]):
        (both,) = together([evidence(wall) for wall in walls]).areas
        assert (both.energy_high, both.energy_sets, both.first_arrival_low_s) == (2e5, 50, 9.0)
        assert decided(evidence(both)).faults == ()
    pending = area(100, sets=64, p95_energy=2.5e5, largest_energy=3e5, first_arrival_s=5.0)
    (both,) = together([evidence(BOTH), evidence(pending)]).areas
    assert both.energy_high == 2.5e5 and both.first_arrival_low_s == 5.0
    assert not [fault for fault in decided(evidence(both)).faults if "end of the" in fault]


def test_each_end_of_several_walls_is_of_the_wall_that_gave_it():
    one, other = (dict.fromkeys(("reached", "predictive", "energy", "first_arrival"), origin(topic))
                  for topic in ("one", "other"))  # fmt: skip
    weak = area(100, **SETS, energy_high=2e5, first_arrival_low_s=50.0, origins=Origins(**one))
    strong = area(100, **SETS, p95_energy=5e4, largest_energy=6e4, energy_high=7e4, first_arrival_s=40.0,
                  first_arrival_low_s=40.0, origins=Origins(**other))  # fmt: skip
    for walls in ([weak, strong], [strong, weak]):
        (both,) = together([evidence(wall) for wall in walls]).areas
        assert both.origins.energy == origin("other") and both.origins.energy_high == origin("one")
        assert both.origins.first_arrival == origin("other") and both.origins.first_arrival_low is None


def test_a_decision_with_ends_and_a_note_comes_back_from_its_line_and_is_reproduced(tmp_path: Path):
    pooled = origin("pooled")
    origins = Origins(
        reached=pooled, predictive=pooled, energy=origin("strong"), first_arrival=None, energy_high=pooled,
        first_arrival_low=origin("fast"),
    )  # fmt: skip
    answer = evidence(BOTH._replace(origins=origins, first_arrival_low_s=0.0), notes=("a note",))
    decision = Decision(None, answer, None, NOW, decide(None, answer, site(), NOW))
    assert decision_of(json.loads(canonical(decision_content(decision)))) == decision
    with DecisionLog(tmp_path / "log", "0.1.0") as log:
        log.decided(decision, site())
    audit = audit_log(tmp_path / "log")
    assert audit.sound and audit.notes == [], audit.findings


def test_a_note_of_the_evidence_is_in_the_reasons_and_changes_no_level():
    quiet = decided(evidence(area(10), notes=("a note",)))
    assert quiet.level == Level.NORMAL and quiet.faults == () and quiet.reasons[-1] == "a note"
    two = together([evidence(area(10), notes=("a note",)), evidence(area(10), notes=("another", "a note"))])
    assert two.notes == ("a note", "another")


def test_where_only_displaced_paths_reach_an_area_the_reason_does_not_say_that_no_rock_came():
    reached = area(0, **SETS, p95_energy=None, largest_energy=None, first_arrival_s=None, first_arrival_low_s=9.0)
    words = limits._arrival(reached, site().evidence)
    assert words.startswith("no rock reached the area on its own path, but some do on paths displaced by the misfit")
    assert "after 9.0 s in the fastest" in words
