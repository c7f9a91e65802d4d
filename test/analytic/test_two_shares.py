"""Tests of differences of two shares, against published values."""

import itertools
import math

import numpy as np
import pytest

from rpf3d_core.ensemble.two_shares import fisher_p, holm, newcombe_interval, p_value, pooled_z_p

PRINTED = 5e-5
"""Half a unit of the fourth decimal, the last that Newcombe prints."""


@pytest.mark.parametrize(
    ("counts", "low", "high"),
    [
        ((56, 70, 48, 80), 0.0524, 0.3339),
        ((9, 10, 3, 10), 0.1705, 0.8090),
        ((6, 7, 2, 7), 0.0582, 0.8062),
        ((5, 56, 0, 29), -0.0381, 0.1926),
        ((0, 10, 0, 20), -0.1611, 0.2775),
        ((0, 10, 0, 10), -0.2775, 0.2775),
        ((10, 10, 0, 20), 0.6791, 1.0000),
        ((10, 10, 0, 10), 0.6075, 1.0000),
    ],
    ids=lambda value: f"newcombe-1998-table-II-{value}" if isinstance(value, tuple) else "",
)
def test_the_interval_of_a_difference_is_newcombes_method_10(counts, low, high):
    assert newcombe_interval(*counts) == pytest.approx((low, high), abs=PRINTED)


def test_the_interval_turns_its_sign_with_the_order_of_the_shares():
    low, high = newcombe_interval(30, 100, 20, 80)
    assert newcombe_interval(20, 80, 30, 100) == pytest.approx((-high, -low))


def test_about_95_of_100_intervals_hold_the_true_difference():
    # Newcombe reports a mean coverage of 0.952 for method 10; 20,000 trials know it to 0.3 points.
    random = np.random.default_rng(7)
    a, b = random.binomial(60, 0.3, 20_000), random.binomial(90, 0.12, 20_000)
    inside = [low <= 0.18 <= high for low, high in (newcombe_interval(x, 60, y, 90) for x, y in zip(a, b, strict=True))]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize(
    ("counts", "p"),
    [
        ((3, 4, 1, 4), 34 / 70),  # Fisher 1935, the lady tasting tea, two-sided
        ((2, 17, 10, 13), 0.0005367),  # Fisher's criminal twins, as printed by R's fisher.test
        ((1, 21, 4, 21), 0.3433),  # the thesis' fourth bench (reference, validation 6: p is about 0.3)
        ((12, 21, 8, 21), 0.3543),  # the thesis' ramp
        ((0, 5, 0, 9), 1.0),
    ],
)
def test_fishers_exact_test_gives_published_values(counts, p):
    assert fisher_p(*counts) == pytest.approx(p, rel=2e-4)


def test_fishers_chances_add_up_to_one_over_all_tables():
    # The most likely table has p = 1, because no other table is more likely.
    assert fisher_p(10, 20, 10, 20) == pytest.approx(1.0)


def test_the_z_test_is_pearsons_chi_square():
    # Physicians' Health Study: chi-square 25.0 with one degree of freedom (Agresti, Categorical Data Analysis, 3.2).
    a, n_a, b, n_b = 189, 11034, 104, 11037
    rocks, hits = n_a + n_b, a + b
    square = rocks * (a * (n_b - b) - b * (n_a - a)) ** 2 / (n_a * n_b * hits * (rocks - hits))
    assert square == pytest.approx(25.01, abs=0.01)
    assert pooled_z_p(a, n_a, b, n_b) == pytest.approx(math.erfc(math.sqrt(square / 2.0)))


def test_shares_of_nothing_or_of_all_differ_by_no_test():
    assert pooled_z_p(0, 10, 0, 30) == pooled_z_p(10, 10, 30, 30) == p_value(0, 10, 0, 30) == 1.0


def test_small_counts_are_tested_exactly_and_large_ones_by_z():
    assert p_value(1, 21, 4, 21) == fisher_p(1, 21, 4, 21) != pooled_z_p(1, 21, 4, 21)
    assert p_value(300, 1000, 350, 1000) == pooled_z_p(300, 1000, 350, 1000)
    assert p_value(99_999, 100_000, 99_995, 100_000) == fisher_p(99_999, 100_000, 99_995, 100_000)


def test_the_two_tests_agree_where_counts_are_large():
    counts = (50_000, 100_000, 50_400, 100_000)
    assert fisher_p(*counts) == pytest.approx(pooled_z_p(*counts), rel=0.02)


def test_holms_correction_gives_the_values_of_rs_p_adjust():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, 0.7]) == [1.0, 1.0] and holm([]) == []


def test_holms_correction_never_helps_and_keeps_the_order():
    p = [0.2, 0.001, 0.03, 0.03, 0.9]
    corrected = holm(p)
    assert all(after >= before for before, after in zip(p, corrected, strict=True))
    ranked = [corrected[i] for i in sorted(range(5), key=p.__getitem__)]
    assert all(low <= high for low, high in itertools.pairwise(ranked))
