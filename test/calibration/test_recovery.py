"""Tests that calibrations find known values: a small campaign. `make recovery` runs 100 calibrations."""

import pytest
from campaigns.recovery import MIDDLE, recovered

from rpf3d_core.jit.dispatch import HAS_NUMBA

pytestmark = pytest.mark.skipif(not HAS_NUMBA, reason="hundreds of parameter sets need the compiled engine")

SMALL = 8
LEAST = 5
"""Least number of 8 true values within 90 % intervals; a correct sampler has fewer with a probability of 0.5 %."""


def test_a_known_value_is_found_with_enough_effective_samples() -> None:
    inside, effective, _ = recovered(3, MIDDLE)
    assert all(inside.values())
    assert effective > 50


@pytest.mark.long
def test_intervals_hold_known_values_as_often_as_they_say() -> None:
    results = [recovered(seed) for seed in range(1, SMALL + 1)]
    for name in results[0][0]:
        assert sum(inside[name] for inside, _, _ in results) >= LEAST
    assert min(effective for _, effective, _ in results) > 50
