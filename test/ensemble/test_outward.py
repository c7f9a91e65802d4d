"""Tests that a printed interval contains the computed one: ends are rounded outward, apart from rounding errors."""

import numpy as np
import pytest

from rpf3d_core.ensemble.outward import HIGH, LOW, NEAREST, fixed, interval_as, three_figures


def in_whole(end, side):
    return fixed(end, 0, side)


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [
        (0.0, 2.4, "0-3"),
        (97.9, 100.0, "97-100"),
        (1.9999999, 2.0000001, "2-2"),  # rounding errors
        (1.999, 2.001, "1-3"),
        (float(np.float32(0.1)) * 10, float(np.float32(0.7)) * 10, "1-7"),  # 32-bit numbers
        (-2.4, -1.6, "-3--1"),
        (-1e-15, 1e-15, "-0-0"),
    ],
)
def test_ends_are_rounded_outward_unless_a_rounding_error_parts_them_from_a_whole_number(low, high, text):
    assert interval_as((low, high), in_whole) == text


def test_values_between_the_ends_are_rounded_to_the_nearest_digit():
    assert [fixed(2.4, 0, side) for side in (LOW, NEAREST, HIGH)] == ["2", "2", "3"]
    assert [fixed(0.26, 1, side, sign=True) for side in (LOW, NEAREST, HIGH)] == ["+0.2", "+0.3", "+0.3"]


def test_three_figures_of_an_interval_are_rounded_outward():
    assert interval_as((1234.0, 9991.0), three_figures, between=" to ") == "1,230 to 10,000"
    assert interval_as((0.0, 0.029911), three_figures) == "0-0.03"
    assert interval_as((2460.0, 2460.0), three_figures) == "2,460-2,460"
    assert three_figures(float("inf"), HIGH) == "inf"


def test_an_unknown_end_has_its_own_text():
    assert interval_as((1.2, None), in_whole, "?") == "1-?"


def test_a_printed_interval_is_never_narrower_than_the_computed_one():
    random = np.random.default_rng(5)
    for low, width in zip(random.normal(0.0, 100.0, 500), random.exponential(10.0, 500), strict=True):
        for decimals in (0, 1, 3):
            printed = [float(fixed(end, decimals, side)) for end, side in ((low, LOW), (low + width, HIGH))]
            assert printed[0] <= low + 1e-6 * abs(low) and printed[1] >= low + width - 1e-6 * abs(low + width)
