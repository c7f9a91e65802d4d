"""Tests that the joint evidence of several walls is never less severe than the evidence of any wall."""

from itertools import permutations

import pytest
from live_sites.alert_evidence import NOW, S, area, evidence, origin, site

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.origins import Origins, all_from
from rpf3d_core.live.evidence import together

QUIET = evidence(area(100, p95_energy=1e3, largest_energy=2e3))


def shown(*parts):
    return decide(None, together(parts), site(), NOW)


@pytest.mark.parametrize("first", [True, False], ids=["first", "last"])
def test_few_strong_rocks_of_one_wall_are_not_hidden_by_many_weak_ones_of_another(first):
    strong = evidence(area(10, p95_energy=None, largest_energy=2e5))
    assert shown(strong).level == Level.RESTRICT
    assert shown(*((strong, QUIET) if first else (QUIET, strong))).level == Level.RESTRICT


@pytest.mark.parametrize("first", [True, False], ids=["first", "last"])
def test_weak_rocks_of_one_wall_do_not_make_the_rocks_rare_that_left_the_terrain_at_another(first):
    """28 rocks of one wall may come with any energy. Among the 700 weak rocks of the other wall they would be rare."""
    left = evidence(area(0, p95_energy=None, largest_energy=None, first_arrival_s=None, left=28))
    weak = evidence(area(700, p95_energy=1e3, largest_energy=2e3))
    limits = site({"ramp": {"restrict": {"p95_energy_j": 1e5}}})
    alone, both = (
        decide(None, together(parts), limits, NOW)
        for parts in ([left], [left, weak] if first else [weak, left])
    )  # fmt: skip
    assert alone.level == both.level == Level.FAULT
    assert any("28 of" in fault and "left the terrain" in fault for fault in both.faults)
    assert decide(None, weak, limits, NOW).level == Level.NORMAL
    three = together([together([left, weak]), weak])
    assert decide(None, three, limits, NOW).level == Level.FAULT, "combined twice"


def test_each_figure_is_of_the_wall_that_gave_it():
    facts = {"sets": 9, "predictive_low": 0.0}
    many = area(900, predictive_high=0.2, origins=all_from(origin("many")), **facts)
    wide = area(100, predictive_high=0.6, origins=all_from(origin("wide")), **facts)
    strong = area(
        100, p95_energy=None, largest_energy=9e4, predictive_high=0.1, origins=all_from(origin("strong")), **facts
    )
    fast = area(100, first_arrival_s=3.0, predictive_high=0.1, **facts)
    for order in permutations((many, wide, strong, fast)):
        (ramp,) = together([evidence(one) for one in order]).areas
        assert ramp.origins == Origins(
            reached=origin("many"), predictive=origin("wide"), energy=origin("strong"), first_arrival=None
        )


def test_a_wall_without_an_answer_hides_no_other_and_is_a_fault():
    unanswered = evidence()._replace(areas=(), faults=("off the terrain",))
    alert = shown(evidence(area(1000)), unanswered)
    assert alert.evident == Level.RESTRICT and alert.level == Level.FAULT


def test_together_they_are_as_old_as_the_oldest_trigger_and_the_oldest_survey():
    old = QUIET._replace(trigger_stamp_ns=NOW - 9 * S, terrain_stamp_ns=NOW - 99 * S)
    found = together([old, QUIET])
    assert (found.trigger_stamp_ns, found.terrain_stamp_ns) == (NOW - 9 * S, NOW - 99 * S)
