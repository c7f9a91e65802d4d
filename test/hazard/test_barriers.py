"""What rocks do at barriers is counted while they fly: as by force from stored paths, whatever threads and parts."""

import csv
import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pyarrow.parquet as parquet
import pytest
import scenes_of_facets as made
import small_pit
from hazard_tallied import numbers as layers
from obstacles_made import MASS, RADIUS, fence, rough_ground, thrown, with_effects

from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.barriers import HELD, NEVER, OVER, THROUGH, BarrierTally
from rpf3d_core.io.scene import read_scene
from rpf3d_core.run import run_scene, simulate
from rpf3d_core.study import fly_parts
from rpf3d_core.values import Mode, Outcome

G = 9.81
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


def crossings_by_force(flights, row, x):
    """Height and energy of every crossing of a level line at x, of flights and slides, from the paths: (N, 2)."""
    paths, found = flights.paths, []
    rows = np.flatnonzero(paths.row == row)
    for p in rows[:-1]:
        begin, end = paths.x[p], paths.x[p + 1]
        if (begin[0] - x) * (end[0] - x) > 0.0 or begin[0] == end[0]:
            continue
        if paths.mode[p] == Mode.FLIGHT:
            t = (x - begin[0]) / paths.v[p, 0]
            z, vz = begin[2] + paths.v[p, 2] * t - 0.5 * G * t * t, paths.v[p, 2] - G * t
            speed2 = paths.v[p, 0] ** 2 + paths.v[p, 1] ** 2 + vz**2
        else:
            share = (x - begin[0]) / (end[0] - begin[0])
            z = begin[2] + share * (end[2] - begin[2])
            speed2 = (1 - share) * (paths.v[p] ** 2).sum() + share * (paths.v_end[p] ** 2).sum()
        found.append((z, 0.5 * MASS * speed2))
    return found


@pytest.mark.parametrize("engine", made.ENGINES)
@pytest.mark.parametrize(("height", "capacity"), [(2.0, 30e3), (0.5, 0.0), (0.5, 1e9)])
def test_counts_energies_and_heights_are_those_of_the_paths(engine, height, capacity):
    terrain, x = made.incline(35, half_width=60.0), 20.0
    ground = -x * np.tan(np.radians(35))
    net = fence(terrain, [(x, -59.0), (x, 59.0)], height, capacity)
    tally = BarrierTally(net, ("net",), G, engine == "compiled")

    def watch(batch, releases):
        tally(batch, releases)
        return np.zeros(len(batch.rows))

    places, speeds = thrown(60 if engine == "compiled" else 20)
    physics = with_effects(made.flight(made.surface(0.5, 0.8, 25.0)), net)
    flights = made.fly(made.engine_over(engine, terrain), physics, places, speeds, watch=watch)
    did, energies, heights = [], [], []
    for row in range(len(places)):
        crossed = crossings_by_force(flights, row, x)
        if not crossed:
            did.append(NEVER)
            continue
        low = any(z - ground <= height for z, _ in crossed)
        held = flights.deposits.outcome[row] == Outcome.CAUGHT
        did.append(HELD if held else THROUGH if low else OVER)
        energies.append(max(energy for _, energy in crossed))
        heights.append(max(z for z, _ in crossed) - ground)
    counted = tally.counted[0]
    assert counted.rocks.tolist() == [did.count(what) for what in (NEVER, OVER, THROUGH, HELD)]
    assert len(set(did)) > 1 and counted.energy.count == len(energies)
    assert counted.energy.high == pytest.approx(max(energies), rel=1e-9)
    assert counted.height.high == pytest.approx(max(heights), rel=1e-9)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return small_pit.scene_file(tmp_path_factory.mktemp("fences"), more=FENCES)


@pytest.fixture(scope="module")
def whole(scene):
    return simulate(scene, engine="compiled", threads=1)


def numbers(run):
    return [
        (figures[:7], figures.counted.rocks.tolist(), *(
            tuple(column.tolist() for column in sample.sorted())
            for sample in (figures.counted.energy, figures.counted.height, figures.counted.over)
        ))
        for figures in run.maps.barriers
    ]  # fmt: skip


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
    assert ring["came"] == figures.came == sum(ring[did]["rocks"] for did in ("caught", "broken_through", "flown_over"))
    assert ring["caught"]["interval_95"] == list(wilson_interval(figures.caught, figures.came))
    assert facts["outcomes"]["caught"]["rocks"] == figures.caught > 0
    with (tmp_path / "run" / "hazard" / "barriers.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == ["ring", "line"]
    assert float(rows[0]["energy_j_max"]) == ring["energy_j"]["max"]
    table = parquet.read_table(tmp_path / "run" / "impacts.parquet").to_pylist()
    struck = [row for row in table if row["struck"] != "ground"]
    assert {row["struck"] for row in struck} == {"barriers.ring"}
    assert all(row["facet"] is None and row["zone"] is None for row in struck)
    assert all(row["facet"] is not None for row in table if row["struck"] == "ground")
    assert len(struck) >= figures.caught + figures.broken_through


def test_top_and_centre_differ_by_the_radius_of_the_rock():
    terrain = rough_ground()
    high, low = (fence(terrain, [(20.0, -8.0), (20.0, 8.0)], 3.0, 1e9, top=top) for top in (True, False))
    assert high.panel.top[0] - low.panel.top[0] == 1.0 and RADIUS == 0.5


def test_the_scene_of_these_tests_reads(scene):
    assert [panel.name for panel in read_scene(scene).effects.barriers.panels] == ["ring", "line"]
