"""Tests that the demo shows what rpf3d is for: some rocks pass the first bench or reach the ramp, no map is blank."""

from functools import cache

import numpy as np
from programs.command_line import ROOT

import rpf3d_core as rpf3d
from rpf3d_core.hazard.maps import FEWEST_ROCKS, reach_probability
from rpf3d_core.results.hazard_files.sentences import words_on_maps
from rpf3d_core.results.plots.hazard_themes import themes
from rpf3d_core.results.summary import summary


@cache
def demo():
    """Return the run of `make demo`, without its files."""
    return rpf3d.simulate(ROOT / "config/scenes/demo.yaml")


def test_a_part_of_the_rocks_passes_the_first_bench_and_reaches_the_ramp():
    reached = {zone: figures["reached"] for zone, figures in summary(demo())["benches"].items()}
    assert 0.2 <= reached["bench_2"]["share"] <= 0.8
    assert 0.05 <= reached["ramp"]["share"] <= 0.3
    low, high = reached["ramp"]["interval_95"]
    assert low < 0.8 * reached["ramp"]["share"] < 1.2 * reached["ramp"]["share"] < high, "200 rocks are few"


def test_no_picture_of_the_demo_is_blank():
    for name, theme in themes(demo().maps).items():
        assert np.isfinite(theme.values).sum() >= 5, name
    assert (demo().maps.cells.rocks >= FEWEST_ROCKS).sum() >= 5, "cells with a 95th percentile"


def test_the_cell_stands_beside_every_reach_probability():
    maps = demo().maps
    words = f"{maps.raster.cell:g} m"
    most = reach_probability(maps.cells, maps.flown).max()
    assert f"cells of {words}" in words_on_maps(maps) and "grows with the cell" in words_on_maps(maps)
    assert words in themes(maps)["reach_probability"].unit
    told = summary(demo())["hazard"]["reach_probability"]
    assert told["max"] == most and told["cell_m"] == maps.raster.cell and f"cells of {words}" in told["of"]
