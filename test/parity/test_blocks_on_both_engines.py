"""Rocks with a shape on both engines; `make engines-blocks` compares 1,000 blocks of Authume P1 in the same way."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blocks_on_both_engines import ENGINES, differences, flown

BENCH = Path(__file__).parents[2] / "config" / "scenes" / "bench_blocks.yaml"


@pytest.mark.long
def test_the_comparison_finds_no_difference_on_one_bench_and_each_bit_that_is_changed() -> None:
    one, other = (flown(BENCH, engine, 0, 3) for engine in ENGINES)
    assert len(one.impacts.t) > 3 and differences(one, other) == []
    moved = other.deposits.x.copy()
    moved[2, 1] = np.nextafter(moved[2, 1], np.inf)
    changed = replace(other, deposits=replace(other.deposits, x=moved))
    assert differences(one, changed) == ["deposits.x"]
    assert differences(one, replace(other, deposits=replace(other.deposits, pose=None))) == ["deposits.pose"]
    assert differences(one, replace(other, impacts=replace(other.impacts, t=other.impacts.t[1:]))) == ["impacts.t"]
