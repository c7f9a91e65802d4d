"""Tests that a live scene with unknowns flies its parameter sets, and the predictive upper end decides by default."""

from pathlib import Path

import numpy as np
import pytest
from live_sites.alert_evidence import NOW, area, decided, evidence, site
from live_sites.unknown_slope import RANGE, SCENE, SETS, stages, standing_with
from live_sites.watched_road import LIMITS, ON_THE_SLOPE, ROAD, WANTED, behind_a_bank, decided_on, slope

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.lines import Decision
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.errors import InputError
from rpf3d_core.live.cluster_sets import ROCKS_A_SET
from rpf3d_core.live.evidence import together
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.scene import live_scene
from rpf3d_core.live.standing import stand_after, stand_on
from rpf3d_core.live.survey import GridSurvey


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("live")


@pytest.fixture(scope="module")
def found(folder):
    return stages(standing_with(folder), [ON_THE_SLOPE])


def test_the_road_has_a_predictive_interval_that_is_wider_than_the_sampling_interval(found):
    (road,) = found[-1].evidence
    assert road.sets == SETS and road.flown >= ROCKS_A_SET * SETS
    assert road.predictive_low <= road.low <= road.high < road.predictive_high
    assert road.predictive_high > 2.0 * road.high, "what is not known about the ground decides"
    assert found[-1].maps.flown == found[-1].rocks == road.flown


def test_a_first_stage_of_few_rocks_of_each_set_is_small(found):
    (road,) = found[0].evidence
    assert road.sets == SETS and road.predictive_high is None
    areas = {"road": {"watch": {"reach_probability": 0.9}}}
    alert = decided_on(found[0], site(areas, fewest_rocks=40))
    assert alert.level == Level.FAULT and "predictive interval" in alert.faults[0]
    assert decided_on(found[0], site(areas, fewest_rocks=40, interval="sampling")).level == Level.NORMAL


def test_the_site_chooses_the_interval_and_the_reason_says_which(found):
    (road,) = found[-1].evidence
    limit = 0.5 * (road.high + road.predictive_high)
    areas = {"road": {"restrict": {"reach_probability": limit}}}
    safe, sampling = (decided_on(found[-1], site(areas, fewest_rocks=WANTED, **terms))
                      for terms in ({}, {"interval": "sampling"}))  # fmt: skip
    assert (safe.level, sampling.level) == (Level.RESTRICT, Level.NORMAL)
    assert f"predictive over {SETS} parameter sets" in safe.reasons[0]
    assert "from the number of rocks only" in sampling.reasons[0]


def test_an_audit_makes_the_same_decisions_from_the_log(found, tmp_path):
    thresholds, previous = site({"road": LIMITS}, fewest_rocks=WANTED), None
    with DecisionLog(tmp_path, "0.1.0") as log:
        for step, answer in enumerate(found):
            told = evidence(*answer.evidence, sources=answer.sources, unfinished=answer.unfinished)
            alert = decide(previous, told, thresholds, NOW + step)
            log.decided(Decision(previous, told, None, NOW + step, alert), thresholds)
            previous = alert
    audit = audit_log(tmp_path)
    assert audit.sound and audit.decisions == len(found) > 1
    text = "".join(path.read_text() for path in tmp_path.iterdir())
    assert '"predictive_high":' in text and r'\"interval\":\"predictive\"' in text


def test_the_answer_has_the_same_bits_again_and_one_cluster_is_all_sources(folder, found):
    again = stages(standing_with(folder), [ON_THE_SLOPE])
    assert [one.evidence for one in again] == [one.evidence for one in found]
    assert [one.maps.cells.rocks.tobytes() for one in again] == [one.maps.cells.rocks.tobytes() for one in found]


def test_one_dangerous_source_keeps_its_predictive_interval_among_harmless_ones(folder):
    standing = standing_with(folder, points=behind_a_bank(slope()))
    harmless = [(10.0, 90.0 + 1.5 * i, 31.0) for i in range(6)]
    both = ([ON_THE_SLOPE], [*harmless, ON_THE_SLOPE])
    (alone,), (among,) = (stages(standing, places)[-1].evidence for places in both)
    assert among.clusters > 1 and among.sets == SETS
    assert among.predictive_high == pytest.approx(alone.predictive_high, abs=0.15)
    assert among.pooled_reached < 0.6 * among.pooled_flown


def test_a_misfit_widens_the_interval_of_the_road(folder):
    """The coefficients are nearly known, but the misfit of the model is 8 m."""
    narrow = "{prior: {min: 0.45, max: 0.4501}}"
    edge = np.array([[58.0, 2.0], [72.0, 2.0], [72.0, 158.0], [58.0, 158.0]])
    (known,), (unsure,) = (
        stages(standing_with(folder, narrow, misfit), [ON_THE_SLOPE], road=edge)[-1].evidence
        for misfit in ("", ", misfit: 8")
    )
    assert known.reached == unsure.reached, "the flights are the same"
    assert known.predictive_high - known.predictive_low < 0.1
    assert unsure.predictive_high > known.predictive_high + 0.2


