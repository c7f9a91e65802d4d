"""Tests that predictive intervals contain one more site as often as stated, for any distribution of the sets."""

from collections.abc import Callable

import numpy as np
import pytest

from rpf3d_core.unknowns.predictive import ENOUGH, predictive_shares, ranked, ranked_if_enough, shares_of_site

SETS, SITES = 64, 3000
Draw = Callable[[np.random.Generator, tuple[int, ...]], np.ndarray]
SHARES: dict[str, Draw] = {
    "at the ends": lambda rng, n: rng.beta(0.3, 0.3, n),
    "any": lambda rng, n: rng.random(n),
    "around a half": lambda rng, n: rng.beta(2, 2, n),
    "high": lambda rng, n: rng.beta(20, 3, n),
    "nearly the same": lambda rng, n: rng.beta(200, 30, n),
    "the same": lambda rng, n: np.full(n, 0.5),
    "one of two": lambda rng, n: np.where(rng.random(n) < 0.5, 0.3, 0.9),
    "seldom": lambda rng, n: np.where(rng.random(n) < 0.1, 0.8, 0.0),
    "small": lambda rng, n: np.minimum(np.exp(rng.normal(-5, 1, n)), 1.0),
}


@pytest.mark.parametrize("rocks", [2, 15, 50, 500])
@pytest.mark.parametrize("name", SHARES)
def test_the_interval_holds_the_share_of_one_more_site(name: str, rocks: int) -> None:
    """Each site has its own 64 sets; about 95 % of the intervals contain the site's share, more if rocks are few."""
    rng = np.random.default_rng(7)
    sets, site = SHARES[name](rng, (SETS, SITES)), SHARES[name](rng, (SITES,))
    counts = rng.binomial(rocks, sets).astype(float)
    low, high = predictive_shares(counts, np.full((SETS, SITES), float(rocks)))
    assert np.mean((low <= site) & (site <= high)) > 0.93


def shares_of(hits: list[float], rocks: float = 100.0) -> tuple[float, float]:
    """Return the predictive interval (-) of 64 sets; the first sets have these hits, all others none."""
    counts = np.zeros((SETS, 1))
    counts[: len(hits), 0] = hits
    low, high = shares_of_site(counts, np.full((SETS, 1), rocks))
    return float(low[0]), float(high[0])


def test_no_hit_is_bounded_by_markov_and_not_by_the_number_of_all_rocks() -> None:
    """The upper end for 0 of 6,400 rocks is 0.06 %, and by Markov's inequality 0.06 % / 0.025 = 2.4 %."""
    assert shares_of([]) == (0.0, pytest.approx(0.0240, abs=1e-4))
    many = np.full((SETS, 1), 100.0)
    assert [float(end[0]) for end in shares_of_site(many, many)] == [pytest.approx(0.9760, abs=1e-4), 1.0]


@pytest.mark.parametrize("hits", [[1], [2], [1, 1], [1] * 3, [1] * 5, [5], [1] * 20])
def test_no_hit_is_not_less_than_what_the_first_hits_leave_open(hits: list[float]) -> None:
    assert shares_of([])[1] <= shares_of(hits)[1]


def test_sets_with_few_rocks_leave_much_open() -> None:
    """The many rocks of 4 sets with 1,000 rocks each give no information on 60 sets with one rock each."""
    totals = np.where(np.arange(SETS) < 60, 1.0, 1000.0)[:, None]
    assert shares_of_site(np.zeros((SETS, 1)), totals).high[0] > 0.7


@pytest.mark.parametrize("share", [0.005, 0.01, 0.02, 0.03, 0.3])
@pytest.mark.parametrize("often", [0.02, 0.04, 0.06, 0.1])
def test_a_share_that_few_sites_have_is_held(share: float, often: float) -> None:
    rng = np.random.default_rng(11)
    sets, site = (np.where(rng.random(n) < often, share, 0.0) for n in ((SETS, SITES), (SITES,)))
    low, high = shares_of_site(rng.binomial(100, sets).astype(float), np.full((SETS, SITES), 100.0))
    assert np.mean((low <= site) & (site <= high)) > 0.965


@pytest.mark.parametrize("name", ["any", "around a half", "high"])
def test_many_rocks_leave_the_width_of_the_ground_alone(name: str) -> None:
    rng = np.random.default_rng(3)
    counts = rng.binomial(2000, SHARES[name](rng, (SETS, SITES))).astype(float)
    low, high = predictive_shares(counts, np.full((SETS, SITES), 2000.0))
    ends = np.quantile(SHARES[name](rng, (400_000,)), [0.025, 0.975])
    assert np.mean(high - low) == pytest.approx(ends[1] - ends[0], rel=0.15)


def test_sets_that_agree_leave_no_less_than_the_sampling_interval() -> None:
    counts = np.full((SETS, 1), 15.0)
    low, high = predictive_shares(counts, np.full((SETS, 1), 15.0))
    assert 0.99 < low[0] < 1.0 == high[0]


