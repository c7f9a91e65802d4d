"""Tests that counts at barriers equal those from stored paths, for any number of threads and parts."""

import csv
import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pyarrow.parquet as parquet
import pytest
from flights import scenes_of_facets as made
from flights.obstacles_made import RADIUS, fence, rough_ground
from hazards.hazard_tallied import numbers as layers
from scenes import small_pit

from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.runs.parallel import fly_parts
from rpf3d_core.runs.run import run_scene, simulate
from rpf3d_core.scene.reading import read_scene

FENCES = """
effects:
  barriers:
    panels:
      - name: ring
        along: [[-125, -125], [125, -125], [125, 125], [-125, 125], [-125, -125]]
        height: 3
        capacity_kj: 150
      - {name: line, along: [[-140, 0], [140, 0]], height: 2, capacity_kj: 0}
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return small_pit.scene_file(tmp_path_factory.mktemp("fences"), more=FENCES)


@pytest.fixture(scope="module")
def whole(scene):
    return simulate(scene, engine="compiled", threads=1)


def numbers(run):
    return [
        (figures[:11], figures.counted.first.tolist(), *(
            tuple(column.tolist() for column in sample.sorted())
            for sample in (figures.counted.energy, figures.counted.height, figures.counted.over)
        ))
        for figures in run.maps.barriers
    ]  # fmt: skip


@pytest.mark.long
def test_threads_engines_and_parts_leave_the_same_counts(scene, whole):
    assert sum(figures.came for figures in whole.maps.barriers) > 10
    for other in (simulate(scene, engine="compiled", threads=4), simulate(scene, engine="reference")):
        assert numbers(other) == numbers(whole)
    with ThreadPoolExecutor(2) as pool:
        assert numbers(fly_parts(scene, 3, pool, engine="compiled")) == numbers(whole)


def test_a_barrier_that_holds_nothing_changes_no_map_and_no_rock(scene, whole, tmp_path):
    weak = FENCES.replace("capacity_kj: 150", "capacity_kj: 0")
    named = simulate(small_pit.scene_file(tmp_path, more=weak), engine="compiled")
    free = simulate(small_pit.scene_file(tmp_path, name="free.yaml"), engine="compiled")
    assert made.same_bits(named.flights, free.flights)
    for (name, one), (_, other) in zip(layers(named.maps), layers(free.maps), strict=True):
        assert np.array_equal(one, other, equal_nan=True), name
    assert free.maps.barriers == () and named.maps.barriers[0].caught == 0


def test_impacts_on_the_ground_are_counted_without_those_on_nets(whole):
    ground = whole.flights.impacts.facet >= 0
    assert not ground.all(), "some rock met a net"
    assert whole.totals.impacts == ground.sum() == whole.maps.cells.impacts.sum() == whole.maps.facets.impacts.sum()
    assert whole.flights.deposits.impacts.sum() == ground.sum()


def test_a_result_tells_of_each_barrier_in_the_summary_a_table_and_the_impacts(scene, tmp_path):
    run = run_scene(scene, tmp_path / "run", engine="reference", recording=False)
    facts = json.loads((tmp_path / "run" / "summary.json").read_text())
    ring = facts["barriers"]["ring"]
    figures = run.maps.barriers[0]
    firsts = ("first_caught", "first_broken_through", "first_flown_over")
    assert ring["came"] == figures.came == sum(ring[did]["rocks"] for did in firsts)
    assert ring["caught"]["interval_95"] == list(wilson_interval(figures.caught, figures.came))
    assert facts["outcomes"]["caught"]["rocks"] == figures.caught > 0
    with (tmp_path / "run" / "hazard" / "barriers.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == ["ring", "line"]
    assert float(rows[0]["first_energy_j_max"]) == ring["first_energy_j"]["max"]
    assert int(rows[0]["broken_through_events"]) == ring["broken_through_events"] == figures.broken_through_events
    table = parquet.read_table(tmp_path / "run" / "impacts.parquet").to_pylist()
    struck = [row for row in table if row["struck"] != "ground"]
    assert {row["struck"] for row in struck} == {"barriers.ring"}
    assert all(row["facet"] is None and row["zone"] is None for row in struck)
    assert all(row["facet"] is not None for row in table if row["struck"] == "ground")
    assert len(struck) == figures.caught_events + figures.broken_through_events


def test_top_and_centre_differ_by_the_radius_of_the_rock():
    terrain = rough_ground()
    high, low = (fence(terrain, [(20.0, -8.0), (20.0, 8.0)], 3.0, 1e9, top=top) for top in (True, False))
    assert high.panel.top[0] - low.panel.top[0] == 1.0 and RADIUS == 0.5


def test_the_scene_of_these_tests_reads(scene):
    assert [panel.name for panel in read_scene(scene).effects.barriers.panels] == ["ring", "line"]
