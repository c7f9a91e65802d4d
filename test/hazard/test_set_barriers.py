"""Tests of barrier figures over parameter sets: counts per set, predictive intervals, or "not known"."""

import csv
import json

import numpy as np
import pytest
from scenes.sweeps import UNKNOWN, road, written

from rpf3d_core.hazard.barrier_arrivals import HELD, NEVER
from rpf3d_core.hazard.barriers import AtBarrier
from rpf3d_core.hazard.by_set.set_barriers import BarrierSets
from rpf3d_core.results.hazard_files.barriers_text import text_header, text_rows
from rpf3d_core.results.overconfidence import surer_than_it_may_be
from rpf3d_core.results.summary import summary
from rpf3d_core.runs.run import run_scene, simulate
from rpf3d_core.unknowns.predictive import ENOUGH

FENCES = """\
effects:
  barriers:
    panels:
      - {name: near, along: [[14, -40], [14, 40]], height: 1, capacity_kj: 20}
      - {name: far, along: [[20, -40], [20, 40]], height: 9, capacity_kj: 0}
      - {name: idle, along: [[42, -40], [42, 40]], height: 9, capacity_kj: 0}
"""
SCENE = UNKNOWN.replace("rocks: 60", "rocks: 640") + FENCES


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("fences")
    (made / "road.geojson").write_text(road(20.0, 24.0))
    return made


@pytest.fixture(scope="module")
def run(folder):
    return run_scene(written(folder, SCENE), folder / "out", recording=False)


@pytest.fixture(scope="module")
def facts(run, folder):
    return json.loads((folder / "out" / "summary.json").read_text())["barriers"]


class Tallied:
    """Stands in for a barrier tally; has only what the counts per set use."""

    names = ("fence",)
    part: tuple[AtBarrier, ...] = ()
    sources = None


def bands_of(sets: int, rocks: int):
    """Return the bands of the fence over sets with `rocks` rocks each.

    The rocks of set n have n kJ; the fence catches all of them if n is odd, else none.
    """
    tally, each = Tallied(), np.full(sets, float(rocks))
    counts = BarrierSets(tally, sets)
    for number in range(sets):
        counts.begin(number)
        tally.part[0].first += np.bincount([HELD] * rocks, minlength=4)
        tally.part[0].held += rocks * (number % 2)
        tally.part[0].energy.add(np.full(rocks, 1e3 * number))
        tally.part[0].height.add(np.full(rocks, 2.0))
    return counts.bands(each)[0]


def test_intervals_are_over_the_sets_and_need_39_of_them_with_20_rocks_for_a_p95():
    enough = bands_of(ENOUGH, 20)
    assert enough["caught"] == (0.0, 1.0) and enough["came"][1] == enough["first_caught"][1] == 1.0
    assert enough["energy"] == pytest.approx((0.0, 1e3 * (ENOUGH - 1)), abs=1e-6) and enough["height"] == (2.0, 2.0)
    assert np.isnan(bands_of(ENOUGH, 19)["energy"]).all() and not np.isnan(bands_of(ENOUGH, 19)["caught"]).any()
    assert np.isnan(bands_of(ENOUGH - 1, 20)["caught"]).all()


def test_counting_by_set_changes_no_count_of_the_run(folder, run):
    per_set = [simulate(written(folder, SCENE), threads=threads).maps for threads in (1, 2)]
    assert [figures[:11] for figures in per_set[0].barriers] == [figures[:11] for figures in run.maps.barriers]
    assert str(per_set[0].sets.barriers) == str(per_set[1].sets.barriers) == str(run.maps.sets.barriers)
    for figures in run.maps.barriers:
        assert figures.counted.first[NEVER] == run.totals.rocks - figures.came


def test_predictive_intervals_hold_the_sampling_intervals_where_they_are_known(run, facts):
    near = facts["near"]
    for name in ("reached", "first_caught", "first_broken_through", "first_flown_over", "caught"):
        (low, high), (first, last) = near[name]["predictive"], near[name]["sampling"]
        assert low <= first <= last <= high
    assert near["reached"]["rocks"] == near["came"]
    assert near["reached"]["predictive"] == [0.0, 1.0], "the ground decides if rocks come"


def test_a_barrier_that_few_sets_reach_has_no_predictive_interval(facts, folder):
    far = facts["far"]
    assert far["came"] > 20 and far["caught"]["predictive"] is None
    assert far["first_energy_j"]["p95_predictive"] == [None, None]
    with (folder / "out" / "hazard" / "barriers.csv").open(newline="") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert rows["far"]["caught_predictive_low"] == rows["far"]["first_energy_j_p95_predictive_high"] == ""
    assert float(rows["near"]["caught_predictive_high"]) == facts["near"]["caught"]["predictive"][1]
    assert float(rows["near"]["caught_high"]) == facts["near"]["caught"]["sampling"][1]


def test_the_table_on_the_screen_names_what_is_not_known(run):
    assert text_header(run.maps)[-2:] == ("95 % predictive", "95 % sampling")
    rows = text_rows(run.maps)
    assert [row[0] for row in rows if row[0]] == ["near", "far", "idle"]
    far = {row[1]: row for row in rows[9:18]}
    assert far["p95 energy (kJ)"][4] == far["caught in the end"][4] == "not known"
    assert far["p95 energy (kJ)"][5] not in ("", "not known")
    assert far["came"][4].startswith("0-")
    assert {row[1]: row for row in rows[:9]}["capacity (kJ)"][3] == "20"
    assert rows[18 + 1][3:] == ("-", "not known", "not known"), "shares of no rocks"


def test_a_scene_without_unknowns_has_sampling_intervals_only(folder):
    known = SCENE.replace("{prior: {min: 0.2, max: 0.6}}", "0.4")
    maps = simulate(written(folder, known)).maps
    assert text_header(maps)[-1] == "95 % sampling" and "95 % predictive" not in text_header(maps)
    assert all(len(row) == len(text_header(maps)) for row in text_rows(maps))


def test_the_run_says_which_barriers_are_surer_than_they_may_be(run):
    shares, p95 = (line for line in surer_than_it_may_be(run) if "(barrier)" in line)
    assert shares.startswith("intervals of shares at far (barrier) hold the number of rocks only")
    assert p95.startswith("intervals of p95 energies and heights at near, far (barrier)")


@pytest.mark.parametrize("more", ["", "unknowns: {misfit: 2}\n"])
def test_the_summary_says_that_a_misfit_is_not_in_the_intervals_of_barriers(folder, more):
    found = summary(simulate(written(folder, SCENE.replace("rocks: 640", "rocks: 64") + more)))["barriers"]["near"]
    assert ("leaves_out" in found) == bool(more)
