"""Tests that samples of many groups have the values of a sample of each group, in bounded memory."""

import numpy as np
import pytest

from rpf3d_core.ensemble import grouped_samples
from rpf3d_core.ensemble.grouped_samples import FULL, GroupedSample
from rpf3d_core.ensemble.samples import BITS, Sample


def drawn(rocks: int, groups: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the group and value of each of `rocks` rocks; the last group has no rock, and some values occur twice."""
    rng = np.random.default_rng(7)
    values = rng.lognormal(10.0, 1.5, rocks)
    values[: rocks // 4] = values[rocks // 4 : 2 * (rocks // 4)]
    return rng.integers(0, groups - 1, rocks), values


def gathered(group: np.ndarray, values: np.ndarray, groups: int) -> GroupedSample:
    found = GroupedSample(groups)
    for some in np.array_split(np.arange(len(values)), 7):
        found.add(group[some], values[some])
    return found


def content(found: GroupedSample) -> list[list[float]]:
    found._settle()
    return [each.tolist() for each in (found._group, found._values, found._counts, found.low, found.high)]


def test_each_group_has_the_figures_of_a_sample_of_its_values() -> None:
    group, values = drawn(3000, 9)
    found = gathered(group, values, 9)
    p95 = found.percentiles(95, 1)
    for number in range(8):
        alone = Sample(values[group == number])
        same = found.of(number, number + 1)
        assert same.summary((5, 50, 95)) == alone.summary((5, 50, 95))
        assert same.interval(95) == alone.interval(95) and same.low == alone.low
        assert p95[number] == alone.percentiles((95,))[0]
    assert np.isnan(p95[8]) and found.of(8, 9).count == 0
    assert np.isnan(found.percentiles(95, 3001)).all()
    assert found.of(2, 5).summary((95,)) == Sample(values[(group >= 2) & (group < 5)]).summary((95,))


@pytest.mark.parametrize("exact", [100, 100_000], ids=["rounded", "exact"])
def test_parts_in_any_order_have_the_same_bits(exact: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grouped_samples, "EXACT", exact)
    group, values = drawn(2000, 300)
    whole = gathered(group, values, 300)
    halves = [gathered(group[some], values[some], 300) for some in np.array_split(np.arange(2000), 2)]
    halves[1].join(halves[0])
    assert content(halves[1]) == content(whole)


def test_memory_is_bounded_and_values_are_close(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each doubling of the number of groups above 64 halves the number of values from a value to its double."""
    assert [GroupedSample(groups).bits for groups in (1, FULL, 2 * FULL, 4 * FULL)] == [BITS, BITS, BITS - 1, BITS - 2]
    monkeypatch.setattr(grouped_samples, "EXACT", 1000)
    group, values = drawn(200_000, 4 * FULL)
    found = gathered(group, values, 4 * FULL)
    octaves = np.log2(values.max() / values.min()) + 2
    assert len(content(found)[0]) <= 4 * FULL * octaves * 2 ** (BITS - 3)
    assert found.count.sum() == 200_000
    for number in (0, 100):
        mine = values[group == number]
        assert found.of(number, number + 1).percentiles((95,))[0] == pytest.approx(np.percentile(mine, 95), rel=2e-3)
        assert found.of(number, number + 1).summary((95,))["max"] == mine.max()


def test_values_that_are_not_finite_are_ignored() -> None:
    found = GroupedSample(2)
    found.add(np.array([0, 0, 1]), np.array([np.nan, 2.0, np.inf]))
    assert found.count.tolist() == [1, 0]
