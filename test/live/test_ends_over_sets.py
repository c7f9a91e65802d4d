"""Tests that limits of energy and first arrival compare the safe end over the parameter sets of unknown ground."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from live_sites.alert_evidence import area, site
from live_sites.unknown_slope import SETS, stages, standing_with
from live_sites.watched_road import ON_THE_SLOPE, WANTED, decided_on, last_answer, slope, standing_over

from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.limits import energies_of
from rpf3d_core.live import cluster_sets
from rpf3d_core.unknowns.predictive import ranked

UNSURE = ", priors: {materials.default.tangential_restitution: {mean: 0.7, sd: 0.1, min: 0.4, max: 0.95}}"
"""Prior of a ground most of whose sets are similar; in few sets the rocks keep much more energy."""


def road_between(near: float, far: float) -> np.ndarray:
    return np.array([[near, 2.0], [far, 2.0], [far, 158.0], [near, 158.0]])


NEAR, HALF = road_between(44.0, 48.0), road_between(48.0, 52.0)
"""Two roads: the rocks of all sets reach the first, those of half of the sets the second."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("live")


@pytest.fixture(scope="module")
def standing(folder):
    return standing_with(folder, "0.3", UNSURE)


@pytest.fixture(scope="module")
def near(standing):
    return stages(standing, [ON_THE_SLOPE], road=NEAR)


def energies_of_each_set(standing, road) -> np.ndarray:
    """Return the p95 energy (S, 1) J on a road for each set, flown separately with other rocks; NaN if no rock came."""
    alone = [replace(standing, sets=None, flight=flight) for flight in standing.sets.flights]
    found = [stages(one, [ON_THE_SLOPE], road=road)[-1].evidence[0].pooled_energy for one in alone]
    return np.array([[np.nan if energy is None else energy] for energy in found])


def with_energy_limit(limit: float, **terms):
    return site({"road": {"restrict": {"p95_energy_j": limit}}}, fewest_rocks=WANTED, **terms)


def with_arrival_limit(seconds: float, **terms):
    limits = {"restrict": {"first_arrival_s": {"evacuation": seconds, "margin": 0.0}}}
    return site({"road": limits}, fewest_rocks=WANTED, **terms)


def test_the_upper_end_of_the_energy_raises_a_level_that_all_rocks_together_do_not_reach(near):
    (road,) = near[-1].evidence
    assert road.p95_energy < 0.95 * road.energy_high < road.energy_high <= road.largest_energy
    limit = 0.5 * (road.p95_energy + road.energy_high)
    safe, sampling = (decided_on(near[-1], with_energy_limit(limit, **terms))
                      for terms in ({}, {"interval": "sampling"}))  # fmt: skip
    assert (safe.level, sampling.level) == (Level.RESTRICT, Level.NORMAL)
    assert f"(up to {road.energy_high:.6g} J, predictive over {SETS} parameter sets), limit" in safe.reasons[0]
    assert f"p95 energy {road.p95_energy:.6g} J (of all parameter sets together)" in sampling.reasons[0]


@pytest.mark.parametrize("road", [NEAR, HALF], ids=["all_sets", "half_the_sets"])
def test_the_upper_end_is_that_of_the_p95_energies_of_the_sets_flown_one_by_one(standing, road):
    (found,) = stages(standing, [ON_THE_SLOPE], road=road)[-1].evidence
    expected = ranked(energies_of_each_set(standing, road)).high[0]
    assert found.energy_high == pytest.approx(expected, rel=0.03)
    assert found.p95_energy < 0.95 * expected, "all rocks together would not do"


def test_if_few_sets_reach_the_area_the_largest_energy_of_all_sets_counts_and_the_reason_says_so(standing):
    answer = stages(standing, [ON_THE_SLOPE], road=HALF)[-1]
    (road,) = answer.evidence
    assert 0 < road.energy_sets < 39 and road.p95_energy < road.energy_high <= road.largest_energy
    alert = decided_on(answer, with_energy_limit(0.5 * (road.p95_energy + road.energy_high)))
    assert alert.level == Level.RESTRICT
    assert f"the largest of all {SETS} parameter sets: only {road.energy_sets} have a p95" in alert.reasons[0]


def test_a_level_that_is_not_reached_also_says_which_end_was_compared(near):
    (road,) = near[-1].evidence
    alert = decided_on(near[-1], with_energy_limit(2.0 * road.energy_high))
    assert alert.level == Level.NORMAL and "predictive over 40 parameter sets" in alert.reasons[0].split("; ")[-1]
    late = decided_on(near[-1], with_arrival_limit(0.5 * road.first_arrival_low_s))
    assert late.level == Level.NORMAL and "the fastest of 40 parameter sets" in late.reasons[0]


