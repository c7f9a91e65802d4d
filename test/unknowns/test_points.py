"""Tests that points of parameter sets are evenly spread, and rocks are evenly distributed among the sets."""

import numpy as np
import pytest

from rpf3d_core.unknowns.dealing import rocks_of_set, set_of_rock
from rpf3d_core.unknowns.points import spread_points


def star_discrepancy(points: np.ndarray) -> float:
    """Return the largest error of the share of points (P, D) in boxes from the origin to a point."""
    boxes = np.concatenate([points, np.ones((1, points.shape[1]))])
    inside = (points[None] <= boxes[:, None]).all(axis=2).mean(axis=1)
    return float(np.abs(inside - boxes.prod(axis=1)).max())


@pytest.mark.parametrize("dimensions", [1, 2, 5])
def test_points_are_more_even_than_random_ones(dimensions: int) -> None:
    random = np.random.default_rng(1)
    ours = np.mean([star_discrepancy(spread_points(64, dimensions, seed)) for seed in range(20)])
    theirs = np.mean([star_discrepancy(random.random((64, dimensions))) for _ in range(20)])
    assert ours < 0.75 * theirs


def test_each_dimension_is_uniform_over_the_seeds() -> None:
    """For each point of the sequence, mean and variance over the seeds are those of a uniform number: 1/2 and 1/12."""
    points = np.array([spread_points(16, 3, seed) for seed in range(2000)])
    assert points.mean(axis=0) == pytest.approx(np.full((16, 3), 0.5), abs=0.025)
    assert points.var(axis=0) == pytest.approx(np.full((16, 3), 1 / 12), abs=0.008)


def test_a_base_of_two_has_one_point_in_each_of_64_parts() -> None:
    assert sorted(np.floor(64 * spread_points(64, 1, 9)[:, 0]).tolist()) == list(range(64))


def test_a_longer_sequence_begins_alike_and_seeds_differ() -> None:
    assert np.array_equal(spread_points(200, 4, 3)[:50], spread_points(50, 4, 3))
    assert not np.array_equal(spread_points(50, 4, 3), spread_points(50, 4, 4))
    assert spread_points(500, 40, 3).min() >= 0.0 and spread_points(500, 40, 3).max() < 1.0


@pytest.mark.parametrize(("first", "last"), [(0, 1000), (37, 901), (0, 64), (5, 9)])
def test_each_rock_flies_with_one_set(first: int, last: int) -> None:
    dealt = [rocks_of_set(number, 64, first, last, source=2) for number in range(64)]
    assert sorted(np.concatenate(dealt).tolist()) == list(range(first, last))
    assert all(set_of_rock(rock, 64, 2) == number for number, rocks in enumerate(dealt) for rock in rocks.tolist())
    assert max(map(len, dealt)) - min(map(len, dealt)) <= 2


@pytest.mark.parametrize("points", [2, 41, 64, 100])
def test_each_set_has_rocks_of_all_places_of_a_source(points: int) -> None:
    """The rocks of a source use its points in turn, and each set's 1,000 rocks are evenly spread over the points."""
    for number in (0, 13, 63):
        places = rocks_of_set(number, 64, 0, 64_000, source=0) % points
        counts = np.bincount(places, minlength=points)
        assert len(places) == 1000
        assert abs(counts - 1000 / points).max() <= 0.25 * 1000 / points + 3
