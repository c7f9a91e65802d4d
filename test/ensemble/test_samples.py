"""Tests of distributions in bounded memory: exact for few values, else within 0.05 %, and the same in parts."""

import numpy as np
import pytest

from rpf3d_core.ensemble import samples
from rpf3d_core.ensemble.samples import EXACT, Sample, rounded

WANTED = (1, 5, 25, 50, 75, 95, 99)
ROUNDED = 5e-4
"""Largest relative error of values if there are more than EXACT: they are stored with 11 bits."""
ROUNDING = 1e-12
"""Largest relative error of the same linear interpolation in another order of operations."""


def values(count: int, seed: int = 5) -> np.ndarray:
    """Return `count` positive values over about four orders of magnitude, like energies."""
    return np.random.default_rng(seed).lognormal(3.0, 1.5, count)


def gathered(parts: list[np.ndarray]) -> Sample:
    sample = Sample()
    for part in parts:
        sample.add(part)
    return sample


def same(one: Sample, other: Sample) -> bool:
    pairs = zip(one.sorted(), other.sorted(), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs) and (one.count, one.low, one.high) == (
        other.count, other.low, other.high,
    )  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 19, 1000, EXACT])
def test_few_values_have_the_percentiles_of_numpy(count: int) -> None:
    some = values(count)
    sample = gathered(np.array_split(some, 7))
    np.testing.assert_allclose(sample.percentiles(WANTED), np.percentile(some, WANTED), rtol=ROUNDING)
    assert sample.mean() == pytest.approx(some.mean(), rel=ROUNDING)
    if count > 1:
        assert sample.sd() == pytest.approx(some.std(ddof=1), rel=1e-9)


def test_many_values_have_them_within_a_twentieth_of_a_per_cent_in_bounded_memory() -> None:
    some = values(10 * EXACT)
    sample = gathered(np.array_split(some, 31))
    np.testing.assert_allclose(sample.percentiles(WANTED), np.percentile(some, WANTED), rtol=ROUNDED)
    assert not np.allclose(sample.percentiles(WANTED), np.percentile(some, WANTED), rtol=1e-9), "they are rounded"
    assert sample.mean() == pytest.approx(some.mean(), rel=ROUNDED)
    assert len(sample.sorted()[0]) < EXACT / 3 and sample.sorted()[1].sum() == len(some)


def test_the_smallest_and_the_largest_are_never_rounded() -> None:
    some = values(2 * EXACT)
    sample = Sample(some)
    assert (sample.low, sample.high) == (some.min(), some.max())
    assert sample.summary((50,))["max"] == some.max() != rounded(some).max()


def test_rounding_keeps_the_promise_of_its_bits_and_is_done_once() -> None:
    some = np.concatenate([values(20_000), -values(20_000), np.linspace(1.0, 2.0, 10_000), [0.0]])
    once = rounded(some)
    away = np.abs(once - some)[some != 0.0] / np.abs(some[some != 0.0])
    assert away.max() <= 2.0**-samples.BITS and away.max() > 0.9 * 2.0**-samples.BITS, "the bound is reached"
    assert np.array_equal(rounded(once), once) and once[-1] == 0.0


@pytest.mark.parametrize("count", [60, 600])
@pytest.mark.parametrize("seed", range(3))
def test_parts_that_are_joined_are_the_same_bits_as_the_whole(
    monkeypatch: pytest.MonkeyPatch, count: int, seed: int
) -> None:
    monkeypatch.setattr(samples, "EXACT", 100)
    some = values(count, seed)
    cuts = np.sort(np.random.default_rng(seed).integers(0, count, 7))
    parts = [gathered([part]) for part in np.split(some, cuts)]
    joined = Sample()
    for part in parts[::-1]:
        joined.join(part)
    assert same(joined, Sample(some))
    assert same(gathered(list(some[::-1, None])), Sample(some)), "one after another, in another order"


def test_values_that_are_not_known_are_left_out() -> None:
    sample = Sample([1.0, np.nan, 3.0, np.inf])
    assert sample.count == 2 and sample.summary((50,)) == {"rocks": 2, "p50": 2.0, "max": 3.0}
    assert Sample([np.nan]).summary((50,)) == {"rocks": 0, "p50": None, "max": None}
