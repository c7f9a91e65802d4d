"""Tests that few rocks of a round represent all sources and points; sources with random places keep their rocks."""

import numpy as np
import pytest

from rpf3d_core.ensemble.even_rounds import is_spread, rocks_of_round, sources_left_out, words_on_left_out
from rpf3d_core.ensemble.releases import Source


def along_crest(points: int, rocks: int, name: str = "top") -> Source:
    """Return a source whose points lie in order along a crest, 1 m apart."""
    return Source(name=name, points=np.stack([np.zeros(points), np.arange(points), np.zeros(points)], 1), rocks=rocks)


@pytest.mark.parametrize("points", [400, 150, 129, 100, 50])
@pytest.mark.parametrize("number", [0, 1, 7])
def test_every_round_flies_the_whole_crest(points: int, number: int) -> None:
    (rocks,) = rocks_of_round([along_crest(points, 400)], 128, number)
    assert len(rocks) == 128
    parts = np.bincount(np.array(rocks) % points * 4 // points, minlength=4)  # the four quarters of the crest
    assert parts.max() - parts.min() <= 4


def test_rounds_fly_other_points_until_all_have_flown() -> None:
    flown = [set(np.array(rocks_of_round([along_crest(400, 400)], 128, number)[0]) % 400) for number in range(8)]
    assert len(set.union(*flown)) == 400


@pytest.mark.parametrize("points", [1, 3, 100, 400])
def test_no_rock_flies_twice(points: int) -> None:
    sources = [along_crest(points, 400), along_crest(7, 30)]
    for place in range(2):
        each = [np.array(rocks_of_round(sources, 128, number)[place]) for number in range(20)]
        together = np.concatenate(each)
        assert len(np.unique(together)) == len(together)


def test_more_sources_than_rocks_take_turns() -> None:
    sources = [along_crest(1, 1, f"s{number}") for number in range(400)]
    for number in range(5):
        flown = np.array([len(rocks) for rocks in rocks_of_round(sources, 128, number)])
        assert flown.sum() == 128
        assert np.ptp(flown.reshape(4, 100).sum(axis=1)) <= 1  # each hundred sources alike
    assert sources_left_out(sources, 128, 5) == []
    assert len(sources_left_out(sources, 128, 1)) == 272
    (sentence,) = words_on_left_out(sources, 128, 1, "calibration.rocks")
    assert "272 of 400 sources flew no rock" in sentence
    assert "more calibration.rocks" in sentence


def test_a_small_source_gets_its_share_over_the_rounds() -> None:
    sources = [along_crest(1, 1000, "large"), along_crest(1, 2, "small")]
    small = [len(rocks_of_round(sources, 128, number)[1]) for number in range(100)]
    assert sum(small) == pytest.approx(100 * 128 * 2 / 1002, abs=1.0)


def test_random_places_and_few_points_fly_their_next_rocks() -> None:
    line = Source(name="line", points=np.eye(3), rocks=200, line=True)
    sources = [line, along_crest(4, 100)]
    assert rocks_of_round(sources, 300, 2) == [range(400, 600), range(200, 300)]
    assert not is_spread(sources, 300)
    assert is_spread([along_crest(50, 100)], 300)
