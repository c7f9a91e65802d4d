"""Tests that both engines agree for bodies; `make engines-blocks` compares 1,000 blocks of Authume P1 likewise."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from campaigns.blocks_on_both_engines import ENGINES, differences, flown

BENCH = Path(__file__).parents[2] / "config" / "scenes" / "bench_blocks.yaml"


def test_the_comparison_finds_each_bit_that_is_changed() -> None:
    found = flown(BENCH, "compiled", 0, 3)
    assert len(found.impacts.t) > 3 and differences(found, found) == []
    moved = found.deposits.x.copy()
    moved[2, 1] = np.nextafter(moved[2, 1], np.inf)
    assert differences(found, replace(found, deposits=replace(found.deposits, x=moved))) == ["deposits.x"]
    assert differences(found, replace(found, deposits=replace(found.deposits, pose=None))) == ["deposits.pose"]
    assert differences(found, replace(found, impacts=replace(found.impacts, t=found.impacts.t[1:]))) == ["impacts.t"]


@pytest.mark.long
def test_no_bit_of_some_blocks_down_one_bench_differs() -> None:
    one, other = (flown(BENCH, engine, 0, 3) for engine in ENGINES)
    assert differences(one, other) == []