def test_without_misfit_the_fastest_rock_of_all_sets_is_the_lower_end(near):
    (road,) = near[-1].evidence
    assert road.first_arrival_low_s == road.first_arrival_s


def test_a_misfit_brings_rocks_that_are_faster_and_stronger_than_those_that_flew(folder, standing, near):
    unsure = stages(standing_with(folder, "0.3", f"{UNSURE}, misfit: 4"), [ON_THE_SLOPE], road=NEAR)[-1]
    (moved,), (flown,) = unsure.evidence, near[-1].evidence
    assert (moved.p95_energy, moved.first_arrival_s) == (flown.p95_energy, flown.first_arrival_s)
    assert moved.first_arrival_low_s < flown.first_arrival_s - 0.2
    between = with_arrival_limit(0.5 * (moved.first_arrival_low_s + flown.first_arrival_s))
    assert (decided_on(unsure, between).level, decided_on(near[-1], between).level) == (Level.RESTRICT, Level.NORMAL)
    assert f"(after {moved.first_arrival_low_s:.1f} s in the fastest" in decided_on(unsure, between).reasons[0]
    assert moved.energy_high > flown.energy_high


def test_a_road_that_only_displaced_paths_reach_has_ends_and_no_faults(folder):
    beyond = road_between(62.0, 72.0)
    answer = stages(standing_with(folder, "0.3", f"{UNSURE}, misfit: 8"), [ON_THE_SLOPE], road=beyond)[-1]
    (road,) = answer.evidence
    assert road.reached == 0 and road.energy_high > 0.0 and road.first_arrival_low_s > 0.0
    alert = decided_on(answer, with_energy_limit(0.5 * road.energy_high))
    assert alert.faults == () and alert.level == Level.RESTRICT
    assert "no rock reached the area (up to" in alert.reasons[0]


def test_a_small_answer_is_compared_by_all_rocks_together_and_clears_nothing(near):
    (road,) = near[0].evidence
    assert road.energy_high is None and road.first_arrival_low_s is None and road.p95_energy is not None
    beyond = decided_on(near[0], with_energy_limit(0.5 * road.p95_energy))
    assert beyond.evident == Level.RESTRICT
    assert any("(of all parameter sets together)" in reason for reason in beyond.reasons)
    assert decided_on(near[0], with_energy_limit(2.0 * road.p95_energy)).level == Level.FAULT


def test_of_several_clusters_the_largest_end_counts_and_names_its_cluster(standing):
    high_up, low_down = (3.0, 20.0, 38.0), (25.0, 90.0, 16.0)
    (strong,), (weak,) = (stages(standing, [place], road=NEAR)[-1].evidence for place in (high_up, low_down))
    (both,) = stages(standing, [low_down, high_up], road=NEAR)[-1].evidence
    assert both.clusters == 2 and weak.energy_high < strong.p95_energy
    assert both.energy_high == pytest.approx(strong.energy_high, rel=0.03)
    assert (both.origins.energy_high or both.origins.energy).place == high_up
    assert both.first_arrival_low_s <= min(strong.first_arrival_s, weak.first_arrival_s) + 0.2


def test_ends_are_the_same_bits_again(standing, near):
    assert [one.evidence for one in stages(standing, [ON_THE_SLOPE], road=NEAR)] == [one.evidence for one in near]


def test_without_unknowns_an_answer_has_no_ends_and_its_energy_alone_is_compared():
    (road,) = last_answer(standing_over(slope()), [ON_THE_SLOPE]).evidence
    assert (road.energy_high, road.energy_sets, road.first_arrival_low_s) == (None, 0, None)
    assert energies_of(road, site().evidence) == (road.p95_energy,)
    assert energies_of(area(), site().evidence) == ()


@pytest.mark.parametrize("known", [38, 39, 40, 50])
def test_strong_sets_of_which_few_rocks_came_are_not_forgotten_once_enough_others_have_a_p95(known: int) -> None:
    """More evidence must not lower the energy that is compared from 900 kJ to 10 kJ."""
    has_p95 = np.arange(64)[:, None] < known
    energies = np.where(has_p95, 1e4, 9e5)
    assert cluster_sets._upper_energies(energies, has_p95) == pytest.approx([9e5])


def test_with_a_p95_of_every_set_the_end_is_that_of_the_tables_of_a_run() -> None:
    energies = np.random.default_rng(3).uniform(1e4, 9e4, (64, 3))
    found = cluster_sets._upper_energies(energies, np.ones((64, 3), dtype=bool))
    assert found.tolist() == ranked(energies)[1].tolist()