def test_sets_that_are_sure_and_disagree_leave_everything_open() -> None:
    counts = np.where(np.arange(SETS) % 2, 15.0, 0.0)[:, None]
    low, high = predictive_shares(counts, np.full((SETS, 1), 15.0))
    assert (low[0], high[0]) == (0.0, 1.0)


@pytest.mark.parametrize("sets", [0, 1, 2, 20, ENOUGH - 1])
def test_a_share_of_fewer_sets_than_95_per_cent_need_is_not_known(sets: int) -> None:
    totals = np.where(np.arange(SETS) < sets, 1000.0, 0.0)[:, None]
    assert np.isnan(predictive_shares(0.3 * totals, totals)).all()


def test_39_sets_hold_the_share_of_one_more_site_with_95_per_cent() -> None:
    rng = np.random.default_rng(11)
    sets, site = rng.beta(0.3, 0.3, (ENOUGH, 40_000)), rng.beta(0.3, 0.3, 40_000)
    rocks = np.full(sets.shape, 2000.0)
    low, high = predictive_shares(rng.binomial(2000, sets).astype(float), rocks)
    assert np.mean((low <= site) & (site <= high)) > 0.945


def test_sets_without_rocks_do_not_count_and_one_set_predicts_nothing() -> None:
    totals = np.where(np.arange(SETS) < 40, 1000.0, 0.0)[:, None]
    some = predictive_shares(0.3 * totals, totals)
    few = predictive_shares(0.3 * totals[:40], totals[:40])
    assert some.low == few.low and some.high == few.high
    alone = predictive_shares(np.array([[3.0]]), np.array([[10.0]]))
    assert np.isnan(alone.low[0]) and np.isnan(alone.high[0])


def test_ranks_hold_one_more_draw_with_their_probability() -> None:
    """The smallest and the largest of 39 draws enclose the next draw with probability 38/40 = 95 %."""
    rng = np.random.default_rng(5)
    low, high = ranked(np.exp(2 * rng.normal(size=(39, 40_000))))
    one_more = np.exp(2 * rng.normal(size=40_000))
    assert np.mean((low <= one_more) & (one_more <= high)) == pytest.approx(0.95, abs=0.004)


def test_percentiles_of_too_few_sets_have_no_interval() -> None:
    values = np.arange(40.0)[:, None] * [1.0, 1.0]
    values[38:, 1] = np.nan
    low, high = ranked_if_enough(values)
    assert (low[0], high[0]) == pytest.approx((0.025, 38.975)) and np.isnan([low[1], high[1]]).all()


def test_missing_values_do_not_count() -> None:
    values = np.array([[3.0], [np.nan], [1.0], [2.0]])
    assert [end.tolist() for end in ranked(values)] == [[1.0], [3.0]]
    assert np.isnan(ranked(np.full((4, 1), np.nan)).low[0])


def interval_of(counts: np.ndarray, totals: np.ndarray) -> np.ndarray:
    """Return the lower and the upper end (2,) of a share; counts, totals : (S,) rocks of each set."""
    return np.array(shares_of_site(counts[:, None].astype(float), totals[:, None].astype(float)))[:, 0]


@pytest.mark.parametrize("sets", [ENOUGH, SETS, 100, 256])
@pytest.mark.parametrize("rocks", [10, 40, 1000])
def test_one_hit_in_more_sets_never_lowers_an_end(sets: int, rocks: int) -> None:
    ends = np.array([interval_of(np.arange(sets) < hit, np.full(sets, rocks)) for hit in range(sets + 1)])
    assert (np.diff(ends, axis=0) >= -1e-12).all()
    misses = np.array([interval_of(rocks - (np.arange(sets) < miss), np.full(sets, rocks)) for miss in range(sets + 1)])
    assert (np.diff(misses, axis=0) <= 1e-12).all()


@pytest.mark.parametrize("seed", range(300))
def test_more_hits_never_lower_the_upper_end_while_at_most_half_of_the_sets_have_a_hit(seed: int) -> None:
    """Sets with random numbers of rocks and hits get further hits; the lower end of the misses is the mirror image."""
    rng = np.random.default_rng(seed)
    sets = int(rng.integers(ENOUGH, 200))
    totals = rng.integers(1, 100, sets) if seed % 2 else np.full(sets, rng.integers(1, 100))
    hit = rng.permutation(sets) < rng.integers(1, sets // 2 + 1)
    more = np.where(hit, rng.binomial(totals, rng.beta(0.3, 1.0)), 0)
    fewer = rng.binomial(more, rng.beta(1.0, 0.5))
    assert interval_of(more, totals)[1] >= interval_of(fewer, totals)[1] - 1e-12
    assert interval_of(totals - more, totals)[0] <= interval_of(totals - fewer, totals)[0] + 1e-12
