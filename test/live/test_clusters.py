"""Tests that the worst cluster of sources determines the level, however many harmless sources a message has."""

import math

import numpy as np
import pytest
from live_sites.watched_road import (
    ON_THE_SLOPE,
    WANTED,
    behind_a_bank,
    decided_on,
    last_answer,
    road_site,
    slope,
    standing_over,
)

from rpf3d_core.alerts.levels import Level
from rpf3d_core.live.clusters import clusters_of, first_of_clusters, least_in_total

HARMLESS = [(10.0, 90.0 + 1.5 * i, 31.0) for i in range(40)]
"""Places (m) of sources whose rocks a bank stops before the road."""


@pytest.fixture(scope="module")
def standing():
    return standing_over(behind_a_bank(slope()))


def test_harmless_sources_alone_are_normal(standing):
    assert decided_on(last_answer(standing, HARMLESS)).level == Level.NORMAL


@pytest.mark.parametrize("at", [0, 20, 40])
def test_one_dangerous_source_among_forty_harmless_ones_has_the_level_that_it_has_alone(standing, at):
    alone = decided_on(last_answer(standing, [ON_THE_SLOPE]))
    among = last_answer(standing, [*HARMLESS[:at], ON_THE_SLOPE, *HARMLESS[at:]])
    alert = decided_on(among)
    assert alert.level == alone.level == Level.RESTRICT
    (area,) = among.evidence
    assert area.pooled_reached < 0.1 * area.pooled_flown, "the pool alone would be watch at most"
    assert f"{area.pooled_reached:,} of {area.pooled_flown:,} of all rocks" in alert.reasons[0]
    assert area.pooled_flown == among.rocks


def test_the_dangerous_source_among_forty_harmless_ones_is_the_one_that_is_named(standing):
    answer = last_answer(standing, [*HARMLESS[:20], ON_THE_SLOPE, *HARMLESS[20:]])
    (area,) = decided_on(answer).areas
    assert area.origin.place == pytest.approx(ON_THE_SLOPE) and area.origin.sources == 1
    assert area.origin.terrain_digest == standing.ground.digest
    assert area.origin.sources_digest == answer.trigger.digest


def test_every_cluster_flies_as_many_rocks_as_the_site_wants(standing):
    answer = last_answer(standing, [ON_THE_SLOPE, *HARMLESS])
    (area,) = answer.evidence
    assert area.flown >= WANTED and answer.rocks >= WANTED * area.clusters
    assert decided_on(answer, road_site()).faults == ()


def test_rocks_of_one_cluster_that_are_cut_off_are_a_share_of_that_cluster(standing):
    answer = last_answer(standing, [ON_THE_SLOPE, *HARMLESS])
    (area,) = answer.evidence
    assert answer.unfinished <= area.flown
    assert decided_on(answer).faults == ()


def test_one_cluster_has_the_evidence_of_its_maps(standing):
    pooled, alone = (last_answer(standing, HARMLESS[:3], cluster=side) for side in (math.inf, 1000.0))
    assert pooled.evidence == alone.evidence
    assert pooled.evidence[0].clusters == 0


def test_sources_of_one_square_are_a_cluster_and_unsound_ones_are_in_none():
    places = np.array([[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [4.0, 4.0, 0.0], [6.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    sound = np.array([True, True, True, False, True])
    found = lambda side: [sorted(some.tolist()) for some in clusters_of(places, sound, side)]  # noqa: E731
    assert sorted(found(5.0)) == [[0, 2], [1], [4]]
    assert sorted(found(0.0)) == [[0], [1], [2], [4]]
    assert found(math.inf) == [[0, 1, 2, 4]]


def test_all_clusters_release_about_as_many_rocks_and_none_fewer_than_wanted():
    clusters = [np.array([0]), np.array([1, 2, 3]), np.array([5])]
    first = first_of_clusters(clusters, 6, 100)
    assert first == [34, 12, 12, 12, 0, 34]
    total = least_in_total(first, clusters, 1000)
    shares = [sum(first[i] for i in cluster.tolist()) * total / sum(first) for cluster in clusters]
    assert min(shares) >= 1000