def test_over_a_patch_the_parameter_sets_fly_as_over_the_whole_terrain(folder):
    """The patch repeats points of the survey, so only the way in which the terrain is prepared changes."""
    before, workshop = standing_with(folder), Workshop()
    whole = stand_on(workshop.whole(GridSurvey(slope())), before.scene)
    _ = whole.cells
    patch = GridSurvey(slope()[100:140, 50:70])
    standing = stand_after(whole, workshop.patched(whole.ground, patch))
    assert len(standing.sets.flights) == SETS and standing.flight is standing.sets.flights[0]
    assert standing.sets.flights is not whole.sets.flights
    (road,) = stages(standing, [ON_THE_SLOPE])[-1].evidence
    (same,) = stages(before, [ON_THE_SLOPE])[-1].evidence
    assert road.predictive_high == pytest.approx(same.predictive_high, abs=0.1) and road.sets == same.sets == SETS


def test_a_wrong_sample_is_refused_before_any_rock_flies(folder):
    path = folder / "wrong.yaml"
    path.write_text(SCENE.format(R_n="0.4", misfit=", sample: none.parquet"))
    with pytest.raises(InputError, match=r"none\.parquet"):
        stand_on(Workshop().whole(GridSurvey(slope())), live_scene({"scene": str(path)}))


OVER_SETS = {"sets": 64, "predictive_low": 0.0, "predictive_high": 0.08}


def test_the_upper_end_of_the_predictive_interval_raises_the_level():
    assert decided(evidence(area(70))).level == Level.NORMAL
    assert decided(evidence(area(70, **OVER_SETS))).level == Level.RESTRICT
    assert decided(evidence(area(70, **OVER_SETS)), thresholds=site(interval="sampling")).level == Level.NORMAL
    assert decided(evidence(area(70, **OVER_SETS)), thresholds=site(reach_probability_is="share")).level == Level.NORMAL


@pytest.mark.parametrize(
    "wrong",
    [{"predictive_high": None}, {"predictive_low": None}, {"predictive_high": float("nan")}, {"predictive_high": 1.5},
     {"predictive_high": 0.001}, {"sets": 0}, {"sets": -1}],
)  # fmt: skip
def test_an_impossible_predictive_interval_is_a_fault(wrong):
    assert decided(evidence(area(70, **{**OVER_SETS, **wrong}))).faults != ()


def test_sets_without_an_interval_lower_nothing_and_clear_nothing():
    pending = {"sets": 64, "predictive_low": None, "predictive_high": None}
    assert decided(evidence(area(70, **pending))).level == Level.FAULT
    assert decided(evidence(area(70, **pending)), thresholds=site(interval="sampling")).level == Level.NORMAL
    assert decided(evidence(area(3000, **pending))).level in (Level.EVACUATE, Level.FAULT)


def test_of_several_walls_the_worst_predictive_interval_counts():
    one, other = (evidence(area(reached, sets=64, predictive_low=low, predictive_high=high))
                  for reached, low, high in ((50, 0.001, 0.09), (90, 0.002, 0.05)))  # fmt: skip
    (both,) = together([one, other]).areas
    assert (both.reached, both.sets, both.predictive_high) == (90, 64, 0.09)
    assert both.predictive_low <= both.low
    pending = evidence(area(50, sets=64))
    assert together([one, pending]).areas[0].predictive_high is None, "the wall without an interval hides nothing"


LEFT_ALONE = site({"ramp": {"evacuate": {"reach_probability": 0.1}}}, most_left=0.5)
"""Site for which rocks that left the terrain are a fault only if they would raise the level."""


def test_rocks_that_left_count_as_if_they_had_reached_the_area():
    left = area(70, left=300, **OVER_SETS)
    alert = decided(evidence(left), thresholds=LEFT_ALONE)
    assert alert.level == Level.FAULT and "left the terrain" in alert.faults[0]


@pytest.mark.parametrize(
    ("left_high", "level"), [(0.32, Level.FAULT), (0.09, Level.NORMAL), (None, Level.FAULT)]
)  # fmt: skip
def test_few_rocks_that_left_in_few_sets_count_in_their_sets(left_high, level):
    """One rock in a hundred left, half of these in one of 64 sets; pooled, they would raise the share by only 1 %."""
    few = area(4, left=100, sets=64, predictive_low=0.0, predictive_high=0.002, left_high=left_high)
    assert decided(evidence(few), thresholds=LEFT_ALONE).level == level


def test_an_upper_end_with_the_rocks_that_left_cannot_be_lower_than_without_them():
    assert decided(evidence(area(70, left_high=0.05, **OVER_SETS))).faults != ()


def test_where_the_survey_ends_before_the_road_the_rocks_that_left_count_set_by_set(folder, found):
    cut = standing_with(folder, points=slope()[:, :62])
    (road,) = stages(cut, [ON_THE_SLOPE])[-1].evidence
    (whole,) = found[-1].evidence
    pooled = road.left / road.flown
    assert road.reached == 0 < road.left
    assert road.left_high > whole.predictive_high - 0.1 > 2.0 * pooled, "rocks leave in the sets that run far"


def test_fragments_count_as_rocks_of_their_set(folder, tmp_path):
    path = tmp_path / "live.yaml"
    path.write_text(
        SCENE.format(R_n=RANGE, misfit="")
        + "effects: {fragmentation: {least_ratio: 0.4, least_volume: 0.02, generations: 1}}\n"
    )
    standing = stand_on(Workshop().whole(GridSurvey(slope())), live_scene({"scene": str(path)}))
    answer = stages(standing, [ON_THE_SLOPE], road=np.array(ROAD))[-1]
    (road,) = answer.evidence
    assert road.flown % 100 != 0, "every stage has some hundred rocks, and their fragments"
    assert 0.0 <= road.predictive_low <= road.low <= road.high <= road.predictive_high <= 1.0
    assert decided_on(answer, site({"road": LIMITS}, fewest_rocks=WANTED)).faults == ()
